"""Compiled kernels of the field: a bicubic B-spline over sparse tiles, fitted and read."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.charts._index_kernels import INNER, SHIFT, TILE
from elusive.contracts import Array

SIDE = TILE + 3  # coefficients along a tile: its own and those that its splines share with the next
QUANTUM = 1.2 / 65534  # what a coefficient's step of one stands for; 0 stands for one half
TWICE = SHIFT + SHIFT
ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)
MARGIN = 4  # knots beyond a tile that its coefficients need
# 1 / (1 + d/6), d the second difference: the inverse of a cubic B-spline at its knots, to the sixth power of the step
PREFILTER = (1 + 1 / 3 + 1 / 6 + 5 / 54, -(1 / 6 + 1 / 9 + 5 / 72), 1 / 36 + 1 / 36, -1 / 216)


@njit(cache=True, nogil=True)
def fit(
    codes: NDArray[np.int32],
    blocks: NDArray[np.int32],
    tiles: NDArray[np.int32],
    values: NDArray[np.float32],
    out: NDArray[np.int16],
) -> None:
    """Set the coefficients of the tiles from the values in them and in their neighbours.

    ``blocks`` and ``codes`` are the two levels that lead to a tile's place among the values, or to its winding number.
    """
    wide = SIDE + 6
    knots, rows = np.empty((wide, wide)), np.empty((SIDE, wide))
    for k in range(len(tiles)):
        for row in range(wide):
            j = tiles[k, 0] * TILE + row - MARGIN
            for column in range(wide):
                i = tiles[k, 1] * TILE + column - MARGIN
                knots[row, column] = _value(codes, blocks, values, j, i)
        for row in range(SIDE):
            for column in range(wide):
                total = PREFILTER[0] * knots[row + 3, column]
                for n in range(1, 4):
                    total += PREFILTER[n] * (knots[row + 3 - n, column] + knots[row + 3 + n, column])
                rows[row, column] = total
        for row in range(SIDE):
            for column in range(SIDE):
                total = PREFILTER[0] * rows[row, column + 3]
                for n in range(1, 4):
                    total += PREFILTER[n] * (rows[row, column + 3 - n] + rows[row, column + 3 + n])
                out[k, row, column] = round(min(max((total - 0.5) / QUANTUM, -32767.0), 32767.0))


@njit(cache=True, nogil=True)
def _value(codes: NDArray[np.int32], blocks: NDArray[np.int32], values: NDArray[np.float32], j: int, i: int) -> float:
    """Value at the knot of row j and column i; that of open water or of firm land away from the tiles."""
    row, column = j // TILE, i // TILE
    code = -1
    if 0 <= row < TILE * blocks.shape[0] and 0 <= column < TILE * blocks.shape[1]:
        code = blocks[row // TILE, column // TILE]
        if code >= 0:
            code = codes[(code * TILE + row % TILE) * TILE + column % TILE]
    if code >= 0:
        return float(values[code, j % TILE, i % TILE])
    return 1.0 if code == -1 else 0.0


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def read(spline: Any, x: Array, y: Array, area: NDArray[np.int8], wanted: int, out: Array) -> None:
    """Set P of the positions whose area is the wanted one."""
    sixth = 1.0 / 6.0
    # read from the tuple within the loop, each would cost a count of references
    x0, y0, per_step = spline.x0, spline.y0, spline.per_step
    blocks, codes, c = spline.blocks, spline.codes, spline.coefficients
    columns, rows = float(TILE * TILE * blocks.shape[1]), float(TILE * TILE * blocks.shape[0])
    for n in range(len(x)):
        if area[n] != wanted:
            continue
        u, v = (x[n] - x0) * per_step, (y[n] - y0) * per_step
        tile = np.int64(-1)
        column, row = np.uint64(0), np.uint64(0)
        if u >= 0.0 and v >= 0.0 and u < columns and v < rows:
            column, row = np.uint64(np.int64(u)), np.uint64(np.int64(v))
            block = np.int64(blocks[row >> TWICE, column >> TWICE])
            tile = block
            if block >= 0:
                at = (row >> SHIFT & INNER) * np.uint64(TILE) + (column >> SHIFT & INNER)
                tile = np.int64(codes[np.uint64(block * TILE * TILE) + at])
        if tile < 0:
            out[n] = 1.0 if tile == -1 else 0.0
            continue
        u, v = u - column, v - row
        k = np.uint64(tile * SIDE * SIDE) + (row & INNER) * np.uint64(SIDE) + (column & INNER)
        p, q = 1.0 - u, 1.0 - v
        u0, u3, u1 = p * p * p * sixth, u * u * u * sixth, 4.0 * sixth - u * u * (1.0 - 0.5 * u)
        v0, v3, v1 = q * q * q * sixth, v * v * v * sixth, 4.0 * sixth - v * v * (1.0 - 0.5 * v)
        u2, v2 = 1.0 - u0 - u1 - u3, 1.0 - v0 - v1 - v3
        next_, below, last = k + np.uint64(SIDE), k + np.uint64(2 * SIDE), k + np.uint64(3 * SIDE)
        w0 = v0 * c[k] + v1 * c[next_] + v2 * c[below] + v3 * c[last]
        w1 = v0 * c[k + ONE] + v1 * c[next_ + ONE] + v2 * c[below + ONE] + v3 * c[last + ONE]
        w2 = v0 * c[k + TWO] + v1 * c[next_ + TWO] + v2 * c[below + TWO] + v3 * c[last + TWO]
        w3 = v0 * c[k + THREE] + v1 * c[next_ + THREE] + v2 * c[below + THREE] + v3 * c[last + THREE]
        total = u0 * w0 + u1 * w1 + u2 * w2 + u3 * w3
        root = 0.5 + QUANTUM * total
        out[n] = min(root * root, 1.0)
