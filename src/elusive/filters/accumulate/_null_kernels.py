"""Compiled kernel of what noise alone scores along a signal: one velocity after the other, through all frames."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import uint64

from elusive._njit import njit


@njit(cache=True, nogil=True)
def highest(
    doubled: Any, drawn: Any, turned: Any, offsets: Any, keep: Any, bounded: bool, ages: Any, best: Any
) -> None:  # fmt: skip
    """Fill ``best`` ``(ages, n)`` with the maximum over velocities of eq. 7 of Mazurek (2013), after these ages.

    Frame ``k`` is the row ``drawn[k]`` of ``doubled`` ``(stock, 2 n)``, evidence twice side by side, turned round by
    ``turned[k]``. A cell of the trajectories of velocity v, ``offsets[v]`` at each age from zero on, stays where it is:
    only that row is in work, and stays in the fastest cache.
    """
    n = best.shape[1]
    plane = np.empty(n, doubled.dtype)
    best[:] = -np.inf
    for v in range(len(offsets)):
        plane[:] = 0
        age = 0
        for k in range(ages[-1]):
            at = offsets[v, k + 1]
            if bounded:
                # what has just entered, where something has left at the other side
                for place in range(max(0, n + at - offsets[v, k]), n):
                    plane[(place - at) % n] = 0
                for place in range(min(n, at - offsets[v, k])):
                    plane[(place - at) % n] = 0
            row, start = drawn[k], uint64((at + turned[k]) % n)
            for i in range(uint64(n)):
                plane[i] = keep * plane[i] + doubled[row, start + i]
            if k + 1 == ages[age]:
                # in two pieces, so that many cells are compared at once
                turn = uint64(at % n)
                split = uint64(n) - turn
                for i in range(split):
                    best[age, turn + i] = max(best[age, turn + i], plane[i])
                for i in range(turn):
                    best[age, i] = max(best[age, i], plane[split + i])
                age += 1
