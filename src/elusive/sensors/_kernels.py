"""Compiled kernels of the image sensor: log likelihood ratios over a patch, and the template map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from elusive.contracts import Array

MOST_ROOT_AMPLITUDE = 3.0  # nine times the mean amplitude: a chance of exp(-81)


@njit(cache=True, nogil=True)
def patch_exponents(states: Array, rows: int, columns: int, dx: float, dy: float, psf: float, p: int) -> Array:
    """Logarithms of the three factors :func:`log_ratio_gaussian` needs of each state, ``(3, N)``.

    They stand apart because NumPy's exponential of a whole array takes a quarter of the time of one in a loop.
    NaN where there is no use for them: the patch misses the frame, or the spread is too sharp for them to be finite.
    """
    n = len(states)
    exponents = np.full((3, n), np.nan)
    half = 0.5 / (psf * psf)
    for i in range(n):
        x, y = states[i, 0], states[i, 2]
        column, row = np.floor(x / dx + 0.5), np.floor(y / dy + 0.5)
        if -p <= column < columns + p and -p <= row < rows + p:
            off_x, off_y = column * dx - x, row * dy - y
            along_x, along_y = -2.0 * half * off_x * dx, -2.0 * half * off_y * dy
            if abs(along_x) < 600.0 and abs(along_y) < 600.0:
                exponents[0, i] = along_x
                exponents[1, i] = along_y
                exponents[2, i] = -half * (off_x * off_x + off_y * off_y)
    return exponents


# no "arcp": x / dx must round to the same cell as in patch_exponents
@njit(cache=True, nogil=True, fastmath={"contract", "reassoc", "nsz"})
def log_ratio_gaussian(
    states: Array,
    factors: Array,
    frame: Array,
    dx: float,
    dy: float,
    psf: float,
    gain: float,
    sigma: float,
    taps: Array,
    window: Any,
) -> Array:
    """Eqs. 18-19 for each state. The Gaussian separates: g(d + k) = g(d) r^k c_k, three exponentials a state.

    ``factors`` are the exponentials of :func:`patch_exponents`: r along x, r along y and g(d).
    ``window`` is a tuple whose length, the patch's width, the compiler knows: the loops over the patch unroll.
    """
    rows, columns = frame.shape
    n, d = states.shape
    width = len(window)
    p = width // 2
    ratio = np.empty(n)
    inverse = 1.0 / (sigma * sigma)
    half = 0.5 / (psf * psf)
    gx = np.empty(width)
    gy = np.empty(width)
    cells = frame.reshape(-1)
    for i in range(n):
        x, y = states[i, 0], states[i, 2]
        centre_x, centre_y = np.floor(x / dx + 0.5), np.floor(y / dy + 0.5)
        if not (-p <= centre_x < columns + p and -p <= centre_y < rows + p):
            ratio[i] = 0.0
            continue
        column, row = int(centre_x), int(centre_y)
        up_x, up_y = factors[0, i], factors[1, i]
        if up_x == up_x:
            down_x, down_y = 1.0 / up_x, 1.0 / up_y
            gx[p] = gy[p] = 1.0
            rise_x = fall_x = rise_y = fall_y = 1.0
            for k in range(1, p + 1):
                rise_x *= up_x
                fall_x *= down_x
                rise_y *= up_y
                fall_y *= down_y
                gx[p + k], gx[p - k] = rise_x * taps[0, k], fall_x * taps[0, k]
                gy[p + k], gy[p - k] = rise_y * taps[1, k], fall_y * taps[1, k]
            cross = square_x = square_y = 0.0
            if p <= column < columns - p and p <= row < rows - p:
                # unsigned indices spare the compiled code a test for negative ones
                corner = np.uintp((row - p) * columns + column - p)
                for k in range(width):
                    line = 0.0
                    for m in range(width):
                        line += gx[m] * cells[corner + np.uintp(m)]
                    corner += np.uintp(columns)
                    cross += gy[k] * line
                    square_x += gx[k] * gx[k]
                    square_y += gy[k] * gy[k]
            else:
                first, last = max(0, p - column), min(width, columns - column + p)
                for m in range(first, last):
                    square_x += gx[m] * gx[m]
                for k in range(max(0, p - row), min(width, rows - row + p)):
                    line = 0.0
                    for m in range(first, last):
                        line += gx[m] * frame[row - p + k, column - p + m]
                    cross += gy[k] * line
                    square_y += gy[k] * gy[k]
            # np.isfinite is x - x == x - x, which the compiler may fold under these flags
            if abs(cross) < np.inf:
                amplitude = gain * states[i, d - 1] * factors[2, i]
                ratio[i] = amplitude * inverse * (cross - 0.5 * amplitude * square_x * square_y)
                continue
        # beside a masked cell or under a very sharp spread: cell by cell
        for k in range(width):
            gx[k] = np.exp(-half * ((column - p + k) * dx - x) ** 2)
            gy[k] = gain * states[i, d - 1] * np.exp(-half * ((row - p + k) * dy - y) ** 2)
        total = 0.0
        for k in range(max(0, p - row), min(width, rows - row + p)):
            for m in range(max(0, p - column), min(width, columns - column + p)):
                z = frame[row - p + k, column - p + m]
                if abs(z) < np.inf:
                    h = gy[k] * gx[m]
                    total += h * (z - 0.5 * h)
        ratio[i] = total * inverse
    return ratio


@njit(cache=True, nogil=True)
def template_map_gaussian(frame: Array, taps_x: Array, taps_y: Array, amplitude: float, sigma: float) -> Array:
    """Log likelihood ratio of a target of that peak amplitude centred on each cell, by two 1-D passes."""
    rows, columns = frame.shape
    p = len(taps_x) // 2
    cross_x = np.zeros((rows, columns))
    square_x = np.zeros((rows, columns))
    for r in range(rows):
        for m in range(-p, p + 1):
            tap = taps_x[m + p]
            for c in range(max(0, -m), min(columns, columns - m)):
                z = frame[r, c + m]
                if np.isfinite(z):
                    cross_x[r, c] += tap * z
                    square_x[r, c] += tap * tap
    ratio = np.zeros((rows, columns))
    first = amplitude / (sigma * sigma)
    second = -0.5 * amplitude * amplitude / (sigma * sigma)
    for r in range(rows):
        for k in range(max(-p, -r), min(p, rows - 1 - r) + 1):
            one = first * taps_y[k + p]
            two = second * taps_y[k + p] * taps_y[k + p]
            for c in range(columns):
                ratio[r, c] += one * cross_x[r + k, c] + two * square_x[r + k, c]
    return ratio


@njit(cache=True, nogil=True)
def bessel_i0(x: float) -> tuple[float, float]:
    """Return a, b with ``exp(a) b`` = I0(x), x >= 0; Abramowitz and Stegun 9.8.1-2, relative error below 2e-7."""
    if x < 3.75:
        t = (x / 3.75) ** 2
        return 0.0, 1.0 + t * (
            3.5156229 + t * (3.0899424 + t * (1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813))))
        )
    t = 3.75 / x
    tail = 0.00916281 + t * (-0.02057706 + t * (0.02635537 + t * (-0.01647633 + t * 0.00392377)))
    value = 0.39894228 + t * (0.01328592 + t * (0.00225319 + t * (-0.00157565 + t * tail)))
    return x, value / np.sqrt(x)


@njit(cache=True, nogil=True)
def log_ratio_rayleigh(
    states: Array,
    frame: Array,
    dx: float,
    dy: float,
    psf: float,
    gain: float,
    sigma: float,
    p: int,
    swerling: int,
) -> Array:
    """Rice against Rayleigh in each cell; Swerling 1 averaged over the amplitude common to a target's cells.

    With the amplitude ``a = t^2`` the average over its density ``2 a exp(-a^2)`` is an integral of
    ``4 t^3 exp(-t^4)``, done by midpoints close enough for the likelihood's width: .001 in log ratio up to 20 dB.
    """
    rows, columns = frame.shape
    n, d = states.shape
    ratio = np.empty(n)
    half = 0.5 / (psf * psf)
    width = 2 * p + 1
    drawn = np.empty(width * width)
    for i in range(n):
        x, y = states[i, 0], states[i, 2]
        centre_x, centre_y = np.floor(x / dx + 0.5), np.floor(y / dy + 0.5)
        ratio[i] = 0.0
        if not (-p <= centre_x < columns + p and -p <= centre_y < rows + p):
            continue
        column, row = int(centre_x), int(centre_y)
        cells = 0
        energy = 0.0
        for r in range(max(0, row - p), min(rows - 1, row + p) + 1):
            for c in range(max(0, column - p), min(columns - 1, column + p) + 1):
                z = frame[r, c]
                if np.isfinite(z):
                    h = abs(gain * states[i, d - 1]) * np.exp(-half * ((c * dx - x) ** 2 + (r * dy - y) ** 2)) / sigma
                    drawn[cells] = h * z / sigma
                    energy += h * h
                    cells += 1
        if swerling == 0:
            ratio[i] = log_rice_over_rayleigh(drawn[:cells], energy, 1.0)
            continue
        nodes = 25 + int(5.0 * min(np.sqrt(energy), 100.0))
        step = MOST_ROOT_AMPLITUDE / nodes
        total, best = 0.0, -np.inf
        for m in range(nodes):
            t = (m + 0.5) * step
            given = log_rice_over_rayleigh(drawn[:cells], energy, t * t) + np.log(4.0 * step * t**3) - t**4
            if given > best:
                total *= np.exp(best - given)
                best = given
            total += np.exp(given - best)
        ratio[i] = best + np.log(total)
    return ratio


@njit(cache=True, nogil=True)
def log_rice_over_rayleigh(drawn: Array, energy: float, amplitude: float) -> float:
    """Log ratio over cells from their ``h z / sigma^2``, the sum of ``(h / sigma)^2`` and a factor on h."""
    total = -0.5 * amplitude * amplitude * energy
    product = 1.0
    for k in range(len(drawn)):
        exponent, factor = bessel_i0(amplitude * drawn[k])
        total += exponent
        product *= factor
        # one logarithm for many cells, before their product leaves the range of numbers
        if not 1e-250 < product < 1e250:
            total += np.log(product)
            product = 1.0
    return float(total + np.log(product))


@njit(cache=True, nogil=True)
def in_view(states: Array, dx: float, dy: float, columns: int, rows: int, p: int) -> Array:
    """0 for a state whose patch meets the frame, minus infinity for the others."""
    view = np.empty(len(states))
    for i in range(len(states)):
        x, y = states[i, 0] / dx, states[i, 2] / dy
        inside = -p <= x <= columns - 1 + p and -p <= y <= rows - 1 + p
        view[i] = 0.0 if inside else -np.inf
    return view
