"""Compiled kernel of the shortest distance to the coast."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True)
def distances(
    index: Any,
    cells: NDArray[np.int64],
    on_border: NDArray[np.bool_],
    x: Array,
    y: Array,
    wanted: NDArray[np.bool_],
) -> Array:
    """Distance to the nearest edge that the cell of each position lists, but for those on the charts' border [m].

    Infinite where there is none, and at positions that are not wanted.
    """
    first, runs, vertices, per_length = index.first, index.runs, index.vertices, index.per_length
    out = np.full(len(x), np.inf)
    for n in range(len(x)):
        cell = cells[n]
        if cell < 0 or not wanted[n]:
            continue
        least = np.inf
        for r in range(first[cell], first[cell + 1]):
            i, end = runs[r, 0], runs[r, 1]
            bx, by = vertices[i, 0] - x[n], vertices[i, 1] - y[n]
            while i < end:
                coast, scale = not on_border[i], per_length[i] * per_length[i]
                i += 1
                ax, ay = bx, by
                bx, by = vertices[i, 0] - x[n], vertices[i, 1] - y[n]
                if coast:
                    ex, ey = bx - ax, by - ay
                    share = min(max(-(ax * ex + ay * ey) * scale, 0.0), 1.0)
                    dx, dy = ax + share * ex, ay + share * ey
                    least = min(least, dx * dx + dy * dy)
        out[n] = math.sqrt(least)
    return out
