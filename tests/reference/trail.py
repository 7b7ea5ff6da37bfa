"""Evidence along a path, and the best path nearby, as they are defined: one frame and one tap after another."""

from __future__ import annotations

import numpy as np


def keys(d):
    """Cubic convolution kernel of Keys (1981), eq. 15, a = -1/2."""
    d = abs(d)
    if d < 1:
        return 1.5 * d**3 - 2.5 * d**2 + 1
    return -0.5 * d**3 + 2.5 * d**2 - 4 * d + 2 if d < 2 else 0.0


def between(patch, x, y):
    """Evidence at a place of a patch; its outermost cells are repeated outside, and half a cell outside it ends."""
    rows, columns = patch.shape
    if not (-0.5 <= x <= columns - 0.5 and -0.5 <= y <= rows - 0.5):
        return 0.0
    wide = np.pad(patch.astype(float), 3, mode="edge")
    if rows == 1:
        return sum(keys(x - k) * wide[3, 3 + k] for k in range(-3, columns + 3))
    return sum(
        keys(y - i) * keys(x - k) * wide[3 + i, 3 + k] for i in range(-3, rows + 3) for k in range(-3, columns + 3)
    )


def values(patches, corners, ages, path):
    """Evidence of each frame along a path x, y, vx, vy."""
    places = path[:2] - np.outer(ages, path[2:]) - corners
    return np.array([between(patch, *place) for patch, place in zip(patches, places, strict=True)])


def climb(patches, corners, ages, weights, start, step):
    """Each part of the path in turn to the top of a parabola through three points, until none moves."""
    mean = np.average(ages, weights=weights)
    spread = np.sqrt(np.average((ages - mean) ** 2, weights=weights))
    directions = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [mean, 0, 1, 0], [0, mean, 0, 1]], float)
    reach = [step, step, step / spread if spread else 0, step / spread if spread else 0]
    score = lambda path: weights @ values(patches, corners, ages, path)  # noqa: E731
    path = np.array(start, float)
    highest = score(path)
    for _ in range(20):
        moves = []
        for part in range(4):
            if reach[part] == 0 or (patches.shape[1] == 1 and part in (1, 3)):
                continue
            way = reach[part] * directions[part]
            low, here, high = score(path - way), score(path), score(path + way)
            bend = 2 * here - low - high
            share = np.clip(0.5 * (high - low) / bend, -1, 1) if bend > 0 else np.sign(high - low)
            if score(path + share * way) > 0.99 * highest:
                path = path + share * way
                highest = max(highest, score(path))
                moves.append(abs(share))
        if max(moves, default=0) < 0.01:
            break
    return path
