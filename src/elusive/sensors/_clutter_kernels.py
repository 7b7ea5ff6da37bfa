"""Compiled kernel of the clutter sensor: a map read at places."""

from __future__ import annotations

import numpy as np

from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True)
def sample_places(image: Array, places: Array) -> Array:
    """Bilinear value of the image at each x and y; at the border's beyond it."""
    rows, columns = image.shape
    out = np.empty(len(places))
    for i in range(len(places)):
        x, y = min(max(places[i, 0], 0.0), columns - 1.0), min(max(places[i, 1], 0.0), rows - 1.0)
        column, row = min(int(x), columns - 2), min(int(y), rows - 2)
        u, v = x - column, y - row
        upper = (1.0 - u) * image[row, column] + u * image[row, column + 1]
        lower = (1.0 - u) * image[row + 1, column] + u * image[row + 1, column + 1]
        out[i] = (1.0 - v) * upper + v * lower
    return out
