"""Compiled kernels of the image sensor in Gaussian noise: log likelihood ratios over a patch, and the template map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elusive._kernels import BLOCK, add_product, exponentiate
from elusive.contracts import INTENSITY, Array, X, Y

OUTSIDE = -100  # row or column of a state whose patch misses the frame: far enough for any patch
STEEPEST = 600.0  # exponent up to which the recursion along a patch stays within the range of numbers


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _nearest(
    place: Array, step: float, half: float, cells: int, p: int, index: NDArray[np.int64], slope: Array, top: Array
) -> None:
    """Nearest cell along one axis, and the exponents of r and, added, of g(d) in :func:`log_ratio_gaussian`."""
    for i in range(len(place)):
        centre = np.floor(place[i] / step + 0.5)
        meets = (centre >= -p) & (centre < cells + p)
        off = centre * step - place[i] if meets else 0.0
        index[i] = int(centre if meets else float(OUTSIDE))
        slope[i] = -2.0 * half * off * step
        top[i] -= half * off * off


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _bells(slope: Array, steps: Array, bell: Array, square: Array, window: Any) -> None:
    """Gaussian over its top at each cell of a patch along one axis, ``(2 p + 1, N)``, and the sum of its squares."""
    p = len(window) // 2
    for i in range(len(slope)):
        up, down = slope[i], 1.0 / slope[i]
        rise = fall = total = bell[p, i] = 1.0
        for k in range(1, p + 1):
            rise *= up * steps[k]
            fall *= down * steps[k]
            bell[p + k, i], bell[p - k, i] = rise, fall
            total += rise * rise + fall * fall
        square[i] = total


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def log_ratio_gaussian(
    states: Array,
    frame: Array,
    pitch: tuple[float, float],
    psf: float,
    gain: float,
    sigma: float,
    steps: Array,
    window: Any,
) -> Array:
    """Eqs. 18-19 for each state. The Gaussian separates: g(d + k) = g(d + k - 1) r c_k, three exponentials a state.

    ``pitch`` is dx and dy; ``steps`` the c_k along x and y, ``exp(-(2 k - 1) pitch^2 / 2 S^2)``, ``(2, p + 1)``.
    ``window`` is a tuple whose length, the patch's width, the compiler knows: the loops over the patch unroll.
    """
    rows, columns = frame.shape
    n = len(states)
    width = len(window)
    p = width // 2
    half = 0.5 / (psf * psf)
    steep = half * max(pitch) ** 2 > STEEPEST
    cells = frame.reshape(-1)
    along_x, along_y, intensity = states.T[X], states.T[Y], states.T[INTENSITY]
    ratio = np.empty(n)
    column, row = np.empty(BLOCK, dtype=np.int64), np.empty(BLOCK, dtype=np.int64)
    exponents = np.empty((3, BLOCK))
    g_x, g_y = np.empty((width, BLOCK)), np.empty((width, BLOCK))
    square_x, square_y = np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, n, BLOCK):
        x, y = along_x[first : first + BLOCK], along_y[first : first + BLOCK]
        size = len(x)
        exponents[:] = 0.0
        _nearest(x, pitch[0], half, columns, p, column, exponents[0], exponents[2])
        _nearest(y, pitch[1], half, rows, p, row, exponents[1], exponents[2])
        if steep:
            exponents[:] = 0.0
        exponentiate(exponents.reshape(-1))
        _bells(exponents[0, :size], steps[0], g_x, square_x, window)
        _bells(exponents[1, :size], steps[1], g_y, square_y, window)
        for i in range(size):
            r, c = row[i], column[i]
            cross = 0.0
            if p <= c < columns - p and p <= r < rows - p:
                # unsigned indices spare the compiled code a test for negative ones
                corner = np.uintp((r - p) * columns + c - p)
                for k in range(width):
                    line = 0.0
                    for m in range(width):
                        line += g_x[m, i] * cells[corner + np.uintp(m)]
                    corner += np.uintp(columns)
                    cross += g_y[k, i] * line
            else:
                square_x[i] = square_y[i] = 0.0
                begin, end = max(0, p - c), min(width, columns - c + p)
                for m in range(begin, end):
                    square_x[i] += g_x[m, i] * g_x[m, i]
                for k in range(max(0, p - r), min(width, rows - r + p)):
                    line = 0.0
                    for m in range(begin, end):
                        line += g_x[m, i] * frame[r - p + k, c - p + m]
                    cross += g_y[k, i] * line
                    square_y[i] += g_y[k, i] * g_y[k, i]
            amplitude = gain * intensity[first + i]
            # np.isfinite is x - x == x - x, which the compiler may fold under these flags
            if abs(cross) < np.inf and not steep:
                amplitude *= exponents[2, i]
                total = amplitude * (cross - 0.5 * amplitude * square_x[i] * square_y[i])
            else:
                total = _cell_by_cell(frame, r, c, x[i], y[i], amplitude, pitch, half, p)
            ratio[first + i] = total / (sigma * sigma)
    return ratio


@njit(cache=True, nogil=True)
def _cell_by_cell(
    frame: Array, r: int, c: int, x: float, y: float, amplitude: float, pitch: tuple[float, float], half: float, p: int
) -> float:
    """One state's ratio times the noise variance, beside a masked cell or under a very sharp spread."""
    total = 0.0
    for row in range(max(0, r - p), min(frame.shape[0], r + p + 1)):
        for column in range(max(0, c - p), min(frame.shape[1], c + p + 1)):
            z = frame[row, column]
            if np.isfinite(z):
                off_x, off_y = column * pitch[0] - x, row * pitch[1] - y
                h = amplitude * np.exp(-half * (off_x * off_x + off_y * off_y))
                total += h * (z - 0.5 * h)
    return total


