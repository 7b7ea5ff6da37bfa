"""Compiled kernels of a clutter map: levels counted by block, and what they say against those counts."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elusive.contracts import Array


@njit(cache=True, nogil=True, error_model="numpy")
def count(
    level: NDArray[np.float32], middle: NDArray[np.float32], block: NDArray[np.int16], low: float, width: float,
    counts: Array,
) -> None:  # fmt: skip
    """Count cells by block, a negative one none, and by how far they are above their middle; NaN is left out."""
    bins = counts.shape[1]
    for i in range(level.shape[0]):
        for j in range(level.shape[1]):
            if block[i, j] >= 0 and level[i, j] == level[i, j]:
                number = int((level[i, j] - middle[i, j] - low) / width)
                counts[block[i, j], min(max(number, 0), bins - 1)] += 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def judge(
    level: NDArray[np.float32], middle: NDArray[np.float32], block: NDArray[np.int16], low: float, width: float,
    table: Array, found: NDArray[np.float32],
) -> None:  # fmt: skip
    """Read each cell's evidence from its block's table, linearly between the lower edges of bins; NaN stays."""
    bins = table.shape[1]
    for i in range(level.shape[0]):
        for j in range(level.shape[1]):
            place = (level[i, j] - middle[i, j] - low) / width
            if place != place:
                found[i, j] = np.nan
                continue
            number = min(int(max(place, 0.0)), bins - 2)
            part = min(max(place - number, 0.0), 1.0)
            row = table[block[i, j]]
            found[i, j] = (1 - part) * row[number] + part * row[number + 1]
