"""Compiled kernels of the tails of peaks: quantile plots, and the rating of a frame's peaks by them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elusive.contracts import Array

Index = NDArray[np.int64]

NEWTON = 3  # steps, from a start that is near


@njit(cache=True, nogil=True)
def invert(cost: float) -> Any:
    """Solve ``u^2 / 2 - log u = cost`` for u above 1."""
    cost = max(cost, 0.51)
    u = np.sqrt(2.0 * cost + np.log(2.0 * cost + 1.0))
    for _ in range(NEWTON):
        u = max(u - (0.5 * u * u - np.log(u) - cost) / max(u - 1.0 / u, 0.3), 1.0)
    return u


@njit(cache=True, nogil=True)
def quantile_plots(
    histogram: Array, edges: Array, least: float, spared: float, prior: float, power: tuple[float, float]
) -> Array:
    """Gaussian height of each edge of a histogram of excess over ``least``, for each of its rows.

    Beyond the edge that ``spared`` values surpass it goes on as a power of the height, held within ``power``.
    Gaussian noise counts for ``prior`` values, so that a first small frame has a tail.
    """
    shapes, n = len(histogram), len(edges)
    places = np.empty((shapes, n))
    base = 0.5 * least * least - np.log(least)
    for k in range(shapes):
        total = histogram[k].sum()
        left, last, half = total, 0, -1
        for i in range(n):
            left -= histogram[k, i]
            height = least + edges[i]
            gauss = np.exp(np.log(height / least) - 0.5 * (height * height - least * least))
            share = (left + prior * gauss) / (total + prior)
            places[k, i] = invert(base - np.log(max(share, 1e-300)))
            if half < 0 and share < 0.3:
                half = i
            if left > spared or height < least + 0.4:
                last = i
        half = max(min(half, last - 4), 0)
        top = least + edges[last]
        slope = np.log(places[k, last] / places[k, half]) / np.log(top / (least + edges[half]))
        slope = min(max(slope, power[0]), power[1])
        for i in range(last + 1, n):
            places[k, i] = places[k, last] * ((least + edges[i]) / top) ** slope
    return places


@njit(cache=True, nogil=True)
def rate(
    heights: Array,
    pool: Index,
    kind: Index,
    tile: Index,
    scale: Index,
    log_middle: Array,
    log_local: Array,
    places: Array,
    edges: Array,
    heavy: Array,
    least: float,
    unit: float,
    log_rate: Array,
) -> tuple[Array, Array, Index, Index]:
    """Strength of each peak, its mean excess, and its row and bin in the histogram."""
    n = len(heights)
    strength, middle = np.empty(n), np.empty(n)
    row, column = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    per_edge = np.log(edges[1] / edges[0])
    base = 0.5 * least * least - np.log(least)
    for k in range(n):
        p = pool[k]
        middle[k] = np.exp(0.5 * (log_middle[p, kind[k]] + log_middle[p, tile[k]]))
        shape = 0
        for bound in heavy:
            shape += 1 if middle[k] > bound * unit else 0
        row[k] = p * (len(heavy) + 1) + shape
        # as though its group's mean excess were Gaussian noise's
        scaled = (heights[k] - least) / middle[k] * unit
        at = np.log(max(scaled, 1e-9) / edges[0]) / per_edge
        column[k] = min(max(int(np.ceil(at)), 0), len(edges))
        plot = places[row[k]]
        if at <= 0.0:
            place = least + max(scaled, 0.0) / edges[0] * (plot[0] - least)
        else:
            i = min(int(at), len(edges) - 2)
            place = plot[i] + min(at - i, 1.0) * (plot[i + 1] - plot[i])
        place = max(place, 1.0)
        left = np.log(place) - 0.5 * place * place + base
        log_density = 0.5 * (log_local[p, kind[k]] + log_local[p, tile[k]]) + left
        strength[k] = invert(log_rate[scale[k]] - log_density)
    return strength, middle, row, column


@njit(cache=True, nogil=True)
def count(
    heights: Array,
    pool: Index,
    kind: Index,
    tile: Index,
    middle: Array,
    row: Index,
    column: Index,
    least: float,
    clip: float,
    spared: int,
    peaks: Array,
    excess: Array,
    histogram: Array,
) -> None:
    """Add a frame's peaks to the counts in place, but for each pool's ``spared`` greatest (a quarter of it at most)."""
    pools = len(peaks)
    sizes = np.zeros(pools, dtype=np.int64)
    greatest = np.zeros((pools, spared))
    for k in range(len(heights)):
        p = pool[k]
        sizes[p] += 1
        value = (heights[k] - least) / middle[k]
        for i in range(spared):
            if value > greatest[p, i]:
                value, greatest[p, i] = greatest[p, i], value
    for k in range(len(heights)):
        p = pool[k]
        histogram[row[k], column[k]] += 1.0
        over = heights[k] - least
        free = min(spared, sizes[p] // 4)
        if free > 0 and over / middle[k] >= greatest[p, free - 1]:
            continue
        over = min(over, clip * middle[k])
        for group in (kind[k], tile[k]):
            peaks[p, group] += 1.0
            excess[p, group] += over