@njit(cache=True, nogil=True, fastmath={"contract"})
def template_map_gaussian(frame: Array, taps_x: Array, taps_y: Array, amplitude: float, sigma: float) -> Array:
    """Log likelihood ratio of a target of that peak amplitude centred on each cell, by two 1-D passes."""
    rows, columns = frame.shape
    p = len(taps_x) // 2
    first = amplitude / (sigma * sigma)
    second = -0.5 * amplitude * amplitude / (sigma * sigma)
    ratio = np.zeros((rows, columns))
    height, seen = np.empty(columns), np.empty(columns)
    cross, square = np.empty(columns), np.empty(columns)
    for r in range(rows):
        for c in range(columns):
            finite = abs(frame[r, c]) < np.inf
            height[c] = frame[r, c] if finite else 0.0
            seen[c] = 1.0 if finite else 0.0
        cross[:] = 0.0
        square[:] = 0.0
        for m in range(-min(p, columns - 1), min(p, columns - 1) + 1):
            tap = taps_x[m + p]
            reach = columns - abs(m)
            begin, source = max(0, -m), max(0, m)
            add_product(cross[begin : begin + reach], first * tap, height[source : source + reach])
            add_product(square[begin : begin + reach], second * tap * tap, seen[source : source + reach])
        for k in range(max(-p, r - rows + 1), min(p, r) + 1):
            add_product(ratio[r - k], taps_y[k + p], cross)
            add_product(ratio[r - k], taps_y[k + p] * taps_y[k + p], square)
    return ratio


@njit(cache=True, nogil=True, error_model="numpy")
def in_view(states: Array, dx: float, dy: float, columns: int, rows: int, p: int) -> Array:
    """0 for a state whose patch meets the frame, minus infinity for the others."""
    along_x, along_y = states.T[X], states.T[Y]
    view = np.empty(len(states))
    for i in range(len(view)):
        x, y = along_x[i] / dx, along_y[i] / dy
        inside = (x >= -p) & (x <= columns - 1 + p) & (y >= -p) & (y <= rows - 1 + p)
        view[i] = 0.0 if inside else -np.inf
    return view
