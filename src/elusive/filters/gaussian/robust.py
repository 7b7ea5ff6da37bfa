"""Robust losses as densities: what divides exp(-loss) of a reading of any number of components.

Barron (2019), CVPR, A general and adaptive robust loss function, section 3, for one component.
"""

from __future__ import annotations

import math

from scipy.special import gammaincc, gammaln

from elusive.filters.gaussian._map_kernels import Loss

LOSSES = {"squares": 0, "cauchy": 1, "huber": 2}


def log_norm(loss: Loss, components: int) -> float:
    """Logarithm of the integral of exp(-loss) over whitened residuals of a reading; infinite where there is none."""
    m, k2 = components, loss.k**2
    if loss.kind == LOSSES["cauchy"]:
        if k2 <= m:
            return math.inf
        return 0.5 * m * math.log(math.pi * k2) + float(gammaln((k2 - m) / 2) - gammaln(k2 / 2))
    gauss = 0.5 * m * math.log(2 * math.pi)
    if loss.kind == LOSSES["squares"]:
        return gauss
    # the area of the unit sphere, and what lies beyond the bend
    log_area = math.log(2) + 0.5 * m * math.log(math.pi) - float(gammaln(m / 2))
    beyond = log_area + k2 / 2 + float(gammaln(m)) + math.log(gammaincc(m, k2)) - m * math.log(loss.k)
    return math.log(math.exp(gauss) * float(1 - gammaincc(m / 2, k2 / 2)) + math.exp(beyond))
