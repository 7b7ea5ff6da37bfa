"""Compiled kernels of the sliding windows: sums and spreads at a cost that does not grow with the window.

Van Herk (1992) and Gil and Werman (1993): the signal is cut into blocks as long as the window, so that every window is
the end of one block and the start of the next; nothing is ever subtracted, so integers are summed exactly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True)
def positions(n: int, half: int, border: int) -> NDArray[np.int64]:
    """Sample that stands at each place from ``-half`` to ``n + half - 1``, -1 where none does; ``half <= n``.

    ``border`` counts circular (0), reflected with the last sample repeated (1), cut (2).
    """
    source = np.empty(n + 2 * half, dtype=np.int64)
    for place in range(-half, n + half):
        sample = place
        if place < 0:
            sample = (place + n, -1 - place, -1)[border]
        elif place >= n:
            sample = (place - n, 2 * n - 1 - place, -1)[border]
        source[place + half] = sample
    return source


@njit(cache=True, nogil=True)
def row_sums(values: Array, half: int, border: int) -> Array:
    """Sum of the samples in each window of each row, ``(rows, n)``."""
    rows, n = values.shape
    source, window = positions(n, half, border), 2 * half + 1
    sums = np.empty((rows, n))
    for row in range(rows):
        for start in range(0, n, window):
            total = 0.0
            for k in range(min(start + window, len(source)) - 1, start - 1, -1):
                if source[k] >= 0:
                    total += values[row, source[k]]
                if k < n:
                    sums[row, k] = total
            total = 0.0
            for k in range(start + 1, min(start + window, n)):
                if source[k + window - 1] >= 0:
                    total += values[row, source[k + window - 1]]
                sums[row, k] += total
    return sums


@njit(cache=True, nogil=True)
def row_spreads(means: Array, variances: Array, half: int, border: int) -> tuple[Array, Array]:
    """Mean and biased variance in each window of each row, ``(rows, n)``, of elements that themselves have both.

    Groups are merged by the difference of their means (Chan, Golub and LeVeque, 1983), so that neither a large mean
    nor an outlier beside the window costs digits.
    """
    rows, n = means.shape
    source, window = positions(n, half, border), 2 * half + 1
    mean, variance = np.empty((rows, n)), np.empty((rows, n))
    counts = np.empty(n, dtype=np.int64)
    for row in range(rows):
        for start in range(0, n, window):
            count, m, s = 0, 0.0, 0.0
            for k in range(min(start + window, len(source)) - 1, start - 1, -1):
                if source[k] >= 0:
                    count, m, s = _with(count, m, s, means[row, source[k]], variances[row, source[k]])
                if k < n:
                    counts[k], mean[row, k], variance[row, k] = count, m, s
            count, m, s = 0, 0.0, 0.0
            for k in range(start, min(start + window, n)):
                end = k + window - 1
                if k > start and source[end] >= 0:
                    count, m, s = _with(count, m, s, means[row, source[end]], variances[row, source[end]])
                every = 1.0 / (counts[k] + count)
                apart, share = m - mean[row, k], count * every
                variance[row, k] = (variance[row, k] + s + apart * apart * share * counts[k]) * every
                mean[row, k] += apart * share
    return mean, variance


@njit(cache=True, nogil=True)
def _with(count: int, m: float, s: float, mean: float, variance: float) -> tuple[int, float, float]:
    """Count, mean and sum of squares about it once another element is in the group (Welford, 1962)."""
    apart = mean - m
    share = 1.0 / (count + 1)
    return count + 1, m + apart * share, s + variance + apart * apart * (1.0 - share)


@njit(cache=True, nogil=True)
def moments(values: Array) -> tuple[float, float]:
    """Mean and biased deviation of all values; the deviation is exactly zero where they are all equal."""
    total = 0.0
    for value in values:
        total += value - values[0]
    mean = total / len(values)
    square = 0.0
    for value in values:
        square += (value - values[0] - mean) ** 2
    return values[0] + mean, np.sqrt(square / len(values))


@njit(cache=True, nogil=True)
def regions(values: Array, boundaries: Array) -> tuple[Array, Array]:
    """One where a value lies in a region, ``R_i < M <= R_{i+1}``, else zero, ``(regions, n)``; and how many do."""
    inside, overall = np.zeros((len(boundaries) + 1, len(values))), np.zeros(len(boundaries) + 1)
    for k in range(len(values)):
        region = 0
        for boundary in boundaries:
            region += values[k] > boundary
        inside[region, k] = 1.0
        overall[region] += 1.0
    return inside, overall


@njit(cache=True, nogil=True)
def cosines(local: Array, overall: Array) -> Array:
    """Cosine of the angle between local counts, ``(regions, n)``, and overall counts, eqs. 5a-5c."""
    along, square = np.zeros(local.shape[1]), np.zeros(local.shape[1])
    for i in range(len(overall)):
        for k in range(len(along)):
            along[k] += overall[i] * local[i, k]
            square[k] += local[i, k] * local[i, k]
    cosine: Array = along / np.sqrt(square * (overall * overall).sum())
    return cosine


@njit(cache=True, nogil=True)
def chi_squares(local: Array, overall: Array) -> Array:
    """Chi-square of local counts, ``(regions, n)``, against overall counts scaled to as many samples, eq. 2."""
    seen, found = np.zeros(local.shape[1]), np.zeros(local.shape[1])
    for i in range(len(overall)):
        for k in range(len(seen)):
            seen[k] += local[i, k]
    share = overall / overall.sum()
    for i in range(len(overall)):
        # no sample of the frame lies in an empty region, so none of the window does
        if overall[i] > 0:
            weight = 1.0 / share[i]
            for k in range(len(seen)):
                found[k] += (local[i, k] - share[i] * seen[k]) ** 2 * weight
    return found / seen
