"""Compiled kernel of a turn's evidence: its mean in a frame about each cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit


@njit(cache=True, nogil=True, error_model="numpy")
def mean_about(
    evidence: NDArray[np.float32], around: int, guard: int, most: float, least: float
) -> NDArray[np.float32]:  # fmt: skip
    """Mean of evidence ``(A, R)``, none above ``most``, over ``around`` rows and columns less ``guard``, both odd.

    Rows go round the turn; beyond an end of range it is as at that end. NaN has no weight; where nothing else is, and
    where the mean is less, it is ``least``.
    """
    rows, columns = evidence.shape
    total, known = np.zeros((2, columns)), np.zeros((2, columns))
    halves = (around // 2, guard // 2)
    found = np.empty((rows, columns), np.float32)
    for i in range(-around, rows):  # sums of each column, of which a row comes and one goes
        for box in range(2):
            half = halves[box]
            for sign in (1, -1):
                if i < -2 * half - 1 or (i < 0 and sign < 0):
                    continue
                row = evidence[(i + half if sign > 0 else i - half - 1) % rows]
                for j in range(columns):
                    if row[j] == row[j]:
                        total[box, j] += sign * min(np.float64(row[j]), most)
                        known[box, j] += sign
        if i < 0:
            continue
        sums = np.zeros((2, 2))
        for box in range(2):
            for c in range(-halves[box], halves[box]):
                at = min(max(c, 0), columns - 1)
                sums[box, 0] += total[box, at]
                sums[box, 1] += known[box, at]
        for j in range(columns):
            for box in range(2):
                comes, goes = min(j + halves[box], columns - 1), max(j - halves[box] - 1, 0)
                sums[box, 0] += total[box, comes] - (total[box, goes] if j > 0 else 0.0)
                sums[box, 1] += known[box, comes] - (known[box, goes] if j > 0 else 0.0)
            weight = sums[0, 1] - sums[1, 1]
            found[i, j] = max((sums[0, 0] - sums[1, 0]) / weight, least) if weight > 0.5 else least
    return found
