"""Compiled kernels of a target's trail: evidence along a path that runs between the cells, and the best such path.

Between cells evidence is read by cubic convolution (Keys, 1981). A signal's patches have one row.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from elusive._njit import njit

ROUNDS = 20
ENOUGH = 0.01  # of a step, under which a climb has ended
LEVEL = 0.99  # of the highest sum so far, that the middle between two balanced sides may lie below it


@njit(cache=True, nogil=True)
def _value(patch: Any, x: float, y: float) -> float:
    """Evidence at a place of a patch, counted in its cells; 0 more than half a cell outside."""
    rows, columns = patch.shape
    if not (-0.5 <= x <= columns - 0.5 and -0.5 <= y <= rows - 0.5):
        return 0.0
    column, row = int(np.floor(x)), int(np.floor(y))
    total = 0.0
    for i in range(-1, 3) if rows > 1 else range(1):
        weight = _taps(y - row - i) if rows > 1 else 1.0
        line = min(max(row + i, 0), rows - 1)
        for k in range(-1, 3):
            total += weight * _taps(x - column - k) * patch[line, min(max(column + k, 0), columns - 1)]
    return total


@njit(cache=True, nogil=True)
def _taps(distance: float) -> float:
    d = abs(distance)
    if d < 1:
        return 1 + d * d * (1.5 * d - 2.5)
    return 2 + d * (d * (2.5 - 0.5 * d) - 4) if d < 2 else 0.0


@njit(cache=True, nogil=True)
def values(patches: Any, corners: Any, ages: Any, path: Any) -> Any:
    """Evidence of each frame where a path ``x, y, vx, vy`` stood then, ``(K,)``."""
    found = np.empty(len(ages))
    for k in range(len(ages)):
        x, y = path[0] - ages[k] * path[2], path[1] - ages[k] * path[3]
        found[k] = _value(patches[k], x - corners[k, 0], y - corners[k, 1])
    return found


@njit(cache=True, nogil=True)
def total(patches: Any, corners: Any, ages: Any, weights: Any, path: Any) -> float:
    """Weighted sum of :func:`values`; frames without weight are not read."""
    found = 0.0
    for k in range(len(ages)):
        if weights[k] > 0:
            x, y = path[0] - ages[k] * path[2], path[1] - ages[k] * path[3]
            found += weights[k] * _value(patches[k], x - corners[k, 0], y - corners[k, 1])
    return found


@njit(cache=True, nogil=True)
def climb(patches: Any, corners: Any, ages: Any, weights: Any, start: Any, step: float) -> Any:
    """Path about ``start`` along which most evidence lies: where it is level at a step to either side.

    Places are varied at the mean age of the frames, where they do not depend on the velocity; the velocity so that it
    moves the place by a step at their deviation.
    """
    path = start.copy()
    whole = weights.sum()
    if whole <= 0:
        return path
    mean = (weights * ages).sum() / whole
    spread = np.sqrt(max((weights * ages * ages).sum() / whole - mean * mean, 0.0))
    line = patches.shape[1] == 1
    highest = total(patches, corners, ages, weights, path)
    for _ in range(ROUNDS):
        farthest = 0.0
        for part in range(4):
            if (line and part % 2 == 1) or (part > 1 and spread == 0):
                continue
            reach = step if part < 2 else step / spread
            below, here, above = path.copy(), total(patches, corners, ages, weights, path), path.copy()
            for other, sign in ((below, -1.0), (above, 1.0)):
                other[part] += sign * reach
                if part > 1:
                    other[part - 2] += sign * reach * mean
            low, high = total(patches, corners, ages, weights, below), total(patches, corners, ages, weights, above)
            bend = 2 * here - low - high
            share = 0.5 * (high - low) / bend if bend > 0 else np.sign(high - low)
            share = min(max(share, -1.0), 1.0)
            moved = path.copy()
            moved[part] += share * reach
            if part > 1:
                moved[part - 2] += share * reach * mean
            # to where the two sides balance, even if the top lies a little elsewhere
            there = total(patches, corners, ages, weights, moved)
            if there > LEVEL * highest:
                path, highest = moved, max(highest, there)
                farthest = max(farthest, abs(share))
        if farthest < ENOUGH:
            break
    return path
