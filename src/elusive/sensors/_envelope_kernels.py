"""Compiled kernels of the image sensor for envelopes: Rice over Rayleigh in each cell of a patch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
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
    corner: NDArray[np.int64],
    bells: Array,
    first: tuple[int, int],
    left: Array,
    precision: Array,
    swerling: int,
) -> Array:
    """Rice against Rayleigh in each cell; Swerling 1 averaged over the amplitude common to a target's cells.

    The cells of targets are those of :func:`elusive.sensors._patch_kernels.lay`; ``left`` holds the envelope in the
    rectangle that begins at ``first``, ``precision`` one over the variance of a quadrature, 0 where masked.
    With the amplitude ``a = t^2`` the average over its density ``2 a exp(-a^2)`` is an integral of
    ``4 t^3 exp(-t^4)``, done by midpoints close enough for the likelihood's width: .001 in log ratio up to 20 dB.
    """
    n, width = len(corner), bells.shape[2]
    ratio = np.empty(n)
    drawn = np.empty(width * width)
    for i in range(n):
        row, column = corner[i, 0] - first[0], corner[i, 1] - first[1]
        cells = 0
        energy = 0.0
        for k in range(width):
            for m in range(width):
                weight = precision[row + k, column + m]
                if weight > 0.0:
                    h = abs(bells[i, 0, k]) * bells[i, 1, m]
                    drawn[cells] = h * left[row + k, column + m] * weight
                    energy += h * h * weight
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
