"""Compiled kernels of the particle filters: one walk along the weights for resampling and births, weighted moments."""

from __future__ import annotations

import numpy as np
from numba import njit

from elusive.contracts import Array, X, Y


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


@njit(cache=True, nogil=True)
def systematic(weights: Array, total: float, n: int, u0: float) -> np.ndarray:
    """Index of the particle under each comb tooth ``(u0 + j) / n`` of the cumulative weights."""
    chosen = np.empty(n, dtype=np.int64)
    step = total / n
    last = _last_positive(weights)
    i = 0
    reached = weights[0]
    for j in range(n):
        tooth = (u0 + j) * step
        while reached <= tooth and i < last:
            i += 1
            reached += weights[i]
        chosen[j] = i
    return chosen


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


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def moments(states: Array, weights: Array) -> tuple[Array, Array]:
    """Mean ``(d,)`` and covariance ``(d, d)`` under weights that sum to one."""
    n, d = states.shape
    columns = np.empty((d, n))
    for i in range(n):
        for k in range(d):
            columns[k, i] = states[i, k]
    mean = np.empty(d)
    for k in range(d):
        total = 0.0
        for i in range(n):
            total += weights[i] * columns[k, i]
        mean[k] = total
        for i in range(n):
            columns[k, i] -= total
    covariance = np.empty((d, d))
    for r in range(d):
        for c in range(r + 1):
            total = 0.0
            for i in range(n):
                total += weights[i] * columns[r, i] * columns[c, i]
            covariance[r, c] = covariance[c, r] = total
    return mean, covariance


@njit(cache=True, nogil=True)
def draw_cells(log_preference: Array, n: int, uniform_share: float, u0: float) -> tuple[np.ndarray, Array]:
    """Draw cells in proportion to ``exp(log_preference)`` mixed with uniform; also log of uniform over mixture.

    One systematic comb ``(u0 + j) / n`` over the mixture: unbiased, and with less spread than independent draws.
    """
    cells = len(log_preference)
    best = log_preference.max()
    share = np.empty(cells)
    total = 0.0
    for i in range(cells):
        share[i] = np.exp(log_preference[i] - best)
        total += share[i]
    scale = (1.0 - uniform_share) / total
    floor = uniform_share / cells
    chosen = np.empty(n, dtype=np.int64)
    log_ratio = np.empty(n)
    i = 0
    reached = share[0] * scale + floor
    here = -np.log(reached * cells)
    for j in range(n):
        tooth = (u0 + j) / n
        if reached <= tooth and i < cells - 1:
            while reached <= tooth and i < cells - 1:
                i += 1
                reached += share[i] * scale + floor
            here = -np.log((share[i] * scale + floor) * cells)
        chosen[j] = i
        log_ratio[j] = here
    return chosen, log_ratio


@njit(cache=True, nogil=True)
def fill_newborns(
    uniform: Array, cells: np.ndarray, columns: int, pitch: tuple[float, float], low: Array, high: Array
) -> Array:
    """Turn uniform numbers in place into states: each component in its [low, high), x and y about their cell."""
    n, d = uniform.shape
    for i in range(n):
        for k in range(d):
            uniform[i, k] = low[k] + (high[k] - low[k]) * uniform[i, k]
        row = cells[i] // columns
        uniform[i, X] += (cells[i] - row * columns) * pitch[0]
        uniform[i, Y] += row * pitch[1]
    return uniform
