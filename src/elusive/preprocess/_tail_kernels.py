"""Compiled kernels of the tails of peaks: quantile plots, and the rating of a frame's peaks by them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._kernels import BLOCK, copy_row, exponentiate, take_logarithms
from elusive._njit import njit
from elusive.contracts import Array

Index = NDArray[np.int64]

NEWTON = 3  # steps, from a start that is near


@njit(cache=True, nogil=True, error_model="numpy")
def invert(costs: Array) -> None:
    """Replace each of a row's values by the u above 1 that solves ``u^2 / 2 - log u = cost``."""
    logs, roots = np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, len(costs), BLOCK):
        cost = costs[first : first + BLOCK]
        log, u = logs[: len(cost)], roots[: len(cost)]
        for i in range(len(cost)):
            cost[i] = max(cost[i], 0.51)
            log[i] = 2.0 * cost[i] + 1.0
        take_logarithms(log)
        for i in range(len(cost)):
            u[i] = log[i] = np.sqrt(2.0 * cost[i] + log[i])
        for _ in range(NEWTON):
            take_logarithms(log)
            for i in range(len(cost)):
                u[i] = max(u[i] - (0.5 * u[i] * u[i] - log[i] - cost[i]) / max(u[i] - 1.0 / u[i], 0.3), 1.0)
                log[i] = u[i]
        for i in range(len(cost)):
            cost[i] = u[i]


@njit(cache=True, nogil=True, error_model="numpy")
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
    log_height, gauss, cost = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        log_height[i] = (least + edges[i]) / least
    take_logarithms(log_height)
    for i in range(n):
        gauss[i] = np.exp(log_height[i] - 0.5 * ((least + edges[i]) ** 2 - least * least))
    for k in range(shapes):
        total = histogram[k].sum()
        left, last, half = total, 0, -1
        for i in range(n):
            left -= histogram[k, i]
            cost[i] = max((left + prior * gauss[i]) / (total + prior), 1e-300)
            if half < 0 and cost[i] < 0.3:
                half = i
            if left > spared or edges[i] < 0.4:
                last = i
        known = cost[: last + 1]
        take_logarithms(known)
        for i in range(len(known)):
            known[i] = base - known[i]
        invert(known)
        copy_row(places[k], known)
        half = max(min(half, last - 4), 0)
        slope = np.log(places[k, last] / places[k, half]) / (log_height[last] - log_height[half])
        slope = min(max(slope, power[0]), power[1])
        for i in range(last + 1, n):
            places[k, i] = places[k, last] * np.exp(slope * (log_height[i] - log_height[last]))
    return places


@njit(cache=True, nogil=True, error_model="numpy")
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
    strength, middle, place = np.empty(n), np.empty(n), np.empty(n)
    row, column = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    per_edge = np.log(edges[1] / edges[0])
    base = 0.5 * least * least - np.log(least)
    for k in range(n):
        middle[k] = 0.5 * (log_middle[pool[k], kind[k]] + log_middle[pool[k], tile[k]])
    exponentiate(middle)
    for k in range(n):
        # as though its group's mean excess were Gaussian noise's
        strength[k] = max((heights[k] - least) / middle[k] * unit, 1e-9) / edges[0]
    take_logarithms(strength)
    for k in range(n):
        shape = 0
        for bound in heavy:
            shape += 1 if middle[k] > bound * unit else 0
        row[k] = pool[k] * (len(heavy) + 1) + shape
        at = strength[k] / per_edge
        column[k] = min(max(int(np.ceil(at)), 0), len(edges))
        plot = places[row[k]]
        if at <= 0.0:
            scaled = (heights[k] - least) / middle[k] * unit
            place[k] = least + max(scaled, 0.0) / edges[0] * (plot[0] - least)
        else:
            i = min(int(at), len(edges) - 2)
            place[k] = plot[i] + min(at - i, 1.0) * (plot[i + 1] - plot[i])
        place[k] = strength[k] = max(place[k], 1.0)
    take_logarithms(strength)
    for k in range(n):
        left = strength[k] - 0.5 * place[k] * place[k] + base
        log_density = 0.5 * (log_local[pool[k], kind[k]] + log_local[pool[k], tile[k]]) + left
        strength[k] = log_rate[scale[k]] - log_density
    invert(strength)
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
