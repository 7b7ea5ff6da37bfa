"""Compiled kernels of how far a target's echo reaches in radar video: what it explains, and nobody else.

A pulse and a beam that are Gaussian, about, let an echo fall as a parabola in decibels. How wide it is is read from the
echo itself, where it is strongest: from its peak to half of its power.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array

MOST = 40.0  # evidence and logarithm of a likelihood ratio up to which they are told apart
CLAIMS = 0.05  # existence from which a target's cells are no other's
REACH = 2  # cells to each side that a target shows in, however faint
CLIMB = 16  # cells from where a target is found to where its echo is strongest, and to half of that, at most
HALF = np.log(2.0)  # fall of the logarithm of power to half
OWN = np.log(4.0)  # excess of a cell over a target's echo beyond which that is less than half of its amplitude

Sea = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64], NDArray[np.float32]]


@njit(cache=True, nogil=True, error_model="numpy")
def claim(
    parts: NDArray[np.int64], existence: Array, log_ratio: Array, spot: NDArray[np.int64], power: NDArray[np.float32],
    sea: Sea, claimed: NDArray[np.float32],
) -> None:  # fmt: skip
    """Add the probability that one target, of whom ``parts`` exclude each other, shows in the cells round ``spot``.

    These are the nearest, and all in which its echo is expected to exceed the sea and is no less than half of the
    amplitude.
    """
    rows, columns = claimed.shape
    whole = 1.0
    for t in parts:
        whole += existence[t] * (np.exp(min(log_ratio[t], MOST)) - 1)
    for t in parts:
        there = existence[t] * np.exp(min(log_ratio[t], MOST)) / whole
        row, column = spot[t]
        if there > CLAIMS and column >= 0:
            level, middle, across, near, along = _echo(power, sea, row, column)
            tall, deep = min(across * np.sqrt(level / HALF), rows // 4), along * np.sqrt(level / HALF)
            first, last = min(row - REACH, int(middle - tall)), max(row + REACH, int(middle + tall) + 1)
            left, right = min(column - REACH, int(near - deep)), max(column + REACH, int(near + deep) + 1)
            for a in range(first, last + 1):
                for c in range(max(left, 0), min(right + 1, columns)):
                    own = abs(a - row) <= REACH and abs(c - column) <= REACH
                    if not own:
                        expected = level - HALF * (((a - middle) / across) ** 2 + ((c - near) / along) ** 2)
                        own = expected > 0 and _over(power, sea, a % rows, c) < expected + OWN
                    if own:
                        claimed[a % rows, c] = min(claimed[a % rows, c] + there, 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _over(
    power: NDArray[np.float32], sea: Sea, row: int, column: int
) -> float:  # fmt: skip
    """Logarithm of a cell's power to what is expected of the sea there; minus infinity where it is not known."""
    mean, slope, sector, across = sea
    value = np.float64(power[row, column])
    if not value > 0.0:
        return -np.inf
    s = sector[row]
    return float(np.log(value) - mean[s, column] - across[row] * slope[s, column])


@njit(cache=True, nogil=True, error_model="numpy")
def _echo(
    power: NDArray[np.float32], sea: Sea, row: int, column: int
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Return the echo uphill of a cell: its level over the sea, its middle and half its width in rows, in columns.

    The width is that between half powers, no more than twice CLIMB; rows are not taken round the turn.
    """
    rows, columns = power.shape
    column = min(max(column, 0), columns - 1)
    most = power[row % rows, column]
    for _ in range(CLIMB):
        up, out = row, column
        for a in range(row - 1, row + 2):
            for c in range(max(column - 1, 0), min(column + 2, columns)):
                if power[a % rows, c] > most:
                    most, up, out = power[a % rows, c], a, c
        if up == row and out == column:
            break
        row, column = up, out
    level = max(_over(power, sea, row % rows, column), 0.0)
    above, below = _half(power, row, column, -1, 0), _half(power, row, column, 1, 0)
    before, behind = _half(power, row, column, 0, -1), _half(power, row, column, 0, 1)
    return (
        level, row + 0.5 * (below - above), 0.5 * (below + above), column + 0.5 * (behind - before),
        0.5 * (behind + before),
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _half(power: NDArray[np.float32], row: int, column: int, down: int, right: int) -> float:
    """Cells in one direction after which the power has fallen to half, its logarithm between cells on a line."""
    rows, columns = power.shape
    before = top = np.log(np.float64(power[row % rows, column]))
    for n in range(1, CLIMB):
        c = column + n * right
        if c < 0 or c >= columns:
            break
        value = np.float64(power[(row + n * down) % rows, c])
        if not value > 0.0:
            break
        here = np.log(value)
        if here < top - HALF:
            return float(n - 1 + (before - top + HALF) / (before - here))
        before = here
    return float(CLIMB)
