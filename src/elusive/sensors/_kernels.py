"""Compiled kernels of the image sensor in Gaussian noise: log likelihood ratios over a patch, and the template map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive._kernels import BLOCK, add_product, copy_row, exponentiate
from elusive._njit import njit
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
def log_ratio_gaussian(states: Array, frame: Array, optics: Any) -> Array:
    """Eqs. 18-19 for each state. The Gaussian separates: g(d + k) = g(d + k - 1) r c_k, three exponentials a state.

    Steps of ``optics`` (:class:`~elusive.sensors.image.GaussianOptics`) are c_k = ``exp(-(2 k - 1) pitch^2 / 2 S^2)``.
    """
    pitch, psf, gain, sigma, steps, _, _, window = optics
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
    square_x, square_y, cross = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    precision = 1.0 / (sigma * sigma)
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
            total = 0.0
            if p <= c < columns - p and p <= r < rows - p:
                # unsigned indices spare the compiled code a test for negative ones
                corner = np.uintp((r - p) * columns + c - p)
                for k in range(width):
                    line = 0.0
                    for m in range(width):
                        line += g_x[m, i] * cells[corner + np.uintp(m)]
                    corner += np.uintp(columns)
                    total += g_y[k, i] * line
            else:
                square_x[i] = square_y[i] = 0.0
                begin, end = max(0, p - c), min(width, columns - c + p)
                for m in range(begin, end):
                    square_x[i] += g_x[m, i] * g_x[m, i]
                for k in range(max(0, p - r), min(width, rows - r + p)):
                    line = 0.0
                    for m in range(begin, end):
                        line += g_x[m, i] * frame[r - p + k, c - p + m]
                    total += g_y[k, i] * line
                    square_y[i] += g_y[k, i] * g_y[k, i]
            cross[i] = total
        masked = steep
        for i in range(size):
            amplitude = gain * intensity[first + i] * exponents[2, i]
            ratio[first + i] = amplitude * precision * (cross[i] - 0.5 * amplitude * square_x[i] * square_y[i])
            # np.isfinite is x - x == x - x, which the compiler may fold under these flags
            masked |= not abs(cross[i]) < np.inf
        if masked:
            for i in range(size):
                if steep or not abs(cross[i]) < np.inf:
                    peak = gain * intensity[first + i]
                    total = _cell_by_cell(frame, row[i], column[i], x[i], y[i], peak, pitch, half, p)
                    ratio[first + i] = precision * total
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


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def _blurred(values: Array, taps_x: Array, taps_y: Array, window: Any) -> Array:
    """Sum of the values about each cell, times the taps; beyond the border there are none."""
    (rows, columns), width = values.shape, len(window)
    p = width // 2
    row, across = np.zeros(columns + 2 * p), np.zeros((rows + 2 * p, columns))
    for r in range(rows):
        copy_row(row[p : p + columns], values[r])
        line = across[p + r]
        for c in range(columns):
            total = 0.0
            for m in range(width):
                total += taps_x[m] * row[c + np.uintp(m)]
            line[c] = total
    blurred = np.zeros((rows, columns))
    for r in range(rows):
        for k in range(width):
            add_product(blurred[r], taps_y[k], across[r + k])
    return blurred


@njit(cache=True, nogil=True, fastmath={"contract"})
def template_map_gaussian(frame: Array, optics: Any, intensity: float) -> Array:
    """Log likelihood ratio of a target of that intensity centred on each cell, by two 1-D passes."""
    taps_x, taps_y, window, (rows, columns) = optics.taps_x, optics.taps_y, optics.window, frame.shape
    amplitude, precision = optics.gain * intensity, 1.0 / (optics.sigma * optics.sigma)
    first, second = amplitude * precision, -0.5 * amplitude * amplitude * precision
    if np.isfinite(frame.sum()):
        # where all cells are seen, the squares separate; of a single row, the middle tap, one, is all that counts
        along_x = _blurred(np.ones((1, columns)), taps_x * taps_x, taps_y, window)[0]
        along_y = _blurred(np.ones((1, rows)), taps_y * taps_y, taps_x, window)[0]
        ratio = _blurred(frame, first * taps_x, taps_y, window)
        for r in range(rows):
            add_product(ratio[r], second * along_y[r], along_x)
        return ratio
    seen = np.isfinite(frame)
    ratio = _blurred(np.where(seen, frame, 0.0), first * taps_x, taps_y, window)
    return ratio + _blurred(np.where(seen, 1.0, 0.0), second * taps_x * taps_x, taps_y * taps_y, window)


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


@njit(cache=True, nogil=True, error_model="numpy")
def leave_out(along_x: Array, along_y: Array, shape: tuple[int, int], optics: Any, log_mass: Array) -> int:
    """Set the log mass of states out of view to minus infinity; how many they are."""
    p = len(optics.window) // 2
    reach_x, reach_y = (shape[1] - 1 + p) * optics.pitch[0], (shape[0] - 1 + p) * optics.pitch[1]
    low_x, low_y = -p * optics.pitch[0], -p * optics.pitch[1]
    out = 0
    for i in range(len(along_x)):
        inside = (along_x[i] >= low_x) & (along_x[i] <= reach_x) & (along_y[i] >= low_y) & (along_y[i] <= reach_y)
        log_mass[i] = log_mass[i] if inside else -np.inf
        out += 0 if inside else 1
    return out
