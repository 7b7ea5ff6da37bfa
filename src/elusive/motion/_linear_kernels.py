"""Compiled kernel of one step of a linear motion.

Along the particles, a block at a time, so that the loops run in vector registers and what is between stays in the
first cache.
"""

from __future__ import annotations

import numpy as np

from elusive._kernels import BLOCK, add_product
from elusive._njit import njit
from elusive._random_kernels import fill_normal
from elusive.contracts import Array


@njit(cache=True, nogil=True)
def propagate_linear(states: Array, F: Array, root: Array, draw: float) -> Array:
    """Return ``F s + root n`` for each row s, n standard normal from the key ``draw``; column by column in memory."""
    n, d = states.shape
    columns = states.T
    moved = np.zeros((d, n))
    noise = np.empty(d * n)
    fill_normal(draw, noise)
    for first in range(0, n, BLOCK):
        size = min(BLOCK, n - first)
        for r in range(d):
            row = moved[r, first : first + size]
            for c in range(d):
                add_product(row, F[r, c], columns[c, first : first + size])
                add_product(row, root[r, c], noise[c * n + first : c * n + first + size])
    return moved.T
