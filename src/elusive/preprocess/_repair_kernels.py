"""Compiled kernel of repair: what lies about single pixels, and its median."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array
from elusive.preprocess._scale_kernels import Image

AROUND = np.array([(j, i) for j in (-1, 0, 1) for i in (-1, 0, 1) if j or i])


@njit(cache=True, nogil=True)
def surroundings(image: Image, pixels: NDArray[np.int64]) -> tuple[Array, Array]:
    """Values of each pixel's eight neighbours, ``(8, m)``, row by row and mirrored at the edge; their median, ``(m,)``.

    ``pixels`` are numbers in the frame.
    """
    rows, columns = image.shape
    near, middle, ranked = np.empty((8, len(pixels))), np.empty(len(pixels)), np.empty(8)
    for m in range(len(pixels)):
        row, column = pixels[m] // columns, pixels[m] % columns
        for k in range(8):
            j = rows - 1 - abs(rows - 1 - abs(row + AROUND[k, 0]))
            i = columns - 1 - abs(columns - 1 - abs(column + AROUND[k, 1]))
            value = near[k, m] = np.float64(image[j, i])
            to = k
            while to > 0 and ranked[to - 1] > value:
                ranked[to] = ranked[to - 1]
                to -= 1
            ranked[to] = value
        middle[m] = 0.5 * (ranked[3] + ranked[4])
    return near, middle
