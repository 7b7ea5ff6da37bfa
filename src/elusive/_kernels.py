"""Compiled kernels that several rooms share: one step of a linear motion, and arithmetic on whole rows.

Along the particles, a block at a time, so that the loops run in vector registers and what is between stays in the
first cache. Division by zero gives infinity (``error_model``): a test for it would keep a loop from vector registers.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.random import Generator

from elusive.contracts import Array

BLOCK = 256  # particles at a time

LOG2_E = 1.4426950408889634
LN2_HIGH, LN2_LOW = 6.93145751953125e-1, 1.42860682030941723212e-6
LEAST_EXPONENT = -700.0


@njit(cache=True, nogil=True, fastmath={"contract"})
def add_product(row: Array, factor: float, other: Array) -> None:
    """Add a multiple of another row to a row in place; where the factor is zero, nothing, not even NaN."""
    if factor != 0.0:
        for i in range(len(row)):
            row[i] += factor * other[i]


@njit(cache=True, nogil=True)
def copy_row(row: Array, source: Array) -> None:
    """Set a row to another of its length.

    A slice that is assigned would have what words a mismatch of shapes compiled into each kernel that calls this one.
    """
    for i in range(len(source)):
        row[i] = source[i]


@njit(cache=True, nogil=True)
def copy_rows(rows: Array, source: Array) -> None:
    """Set the first rows to those of a matrix, see :func:`copy_row`."""
    for i in range(len(source)):
        for j in range(source.shape[1]):
            rows[i, j] = source[i, j]


@njit(cache=True, nogil=True)
def add_rows(rows: Array, other: Array) -> None:
    """Add a matrix to another in place, see :func:`copy_row`."""
    for i in range(len(other)):
        for j in range(other.shape[1]):
            rows[i, j] += other[i, j]


@njit(cache=True, nogil=True)
def propagate_linear(states: Array, F: Array, root: Array, rng: Generator) -> Array:
    """Return ``F s + root n`` for each row s, n standard normal drawn row by row; column by column in memory."""
    n, d = states.shape
    columns = states.T
    moved = np.zeros((d, n))
    noise = np.empty((d, BLOCK))
    for first in range(0, n, BLOCK):
        size = min(BLOCK, n - first)
        for i in range(size):
            for k in range(d):
                noise[k, i] = rng.standard_normal()
        for r in range(d):
            row = moved[r, first : first + size]
            for c in range(d):
                add_product(row, F[r, c], columns[c, first : first + size])
                add_product(row, root[r, c], noise[c])
    return moved.T


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def exponentiate(row: Array) -> None:
    """Replace each of a row's values, none above 700, by its exponential; below -700 by zero.

    Cephes' rational approximation (Moshier, 1989), right to one unit in the last place or two. NumPy's exponential in
    a compiled loop is a call for each value, five times slower.
    """
    powers = np.empty(BLOCK)
    exponents = powers.view(np.int64)
    for first in range(0, len(row), BLOCK):
        part = row[first : first + BLOCK]
        for i in range(len(part)):
            x = max(part[i], LEAST_EXPONENT)
            whole = np.floor(LOG2_E * x + 0.5)
            r = (x - whole * LN2_HIGH) - whole * LN2_LOW
            r2 = r * r
            odd = r * ((1.26177193074810590878e-4 * r2 + 3.02994407707441961300e-2) * r2 + 1.0)
            even = ((3.00198505138664455042e-6 * r2 + 2.52448340349684104192e-3) * r2 + 2.27265548208155028766e-1) * r2
            exponents[i] = (np.int64(whole) + 1023) << 52
            part[i] = 0.0 if part[i] < LEAST_EXPONENT else 1.0 + 2.0 * odd / (even + 2.0 - odd)
        for i in range(len(part)):
            part[i] *= powers[i]
