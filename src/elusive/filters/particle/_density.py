"""Weighted Gaussian kernel densities in a few dimensions, by plain sums.

Silverman (1986), sections 3.4 and 4.3, the sample size being the effective one.
"""

from __future__ import annotations

import numpy as np

from elusive.contracts import Array

BINS = 8  # of the grid that a mode is first sought on, a bandwidth
MOST_BINS = 20_000
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
    """Highest point of a 1-D kernel density: the best of a binned one, then Newton's steps uphill."""
    scale = float(whitening_of(values[:, None], weights)[0, 0])
    best = _binned_mode(values, weights, scale)
    for _ in range(200):
        off = (values - best) * scale
        pull = weights * np.exp(-0.5 * off * off)
        slope, bend = float(pull @ off), float(pull.sum() - pull @ (off * off))
        # where the density bends upwards, or far from its top: a step of the mean shift
        step = slope / (bend if bend > abs(slope) else pull.sum())
        best += step / scale
        if abs(step) < 1e-6:
            break
    return best


def _binned_mode(values: Array, weights: Array, scale: float) -> float:
    """Best place of a grid: the weights shared among the two bins beside each value, then smoothed.

    Wand (1994), Fast computation of multivariate kernel estimators. Where the grid would be long, the best of many
    quantiles instead.
    """
    low = float(values.min())
    at = (values - low) * (scale * BINS)
    if at.max() > MOST_BINS:
        order = np.argsort(values)
        place = np.searchsorted(np.cumsum(weights[order]), (np.arange(QUANTILES) + 0.5) / QUANTILES)
        candidates = values[order[np.minimum(place, len(values) - 1)]]
        found = density(candidates[:, None], values[:, None], weights, np.array([[scale]]))
        return float(candidates[np.argmax(found)])
    left = at.astype(np.int64)
    share = at - left
    size = int(left.max()) + 2
    mass = np.bincount(left, weights * (1 - share), size) + np.bincount(left + 1, weights * share, size)
    kernel = np.exp(-0.5 * (np.arange(-5 * BINS, 5 * BINS + 1) / BINS) ** 2)
    # the full convolution, cut by hand: "same" would take the longer operand's length
    smooth = np.convolve(mass, kernel)[5 * BINS : 5 * BINS + size]
    return low + int(np.argmax(smooth)) / (scale * BINS)
