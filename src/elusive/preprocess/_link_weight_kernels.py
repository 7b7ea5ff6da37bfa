"""Compiled kernel of the link weights: the voxels of each link's ellipse, found within its bounding box."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array

DISTANCE, BINARY, INVERSE_ROOT = 0, 1, 2
ON_LINE_M = 1e-9  # an excess path this small is none, where equality is asked for


@njit(cache=True, nogil=True)
def ellipses(
    positions: Array,
    links: NDArray[np.int64],
    corner: tuple[float, float],
    voxel: float,
    shape: tuple[int, int],
    inside: NDArray[np.bool_],
    excess: float,
    band: float,
    coefficients: tuple[float, float],
    weighting: int,
    first: NDArray[np.int64],
    columns: NDArray[np.int32],
    weights: Array,
) -> None:
    """Write each link's voxels and weights, those of link l from ``first[l]`` on.

    With ``columns`` empty only ``first`` is written: where each link begins. ``band`` is the greatest perpendicular
    distance of a voxel on the line of sight; negative: its excess path must vanish.
    """
    counting = len(columns) == 0
    rows, width = shape
    n = 0
    for link in range(len(links)):
        if counting:
            first[link] = n
        ax, ay = positions[links[link, 0]]
        bx, by = positions[links[link, 1]]
        dx, dy = bx - ax, by - ay
        d = math.sqrt(dx * dx + dy * dy)
        major = 0.5 * (d + excess)
        minor = math.sqrt(major * major - 0.25 * d * d)
        half_x = math.hypot(major * dx, minor * dy) / d
        half_y = math.hypot(major * dy, minor * dx) / d
        middle_x, middle_y = 0.5 * (ax + bx) - corner[0], 0.5 * (ay + by) - corner[1]
        left = max(0, math.floor((middle_x - half_x) / voxel - 0.5))
        right = min(width - 1, math.ceil((middle_x + half_x) / voxel - 0.5))
        low = max(0, math.floor((middle_y - half_y) / voxel - 0.5))
        high = min(rows - 1, math.ceil((middle_y + half_y) / voxel - 0.5))
        for row in range(low, high + 1):
            y = corner[1] + (row + 0.5) * voxel
            for column in range(left, right + 1):
                if not inside[row * width + column]:
                    continue
                x = corner[0] + (column + 0.5) * voxel
                from_a = math.sqrt((x - ax) * (x - ax) + (y - ay) * (y - ay))
                from_b = math.sqrt((x - bx) * (x - bx) + (y - by) * (y - by))
                path = from_a + from_b
                if not path < d + excess:
                    continue
                if not counting:
                    if weighting == BINARY:
                        weight = 1.0
                    elif weighting == INVERSE_ROOT:
                        weight = 1.0 / math.sqrt(d)
                    else:
                        off = abs((x - ax) * dy - (y - ay) * dx)
                        sees = path - d < ON_LINE_M if band < 0.0 else off < band * d
                        weight = (coefficients[1 if sees else 0] + max(from_a, from_b)) / d
                    columns[n] = row * width + column
                    weights[n] = weight
                n += 1
    if counting:
        first[len(links)] = n
