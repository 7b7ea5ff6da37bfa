"""Compiled kernels that fill arrays with random numbers, four times as fast as a generator asked for one at a time.

A counter mixed by SplitMix64 (Steele, Lea and Flood, 2014, OOPSLA, figure 16) from a key that the generator gives;
normals by Box and Muller (1958), whose logarithm and circle are series right to 1e-12. No branch hangs on a number.
"""

from __future__ import annotations

import math

import numpy as np

from elusive._kernels import BLOCK
from elusive._njit import njit
from elusive.contracts import Array

KEYS = 2.0**53  # keys that a uniform number can give
GOLDEN, MIX_1, MIX_2 = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
ONE, TWO_TO_52 = np.uint64(0x3FF0000000000000), np.uint64(0x4330000000000000)  # bits of 1.0 and 2^52
MANTISSA, UPPER, LOWER = np.uint64(0x000FFFFFFFFFFFFF), np.uint64(0xFFFFFFFF00000000), np.uint64(0x00000000FFFFFFFF)
BY_12, BY_20, BY_27, BY_30, BY_31, BY_52 = (np.uint64(bits) for bits in (12, 20, 27, 30, 31, 52))
HALF_STEP = 2.0**-33  # keeps a uniform number of 32 bits above 0
ROOT_2, LN_2 = math.sqrt(2.0), math.log(2.0)


@njit(cache=True, nogil=True)
def _mix(key: np.uint64, first: int, bits: np.ndarray) -> None:
    for i in range(len(bits)):
        z = key + np.uint64(first + i + 1) * GOLDEN
        z = (z ^ (z >> BY_30)) * MIX_1
        z = (z ^ (z >> BY_27)) * MIX_2
        bits[i] = z ^ (z >> BY_31)


@njit(cache=True, nogil=True)
def fill_uniform(draw: float, out: Array) -> None:
    """Fill a row with numbers uniform in [0, 1) from the key that a uniform number ``draw`` gives."""
    bits = out.view(np.uint64)
    _mix(np.uint64(draw * KEYS), 0, bits)
    for i in range(len(out)):
        bits[i] = (bits[i] >> BY_12) | ONE
    for i in range(len(out)):
        out[i] -= 1.0


@njit(cache=True, nogil=True)
def _halves(radius: Array, turn: Array) -> None:
    """Turn bits, 64 a number, into two uniform numbers in [1, 2)."""
    bits, other = radius.view(np.uint64), turn.view(np.uint64)
    for i in range(len(bits)):
        other[i] = ((bits[i] & LOWER) << BY_20) | ONE
        bits[i] = ((bits[i] & UPPER) >> BY_12) | ONE


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _radii(u: Array, mantissa: Array) -> None:
    """Turn uniform numbers in [1, 2) in place into ``sqrt(-2 log(2 - u))``."""
    bits, split = u.view(np.uint64), mantissa.view(np.uint64)
    for i in range(len(u)):
        u[i] = (2.0 - u[i]) - HALF_STEP
    for i in range(len(u)):
        split[i] = (bits[i] & MANTISSA) | ONE
        bits[i] = (bits[i] >> BY_52) | TWO_TO_52
    for i in range(len(u)):
        exponent = (u[i] - 4503599627370496.0) - 1022.5
        s = (mantissa[i] - ROOT_2) / (mantissa[i] + ROOT_2)
        t = s * s
        tail = 1 / 9 + t * (1 / 11 + t * (1 / 13 + t * (1 / 15 + t * (1 / 17))))
        log = 2.0 * s * (1.0 + t * (1 / 3 + t * (1 / 5 + t * (1 / 7 + t * tail))))
        u[i] = -2.0 * (exponent * LN_2 + log)
    for i in range(len(u)):
        u[i] = np.sqrt(u[i])


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _circle(radius: Array, turn: Array, along: Array, across: Array) -> None:
    """Write the points of a circle at turns in [1, 2), by the sine and cosine of half their angles."""
    for i in range(len(turn)):
        h = np.pi * (turn[i] - 1.5)
        t = h * h
        tail = 1 / 362880 + t * (-1 / 39916800 + t * (1 / 6227020800 + t * (-1 / 1307674368000 + t / 355687428096000)))
        sine = h * (1.0 + t * (-1 / 6 + t * (1 / 120 + t * (-1 / 5040 + t * tail))))
        tail = 1 / 40320 + t * (-1 / 3628800 + t * (1 / 479001600 + t * (-1 / 87178291200 + t / 20922789888000)))
        cosine = 1.0 + t * (-1 / 2 + t * (1 / 24 + t * (-1 / 720 + t * tail)))
        along[i] = radius[i] * (cosine * cosine - sine * sine)
        across[i] = radius[i] * (2.0 * sine * cosine)


@njit(cache=True, nogil=True)
def fill_normal(draw: float, out: Array) -> None:
    """Fill a row with standard normal numbers from the key that a uniform number ``draw`` gives."""
    key, pairs = np.uint64(draw * KEYS), (len(out) + 1) // 2
    radius, turn, spare, last = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK), np.empty(1)
    for first in range(0, pairs, BLOCK):
        size = min(BLOCK, pairs - first)
        r, t = radius[:size], turn[:size]
        _mix(key, first, r.view(np.uint64))
        _halves(r, t)
        _radii(r, spare[:size])
        whole = min(size, len(out) - pairs - first)
        _circle(r[:whole], t[:whole], out[first : first + whole], out[pairs + first : pairs + first + whole])
        if whole < size:
            _circle(r[whole:], t[whole:], out[first + whole : first + size], last)
