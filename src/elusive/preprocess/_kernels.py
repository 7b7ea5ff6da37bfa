"""Compiled kernels of the preprocessing: bilinear sampling, and quantiles over a ring of registered frames."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elusive.contracts import Array


@njit(cache=True, nogil=True)
def sample_at(frame: NDArray, x: float, y: float) -> float:  # type: ignore[type-arg]
    """Bilinear value of the frame at (x, y), NaN outside the pixel centres."""
    rows, columns = frame.shape
    if not (x >= 0.0 and y >= 0.0 and x <= columns - 1.0 and y <= rows - 1.0):
        return np.nan
    column, row = min(int(x), columns - 2), min(int(y), rows - 2)
    u, v = x - column, y - row
    upper = (1.0 - u) * frame[row, column] + u * frame[row, column + 1]
    lower = (1.0 - u) * frame[row + 1, column] + u * frame[row + 1, column + 1]
    value: float = (1.0 - v) * upper + v * lower
    return value


@njit(cache=True, nogil=True)
def sample_shifted(frame: NDArray, dx: float, dy: float) -> Array:  # type: ignore[type-arg]
    """Frame read at ``(x + dx, y + dy)`` for every pixel, NaN where that lies outside."""
    rows, columns = frame.shape
    out = np.empty((rows, columns))
    for row in range(rows):
        for column in range(columns):
            out[row, column] = sample_at(frame, column + dx, row + dy)
    return out


@njit(cache=True, nogil=True)
def ring_quantiles(ring: NDArray, shifts: Array, low: float, level: float) -> tuple[Array, Array, NDArray]:  # type: ignore[type-arg]
    """Two quantiles over the frames of a ring, each read at ``(x, y) + shifts[j]``, and how many see the pixel.

    Quantiles interpolate linearly between order statistics; frames that do not see the pixel are left out.
    """
    frames, rows, columns = ring.shape
    lower = np.full((rows, columns), np.nan)
    middle = np.full((rows, columns), np.nan)
    seen = np.zeros((rows, columns), dtype=np.int64)
    values = np.empty(frames)
    for row in range(rows):
        for column in range(columns):
            n = 0
            for j in range(frames):
                value = sample_at(ring[j], column + shifts[j, 0], row + shifts[j, 1])
                if np.isnan(value):
                    continue
                k = n
                while k > 0 and values[k - 1] > value:
                    values[k] = values[k - 1]
                    k -= 1
                values[k] = value
                n += 1
            seen[row, column] = n
            if n > 0:
                lower[row, column] = _ordered(values, n, low)
                middle[row, column] = _ordered(values, n, level)
    return lower, middle, seen


@njit(cache=True, nogil=True)
def _ordered(values: Array, n: int, level: float) -> float:
    place = (n - 1) * level
    k = int(place)
    above = min(k + 1, n - 1)
    value: float = values[k] + (place - k) * (values[above] - values[k])
    return value
