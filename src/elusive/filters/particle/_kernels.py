"""Compiled kernels of the particle filters: resampling, weights, weighted moments."""

from __future__ import annotations

import numpy as np

from elusive._kernels import BLOCK, FIRST, exponentiate
from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True)
def _last_positive(weights: Array) -> int:
    # rounding of the cumulative sum must not let a particle of weight zero through at the end
    last = len(weights) - 1
    while last > 0 and weights[last] == 0.0:
        last -= 1
    return last


@njit(cache=True, nogil=True, fastmath={"reassoc"})
def total_of(weights: Array) -> float:
    """Sum of weights; NaN where one is negative or NaN."""
    total = 0.0
    below = 0
    for i in range(len(weights)):
        total += weights[i]
        below += 1 if weights[i] < 0.0 else 0
    return total if below == 0 else np.nan


@njit(cache=True, nogil=True, error_model="numpy")
def systematic(weights: Array, total: float, n: int, u0: float) -> np.ndarray:
    """Index of the particle under each comb tooth ``(u0 + j) / n`` of the cumulative weights.

    Each particle is written under the first tooth that its predecessors leave, where a later one with no weight
    between writes over it; the largest index so far then fills the gaps. No branch hangs on the weights.
    """
    chosen = np.zeros(n + 1, dtype=np.int64)
    teeth = n / total
    reached = 0.0
    first = np.uintp(0)
    for i in range(_last_positive(weights) + 1):
        chosen[first] = i
        reached += weights[i]
        first = np.uintp(min(n, int(np.ceil(reached * teeth - u0))))
    latest = 0
    for j in range(n):
        latest = max(latest, chosen[j])
        chosen[j] = latest
    return chosen[:n]


@njit(cache=True, nogil=True)
def walk(weights: Array, total: float, points: Array) -> np.ndarray:
    """Index of the particle under each ascending point of [0, 1)."""
    chosen = np.empty(len(points), dtype=np.int64)
    last = _last_positive(weights)
    i = 0
    reached = weights[0]
    for j in range(len(points)):
        tooth = points[j] * total
        while reached <= tooth and i < last:
            i += 1
            reached += weights[i]
        chosen[j] = i
    return chosen


@njit(cache=True, nogil=True)
def gather(states: Array, chosen: np.ndarray, total: int) -> Array:
    """Array of ``total`` rows, column by column in memory, whose first are the chosen rows; the others are not set."""
    n, d = len(chosen), states.shape[1]
    columns = states.T
    gathered = np.empty((d, total))
    for k in range(d):
        source, row = columns[k], gathered[k]
        for i in range(n):
            # unsigned indices spare the compiled code a test for negative ones
            row[i] = source[np.uintp(chosen[i])]
    return gathered.T


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc"})
def weigh(log_mass: Array) -> tuple[Array, float]:
    """Weights that sum to one, and the logarithm of the sum of masses; even weights where every mass is zero."""
    n = len(log_mass)
    best = -np.inf
    for i in range(n):
        best = max(best, log_mass[i])
    if best == -np.inf:
        return np.full(n, 1.0 / n), -np.inf
    weights = log_mass - best
    exponentiate(weights)
    total = 0.0
    for i in range(n):
        total += weights[i]
    for i in range(n):
        weights[i] /= total
    return weights, best + np.log(total)


@njit(cache=True, nogil=True)
def moments(states: Array, weights: Array) -> tuple[Array, Array]:
    """Mean ``(d,)`` and covariance ``(d, d)`` under weights that sum to one."""
    return moments_between(states.T, weights, FIRST)


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def moments_between(columns: Array, weights: Array, start: int) -> tuple[Array, Array]:
    """Return the same of particles from one on, as many as there are weights, from columns ``(d, N)``."""
    d, n = len(columns), len(weights)
    mean = np.empty(d)
    for k in range(d):
        row, total = columns[k, start : start + n], 0.0
        for i in range(n):
            total += weights[i] * row[i]
        mean[k] = total
    covariance = np.zeros((d, d))
    centred = np.empty((d, BLOCK))
    weighted = np.empty(BLOCK)
    for first in range(0, n, BLOCK):
        share = weights[first : first + BLOCK]
        size = len(share)
        for r in range(d):
            column = columns[r, start + first : start + first + size]
            for i in range(size):
                centred[r, i] = column[i] - mean[r]
                weighted[i] = share[i] * centred[r, i]
            for c in range(r + 1):
                total = 0.0
                for i in range(size):
                    total += weighted[i] * centred[c, i]
                covariance[r, c] += total
    for r in range(d):
        for c in range(r):
            covariance[c, r] = covariance[r, c]
    return mean, covariance


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def total_product(first: Array, second: Array) -> float:
    """Sum of products of two rows."""
    total = 0.0
    for i in range(len(first)):
        total += first[i] * second[i]
    return total
