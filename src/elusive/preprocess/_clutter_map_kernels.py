"""Compiled kernels of a clutter map: levels followed, counted by block, and what they say against those counts.

What is expected of a cell ``(A, R)`` is a line across its sector at its range, by ``mean`` and ``slope`` ``(S, R)``, of
``sector`` and ``across`` ``(A,)`` of its row; its block is that of its sector and of ``part`` ``(R,)`` of its column.
Where it is ``fixed`` its own level is expected of it; ``beside`` are those of them that are beside a fixed echo.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True, error_model="numpy")
def sums(
    level: NDArray[np.float32], counted: NDArray[np.bool_], sector: NDArray[np.int64], across: NDArray[np.float32],
    found: Array,
) -> None:  # fmt: skip
    """Add cells that are counted to sums ``(5, S, R)``: of 1, level, across, its square, its product with level."""
    for i in range(level.shape[0]):
        x, s = np.float64(across[i]), sector[i]
        for j in range(level.shape[1]):
            if counted[i, j]:
                found[0, s, j] += 1
                found[1, s, j] += level[i, j]
                found[2, s, j] += x
                found[3, s, j] += x * x
                found[4, s, j] += x * level[i, j]


@njit(cache=True, nogil=True, error_model="numpy")
def follow(
    level: NDArray[np.float32], pace: float, falls: float, rises: float, sunk: float, own: NDArray[np.float32],
    quiet: NDArray[np.float32],
) -> None:  # fmt: skip
    """Let each cell's mean level, and its quiet one, follow a turn's, in place; NaN leaves them as they are.

    The quiet level falls or rises by a step, and falls by half of what it is more than ``sunk`` above; with steps of 0
    it is the least so far.
    """
    pace_, fall, rise, sunk_ = np.float32(pace), np.float32(falls), np.float32(rises), np.float32(sunk)
    half = np.float32(0.5)
    for i in range(level.shape[0]):
        for j in range(level.shape[1]):
            value = level[i, j]
            if value == value:
                own[i, j] += pace_ * (value - own[i, j])
                if falls == 0:
                    quiet[i, j] = min(quiet[i, j], value)
                elif value < quiet[i, j]:
                    quiet[i, j] -= fall + half * max(quiet[i, j] - value - sunk_, np.float32(0.0))
                else:
                    quiet[i, j] += rise


@njit(cache=True, nogil=True, error_model="numpy")
def count(
    level: NDArray[np.float32], counted: NDArray[np.bool_], mean: NDArray[np.float32], slope: NDArray[np.float32],
    sector: NDArray[np.int64], across: NDArray[np.float32], part: NDArray[np.int64], own: NDArray[np.float32],
    fixed: NDArray[np.bool_], beside: NDArray[np.bool_], low: float, width: float, counts: Array,
) -> None:  # fmt: skip
    """Count cells by block and by how far they are above what is expected; NaN is left out.

    ``counts`` ``(S P + 2, BINS)``: the last two are of all that is beside a fixed echo, and of these.
    """
    blocks, bins = counts.shape
    parts = part.max() + 1
    for i in range(level.shape[0]):
        for j in range(level.shape[1]):
            if level[i, j] != level[i, j] or not (fixed[i, j] or counted[i, j]):
                continue
            if fixed[i, j]:
                middle, block = own[i, j], blocks - 2 if beside[i, j] else blocks - 1
            else:
                middle = mean[sector[i], j] + across[i] * slope[sector[i], j]
                block = sector[i] * parts + part[j]
            number = int((level[i, j] - middle - low) / width)
            counts[block, min(max(number, 0), bins - 1)] += 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def judge(
    level: NDArray[np.float32], asked: NDArray[np.bool_], mean: NDArray[np.float32], slope: NDArray[np.float32],
    sector: NDArray[np.int64], across: NDArray[np.float32], part: NDArray[np.int64], own: NDArray[np.float32],
    fixed: NDArray[np.bool_], beside: NDArray[np.bool_], low: float, width: float, table: Array,
    found: NDArray[np.float32],
) -> None:  # fmt: skip
    """Read the evidence of cells that are asked for from their block's table, linearly between lower edges of bins.

    ``table`` ``(2 S P + 1, BINS)``: of the blocks, of what is fixed, and of what is beside that in each block. Other
    cells of ``found`` stay; that of NaN is NaN.
    """
    bins = table.shape[1]
    parts = part.max() + 1
    still = len(table) // 2
    finer = 1 / width
    for i in range(level.shape[0]):
        for j in range(level.shape[1]):
            if not asked[i, j]:
                continue
            block = sector[i] * parts + part[j]
            if fixed[i, j]:
                middle, block = own[i, j], still + 1 + block if beside[i, j] else still
            else:
                middle = mean[sector[i], j] + across[i] * slope[sector[i], j]
            place = (level[i, j] - middle - low) * finer
            if place != place:
                found[i, j] = np.nan
                continue
            number = min(int(max(place, 0.0)), bins - 2)
            share = min(max(place - number, 0.0), 1.0)
            row = table[block]
            found[i, j] = (1 - share) * row[number] + share * row[number + 1]


@njit(cache=True, nogil=True, error_model="numpy")
def stands(
    level: NDArray[np.float32], mean: NDArray[np.float32], slope: NDArray[np.float32], sector: NDArray[np.int64],
    across: NDArray[np.float32], part: NDArray[np.int64], edge: Array,
) -> NDArray[np.bool_]:  # fmt: skip
    """Say which cells are further above what is expected of the sea than their block's ``edge`` ``(S P,)``.

    What is not finite is not known, and none of them.
    """
    rows, columns = level.shape
    parts = part.max() + 1
    found = np.empty((rows, columns), np.bool_)
    for i in range(rows):
        s, x = sector[i], across[i]
        line, there, first, rise = found[i], level[i], mean[s], slope[s]
        for j in range(columns):
            over = there[j] - (first[j] + x * rise[j])
            line[j] = over > edge[s * parts + part[j]] and over < np.inf
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def widened(cells: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Cells within ``reach`` rows, round the turn, and columns of one of some ``(A, R)``."""
    rows, columns = cells.shape
    wide, found = np.zeros_like(cells), np.zeros_like(cells)
    for i in range(rows):
        until = -1
        for j in range(-reach, columns):
            if j + reach < columns and cells[i, j + reach]:
                until = j + 2 * reach
            if j >= 0:
                wide[i, j] = j <= until
    left = np.zeros(columns, np.int64)
    for i in range(-2 * reach, rows):
        ahead = (i + reach) % rows
        for j in range(columns):
            left[j] = 2 * reach + 1 if wide[ahead, j] else left[j] - 1
        if i >= 0:
            for j in range(columns):
                found[i, j] = left[j] > 0
    return found
