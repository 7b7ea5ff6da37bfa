"""Compiled kernel of the clutter sensor: a map read at the states."""

from __future__ import annotations

import numpy as np
from numba import njit

from elusive.contracts import Array


@njit(cache=True, nogil=True)
def sample_states(image: Array, states: Array, outside: float) -> Array:
    """Bilinear value of the image at each state's x (column 0) and y (column 2); ``outside`` off the pixel centres."""
    rows, columns = image.shape
    out = np.empty(len(states))
    for i in range(len(states)):
        x, y = states[i, 0], states[i, 2]
        if not (x >= 0.0 and y >= 0.0 and x <= columns - 1.0 and y <= rows - 1.0):
            out[i] = outside
            continue
        column, row = min(int(x), columns - 2), min(int(y), rows - 2)
        u, v = x - column, y - row
        upper = (1.0 - u) * image[row, column] + u * image[row, column + 1]
        lower = (1.0 - u) * image[row + 1, column] + u * image[row + 1, column + 1]
        out[i] = (1.0 - v) * upper + v * lower
    return out
