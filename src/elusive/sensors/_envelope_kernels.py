"""Compiled kernels of the image sensor for envelopes: Rice over Rayleigh in each cell of a patch."""

from __future__ import annotations

import numpy as np
from numba import njit

from elusive.contracts import Array

MOST_ROOT_AMPLITUDE = 3.0  # nine times the mean amplitude: a chance of exp(-81)


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
