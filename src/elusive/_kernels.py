"""Compiled kernels that several rooms share: arithmetic on whole rows.

Along the particles, a block at a time, so that the loops run in vector registers and what is between stays in the
first cache. Division by zero gives infinity (``error_model``): a test for it would keep a loop from vector registers.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from elusive._njit import njit
from elusive.contracts import Array

BLOCK = 256  # particles at a time
FIRST: Any = np.int64(0)  # for a kernel to take; a plain integer would be a type of its own, and compiled for itself

LOG2_E = 1.4426950408889634
LN2_HIGH, LN2_LOW = 6.93145751953125e-1, 1.42860682030941723212e-6
LEAST_EXPONENT = -700.0
MANTISSA, HALF, ROOT_HALF = (1 << 52) - 1, 1022 << 52, 0.70710678118654752440


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


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def take_logarithms(row: Array) -> None:
    """Replace each of a row's values by its natural logarithm; all are positive, normal and finite.

    Cephes' rational approximation (Moshier, 1989), right to one unit in the last place or two, see
    :func:`exponentiate`.
    """
    mantissas = np.empty(BLOCK)
    bits = mantissas.view(np.int64)
    for first in range(0, len(row), BLOCK):
        part = row[first : first + BLOCK]
        for i in range(len(part)):
            mantissas[i] = part[i]
        for i in range(len(part)):
            part[i] = (bits[i] >> 52) - 1022
            bits[i] = (bits[i] & MANTISSA) | HALF
        for i in range(len(part)):
            small = mantissas[i] < ROOT_HALF
            whole = part[i] - (1.0 if small else 0.0)
            x = mantissas[i] + (mantissas[i] if small else 0.0) - 1.0
            above = ((1.01875663804580931796e-4 * x + 4.97494994976747001425e-1) * x + 4.70579119878881725854) * x
            above = ((above + 1.44989225341610930846e1) * x + 1.79368678507819816313e1) * x + 7.70838733755885391666
            below = ((x + 1.12873587189167450590e1) * x + 4.52279145837532221105e1) * x
            below = ((below + 8.29875266912776603211e1) * x + 7.11544750618563894466e1) * x + 2.31251620126765340583e1
            square = x * x
            rest = x * (square * above / below) - 2.121944400546905827679e-4 * whole - 0.5 * square
            part[i] = x + rest + 0.693359375 * whole
