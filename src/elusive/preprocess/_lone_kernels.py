"""Compiled kernel of radar video: spokes without samples that exceed both their neighbours by too much."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit


@njit(cache=True, nogil=True, error_model="numpy")
def without_lone(
    amplitude: NDArray[Any], away: int, reach: NDArray[np.float32], limit: NDArray[np.float32],
    low: NDArray[np.float32], least: float,
) -> tuple[NDArray[np.float32], int]:  # fmt: skip
    """Return spokes ``(n, m)`` of ``(n + 2 away, m)`` amplitudes, NaN where one is lone, and how many are.

    A sample is lone that exceeds those ``away`` spokes before and behind, and ``least``, by ``limit`` ``(m,)`` times
    ``reach`` ``(n,)``; so is what goes on from it along its spoke and exceeds them by ``low`` ``(m,)`` times that.
    Where both others are 0 nothing is known.
    """
    n, columns = len(reach), amplitude.shape[1]
    found = np.empty((n, columns), np.float32)
    over, taken = np.empty(columns, np.float32), 0
    for i in range(n):
        here, before, behind = amplitude[i + away], amplitude[i], amplitude[i + 2 * away]
        line, some = found[i], False
        share = np.float32(1 / reach[i])
        for k in range(columns):
            value = np.float32(here[k])
            beside = max(max(np.float32(before[k]), np.float32(behind[k])), np.float32(least))
            line[k] = value
            over[k] = value * share / beside if beside > 0 else 0.0
            some |= over[k] > limit[k]
        if not some:
            continue
        for k in range(columns):
            if not over[k] > limit[k]:
                continue
            first, last = k, k
            while first > 0 and over[first - 1] > low[first - 1]:
                first -= 1
            while last < columns - 1 and over[last + 1] > low[last + 1]:
                last += 1
            for one in range(first, last + 1):
                taken += line[one] == line[one]
                line[one] = np.nan
    return found, taken
