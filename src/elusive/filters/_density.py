"""Weighted Gaussian kernel densities in a few dimensions, by plain sums.

Silverman (1986), sections 3.4 and 4.3, the sample size being the effective one.
"""

from __future__ import annotations

import numpy as np

from elusive.contracts import Array

QUANTILES = 256  # candidates for the mode of one component
ROWS_AT_ONCE = 256  # rows of the table of kernels held in memory at a time


def whitening_of(points: Array, weights: Array) -> Array:
    """Matrix that takes a difference of points to units of the bandwidth; directions without spread get a small one."""
    k = points.shape[1]
    count = 1 / np.dot(weights, weights)
    centred = points - weights @ points
    variances, axes = np.linalg.eigh((weights[:, None] * centred).T @ centred)
    largest = variances[-1] if variances[-1] > 0 else 1.0
    bandwidth = (4 / ((k + 2) * count)) ** (1 / (k + 4)) * np.sqrt(np.maximum(variances, 1e-12 * largest))
    whitening: Array = (axes / bandwidth).T
    return whitening


def density(at: Array, points: Array, weights: Array, whitening: Array) -> Array:
    """Weighted sum of Gaussian kernels, some rows at a time."""
    k = points.shape[1]
    scale = abs(np.linalg.det(whitening)) / (2 * np.pi) ** (k / 2)
    at, points = at @ whitening.T, points @ whitening.T
    total = np.empty(len(at))
    for first in range(0, len(at), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        distance2 = sum((at[rows, j, None] - points[:, j]) ** 2 for j in range(k))
        total[rows] = np.exp(-0.5 * distance2) @ weights
    return np.asarray(scale * total)


def mode(values: Array, weights: Array) -> float:
    """Highest point of a 1-D kernel density: the best of many quantiles, then mean shift uphill."""
    points = values[:, None]
    whitening = whitening_of(points, weights)
    order = np.argsort(values)
    at = np.searchsorted(np.cumsum(weights[order]), (np.arange(QUANTILES) + 0.5) / QUANTILES)
    candidates = values[order[np.minimum(at, len(values) - 1)]]
    best = float(candidates[np.argmax(density(candidates[:, None], points, weights, whitening))])
    for _ in range(200):
        pull = weights * np.exp(-0.5 * ((values - best) * whitening[0, 0]) ** 2)
        moved = float(pull @ values / pull.sum())
        if abs(moved - best) * abs(whitening[0, 0]) < 1e-6:
            return moved
        best = moved
    return best
