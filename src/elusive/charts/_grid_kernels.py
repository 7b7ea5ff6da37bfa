"""Compiled kernel that reads a grid of probabilities."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True)
def read(
    grid: NDArray[np.float32],
    x0: float,
    y0: float,
    per_cell: float,
    bilinear: bool,
    x: Array,
    y: Array,
    area: NDArray[np.int8],
    wanted: int,
    out: Array,
) -> None:
    """Set the value between the cells' middles, or in the nearest cell, of the positions of one area; 1 off the grid.

    ``x0, y0`` is the middle of the first cell.
    """
    rows, columns = grid.shape
    for n in range(len(x)):
        if area[n] != wanted:
            continue
        u, v = (x[n] - x0) * per_cell, (y[n] - y0) * per_cell
        if not (u > -0.5 and v > -0.5 and u < columns - 0.5 and v < rows - 0.5):
            out[n] = 1.0
        elif bilinear:
            u, v = min(max(u, 0.0), columns - 1.0), min(max(v, 0.0), rows - 1.0)
            i, j = min(int(u), columns - 2), min(int(v), rows - 2)
            u, v = u - i, v - j
            lower = (1.0 - u) * grid[j, i] + u * grid[j, i + 1]
            upper = (1.0 - u) * grid[j + 1, i] + u * grid[j + 1, i + 1]
            out[n] = (1.0 - v) * lower + v * upper
        else:
            out[n] = grid[math.floor(v + 0.5), math.floor(u + 0.5)]
