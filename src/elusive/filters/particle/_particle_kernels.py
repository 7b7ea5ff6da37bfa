"""Compiled kernels of the SIR particle filter: a measurement and a map on the weights; the density of a prediction."""

from __future__ import annotations

import numpy as np

from elusive._kernels import exponentiate
from elusive._njit import njit
from elusive.contracts import Array
from elusive.filters.particle._kernels import total_of, total_product


@njit(cache=True, nogil=True, error_model="numpy")
def effective_size(weights: Array) -> float:
    """Kish's effective sample size."""
    total = total_of(weights)
    return total * total / total_product(weights, weights)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc"})
def _sound(logarithms: Array) -> bool:
    """Tell whether none is NaN or plus infinity."""
    total = 0.0
    for i in range(len(logarithms)):
        total += logarithms[i]
    return total < np.inf


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"nnan", "nsz", "reassoc"})
def _greatest(values: Array, weights: Array) -> float:
    """Greatest value of one with weight; none is NaN."""
    best = -np.inf
    for i in range(len(values)):
        best = max(best, values[i] if weights[i] > 0.0 else -np.inf)
    return best


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"nnan", "nsz"})
def _below(values: Array, best: float) -> Array:
    """Values less the best of those with weight.

    One without weight may exceed it, beyond an exponential's range: it is set to the best.
    """
    out = np.empty(len(values))
    for i in range(len(values)):
        out[i] = min(values[i] - best, 0.0)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _multiply(row: Array, other: Array) -> None:
    for i in range(len(row)):
        row[i] *= other[i]


@njit(cache=True, nogil=True, error_model="numpy")
def reweigh(
    weights: Array, log_likelihood: Array, log_probability: Array, least: float
) -> tuple[Array, float, float, bool]:
    """Weights after a measurement under a map, log p(measurement | map), P(allowed) before it, and: map left out.

    ``weights`` sum to one. An empty row of logarithms stands for no measurement or no map. The map is left out where
    the probability that it allows the target, the measurement known, is ``least`` at most. Where no particle explains
    the measurement the weights stay, and the logarithm is minus infinity. It is NaN where a logarithm is NaN or plus
    infinity.
    """
    seen, allowed, total, best = weights.copy(), 1.0, 1.0, 0.0
    chart = log_probability.copy()
    if len(chart):
        if not _sound(chart):
            return seen, np.nan, allowed, False
        exponentiate(chart)
        allowed = total_product(weights, chart)
    if len(log_likelihood):
        if not _sound(log_likelihood):
            return seen, np.nan, allowed, False
        best = _greatest(log_likelihood, weights)
        if best == -np.inf:
            return seen, best, allowed, allowed <= least
        ratio = _below(log_likelihood, best)
        exponentiate(ratio)
        _multiply(seen, ratio)
        total = total_of(seen)
    forbidden = False
    if len(chart):
        joint = total_product(seen, chart)
        forbidden = joint <= least * total
        if not forbidden:
            _multiply(seen, chart)
            total, best = joint, best - np.log(allowed)
    scale = 1.0 / total
    for i in range(len(seen)):
        seen[i] *= scale
    return seen, best + np.log(total), allowed, forbidden


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _exponents(at: Array, centres: Array, column: int, out: Array) -> None:
    """Minus half the squared distances of one point from the centres."""
    out[:] = 0.0
    for k in range(len(centres)):
        here, row = at[k, column], centres[k]
        for j in range(len(out)):
            out[j] -= 0.5 * (row[j] - here) * (row[j] - here)


@njit(cache=True, nogil=True, error_model="numpy")
def log_mixture(at: Array, centres: Array, weights: Array) -> Array:
    """Log of ``sum_j w_j exp(-|at_i - centre_j|^2 / 2)`` for columns ``(d, M)`` and ``(d, N)``; ``(M,)``."""
    total = np.empty(at.shape[1])
    exponents = np.empty(len(weights))
    for i in range(len(total)):
        _exponents(at, centres, i, exponents)
        best = _greatest(exponents, weights)
        shares = _below(exponents, best)
        exponentiate(shares)
        total[i] = best + np.log(total_product(weights, shares))
    return total
