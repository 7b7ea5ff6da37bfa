"""Compiled kernels that several rooms share: one step of a linear motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.random import Generator

from elusive.contracts import Array


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def propagate_linear(states: Array, F: Array, root: Array, components: Any, rng: Generator) -> Array:
    """Return ``F s + root n`` for each row s, n standard normal drawn row by row; ``root`` is lower triangular.

    ``components`` is a tuple whose length, d, the compiler knows: the loops over it unroll.
    """
    n, d = len(states), len(components)
    moved = np.empty((n, d))
    noise = np.empty(d)
    for i in range(n):
        for k in range(d):
            noise[k] = rng.standard_normal()
        for r in range(d):
            total = 0.0
            for c in range(d):
                total += F[r, c] * states[i, c]
            for c in range(r + 1):
                total += root[r, c] * noise[c]
            moved[i, r] = total
    return moved
