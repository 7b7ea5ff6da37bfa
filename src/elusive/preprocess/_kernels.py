"""Compiled kernels of the preprocessing: bilinear sampling, and quantiles over a ring of registered frames.

A shift is the same for every pixel of a frame, so that a row is read with the same weights throughout, and the values
of many pixels are sorted side by side: by a network of comparisons that does not depend on them (Knuth (1998), section
5.2.2, algorithm M: Batcher's merge exchange).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._kernels import FIRST
from elusive._njit import njit
from elusive.contracts import Array

BLOCK = 256  # pixels at a time
NO_SHIFT = 1e-12  # fraction of a pixel that is rounding


@njit(cache=True, nogil=True)
def _split(shift: float) -> tuple[int, float]:
    """Whole and fraction of a shift."""
    whole = np.floor(shift + NO_SHIFT)
    fraction = shift - whole
    return int(whole), fraction if fraction > NO_SHIFT else 0.0


@njit(cache=True, nogil=True)
def _visible(whole: int, fraction: float, size: int) -> tuple[int, int]:
    """First pixel along an axis that a shift keeps within the pixel centres, and the one after the last."""
    return max(0, -whole), max(0, min(size, size - whole - (1 if fraction > 0.0 else 0)))


@njit(cache=True, nogil=True, fastmath={"contract"})
def _sample_row(
    frame: NDArray[np.floating], row: int, x: tuple[int, float], y: tuple[int, float], begin: int, out: Array
) -> None:
    """Read a frame at ``(column + x, row + y)`` for the columns from ``begin``; NaN outside the pixel centres."""
    rows, columns = frame.shape
    out[:] = np.nan
    first, last = _visible(x[0], x[1], columns)
    top, bottom = _visible(y[0], y[1], rows)
    first, last = max(first, begin), min(last, begin + len(out))
    if not (top <= row < bottom and first < last):
        return
    u, v = x[1], y[1]
    here, size = first + x[0], last - first
    right = here + (1 if u > 0.0 else 0)
    upper = frame[row + y[0]]
    lower = frame[row + y[0] + (1 if v > 0.0 else 0)]
    upper_left, upper_right = upper[here : here + size], upper[right : right + size]
    lower_left, lower_right = lower[here : here + size], lower[right : right + size]
    seen = out[first - begin : last - begin]
    for i in range(size):
        above = (1.0 - u) * upper_left[i] + u * upper_right[i]
        below = (1.0 - u) * lower_left[i] + u * lower_right[i]
        seen[i] = (1.0 - v) * above + v * below


@njit(cache=True, nogil=True)
def sample_shifted(frame: NDArray[np.floating], dx: float, dy: float) -> Array:
    """Frame read at ``(x + dx, y + dy)`` for every pixel, NaN where that lies outside."""
    out = np.empty(frame.shape)
    x, y = _split(dx), _split(dy)
    for row in range(len(frame)):
        _sample_row(frame, row, x, y, FIRST, out[row])
    return out


@njit(cache=True, nogil=True)
def ring_quantiles(
    ring: NDArray[np.floating], shifts: Array, low: float, level: float
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Two quantiles over the frames of a ring, each read at ``(x, y) + shifts[j]``, and how many see the pixel.

    Quantiles interpolate linearly between order statistics; frames that do not see the pixel are left out.
    """
    frames, rows, columns = ring.shape
    lower, middle = np.empty((rows, columns)), np.empty((rows, columns))
    seen = np.empty((rows, columns), dtype=np.int64)
    # of whole rows: a part of each would not be contiguous, and its sorting not run in vector registers
    values = np.empty((frames, min(BLOCK, columns)))
    for row in range(rows):
        for begin in range(0, columns, BLOCK):
            count = seen[row, begin : begin + BLOCK]
            count[:] = 0
            for j in range(frames):
                sampled = values[j, : len(count)]
                _sample_row(ring[j], row, _split(shifts[j, 0]), _split(shifts[j, 1]), begin, sampled)
                for i in range(len(count)):
                    finite = sampled[i] == sampled[i]
                    count[i] += 1 if finite else 0
                    sampled[i] = sampled[i] if finite else np.inf
            _sort_side_by_side(values)
            for i in range(len(count)):
                lower[row, begin + i] = _ordered(values, i, count[i], low)
                middle[row, begin + i] = _ordered(values, i, count[i], level)
    return lower, middle, seen


@njit(cache=True, nogil=True)
def _sort_side_by_side(values: Array) -> None:
    """Sort each column of a table in place, all by the same exchanges of rows."""
    n = len(values)
    top = 1
    while 2 * top < n:
        top *= 2
    p = top
    while p > 0:
        q, r, d = top, 0, p
        while d > 0:
            for k in range(n - d):
                if k & p == r:
                    _exchange(values[k], values[k + d])
            d = q - p
            q //= 2
            r = p
        p //= 2


@njit(cache=True, nogil=True)
def _exchange(small: Array, large: Array) -> None:
    for i in range(len(small)):
        a, b = small[i], large[i]
        small[i], large[i] = min(a, b), max(a, b)


@njit(cache=True, nogil=True)
def _ordered(values: Array, column: int, n: int, level: float) -> float:
    if n == 0:
        return np.nan
    place = (n - 1) * level
    k = int(place)
    value: float = values[k, column] + (place - k) * (values[min(k + 1, n - 1), column] - values[k, column])
    return value
