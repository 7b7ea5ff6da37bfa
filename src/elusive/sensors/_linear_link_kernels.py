"""Compiled kernels of the linear links: a person's attenuation, weighted over the voxels near them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array

Indices32 = NDArray[np.int32]
REACH = 3.5  # deviations within which a person's attenuation counts
FLUSH = 1e200  # a product of variances becomes a logarithm before it leaves the range of numbers


@njit(cache=True, nogil=True, error_model="numpy")
def add_response(
    x: float,
    y: float,
    shape: tuple[float, float, float, float],
    grid: tuple[float, float, float, int, int],
    first: Indices32,
    links: Indices32,
    weights: Array,
    response: Array,
) -> None:
    """Add to each link's ``response`` what a person at (x, y) changes it by.

    ``shape`` is the amplitude, the two independent elements of the inverse covariance's diagonal, its off-diagonal, and
    with them the reach; voxel v's links and weights stand from ``first[v]`` on.
    """
    amplitude, xx, yy, xy = shape
    x0, y0, voxel, rows, columns = grid
    determinant = xx * yy - xy * xy
    reach_x, reach_y = REACH * np.sqrt(yy / determinant), REACH * np.sqrt(xx / determinant)
    left = max(0, int(np.ceil((x - reach_x - x0) / voxel - 0.5)))
    right = min(columns - 1, int(np.floor((x + reach_x - x0) / voxel - 0.5)))
    low = max(0, int(np.ceil((y - reach_y - y0) / voxel - 0.5)))
    high = min(rows - 1, int(np.floor((y + reach_y - y0) / voxel - 0.5)))
    for row in range(low, high + 1):
        dy = y0 + (row + 0.5) * voxel - y
        for column in range(left, right + 1):
            dx = x0 + (column + 0.5) * voxel - x
            value = amplitude * np.exp(-0.5 * (xx * dx * dx + yy * dy * dy) - xy * dx * dy)
            at = row * columns + column
            for k in range(first[at], first[at + 1]):
                response[links[k]] += value * weights[k]


@njit(cache=True, nogil=True, error_model="numpy")
def responses(
    places: Array,
    size: int,
    shape: tuple[float, float, float, float],
    grid: tuple[float, float, float, int, int],
    first: Indices32,
    links: Indices32,
    weights: Array,
) -> Array:
    """Change of each of ``size`` links by a person at each place ``(N, 2)``, ``(N, size)``."""
    response = np.zeros((len(places), size))
    for n in range(len(places)):
        add_response(places[n, 0], places[n, 1], shape, grid, first, links, weights, response[n])
    return response


@njit(cache=True, nogil=True, error_model="numpy")
def log_ratio(responses: Array, residual: Array, variance: Array, spread: float) -> Array:
    """Gaussian log likelihood ratio of one more person of each response ``(N, L)``; NaN residuals say nothing.

    The person adds ``(spread * response)^2`` to the variance. Ratios of variances are gathered in a product, whose
    logarithms are few.
    """
    ratios = np.empty(len(responses))
    for n in range(len(responses)):
        total, product = 0.0, 1.0
        for link in range(len(residual)):
            change, seen = responses[n, link], residual[link]
            if change == 0.0 or np.isnan(seen):
                continue
            wider = variance[link] + (spread * change) ** 2
            total += seen * seen / variance[link] - (seen - change) ** 2 / wider
            product *= wider / variance[link]
            if product > FLUSH:
                total -= np.log(product)
                product = 1.0
        ratios[n] = 0.5 * (total - np.log(product))
    return ratios
