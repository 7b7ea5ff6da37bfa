"""Compiled kernel of a turn's evidence: its mean about each cell."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True, error_model="numpy")
def mean_about(evidence: NDArray[np.float32], around: int, most: float, least: float) -> NDArray[np.float32]:
    """Mean of evidence ``(A, R)``, none above ``most``, over ``around`` rows and columns about each cell, both odd.

    Rows go round the turn; beyond an end of range it is as at that end. NaN has no weight; where nothing else is, and
    where the mean is less, it is ``least``.
    """
    rows, columns = evidence.shape
    half = around // 2
    total, known = np.zeros(columns), np.zeros(columns)
    found = np.empty((rows, columns), np.float32)
    for i in range(-around, rows):  # sums of each column, of which a row comes and one goes
        for enters in range(2):
            if i < 0 and not enters:
                continue
            row = evidence[(i + half if enters else i - half - 1) % rows]
            sign = 1.0 if enters else -1.0
            for j in range(columns):
                if row[j] == row[j]:
                    total[j] += sign * min(np.float64(row[j]), most)
                    known[j] += sign
        if i < 0:
            continue
        value, weight = 0.0, 0.0
        for c in range(-half, half):
            at = min(max(c, 0), columns - 1)
            value, weight = value + total[at], weight + known[at]
        for j in range(columns):
            comes, goes = min(j + half, columns - 1), max(j - half - 1, 0)
            value, weight = value + total[comes], weight + known[comes]
            if j > 0:
                value, weight = value - total[goes], weight - known[goes]
            found[i, j] = max(value / weight, least) if weight > 0.5 else least
    return found
