"""Compiled kernels of the shadowed links: a person's effect on every link, and the likelihood of places."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elusive.contracts import Array

FLUSH = 1e120  # a product of scales is turned into a logarithm before it leaves the range of numbers
GONE = 50.0  # lengths after which a decay, 2e-22, is nothing


@njit(cache=True, nogil=True, error_model="numpy")
def excess_length(x: float, y: float, ends: Array, link: int) -> float:
    """Excess length of the path from one end of a link over (x, y) to the other [m]."""
    ax, ay, bx, by = ends[link, 0], ends[link, 1], ends[link, 2], ends[link, 3]
    straight = np.sqrt((ax - bx) ** 2 + (ay - by) ** 2)
    around = np.sqrt((x - ax) ** 2 + (y - ay) ** 2) + np.sqrt((x - bx) ** 2 + (y - by) ** 2)
    excess: float = max(around - straight, 0.0)
    return excess


@njit(cache=True, nogil=True, error_model="numpy")
def decay(excess: float, length: float) -> float:
    """Exponential decay; most places are far from most links, and cost no exponential."""
    value: float = 0.0 if excess > GONE * length else np.exp(-excess / length)
    return value


@njit(cache=True, nogil=True, error_model="numpy")
def profiles(excess: float, near: float, wide: float, far: float) -> tuple[float, float, float]:
    """Decay of the mean's, the near and the far spread's effect with the excess path length."""
    return decay(excess, near), decay(excess, wide), decay(excess, far)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def log_likelihood(
    places: Array,
    weight: float,
    change: Array,
    mean: Array,
    variance: Array,
    ends: Array,
    loss: Array,
    near_variance: Array,
    far_variance: Array,
    lengths: tuple[float, float, float],
    degrees: float,
    ways: NDArray[np.int64],
) -> Array:
    """Log likelihood, but for a constant, of one more person of a weight at each place ``(N, 2)``.

    Rows of the arrays ``(D, C)`` are the directed links; ``ways[link]`` are an undirected link's two rows. NaN
    changes say nothing. Student's t: the scales and the residuals are gathered in products, whose logarithms are few.
    """
    total = np.zeros(len(places))
    channels = change.shape[1]
    half, more = 0.5 * degrees, 0.5 * (degrees + 1.0)
    for n in range(len(places)):
        log_sum, scales, residuals = 0.0, 1.0, 1.0
        for link in range(len(ends)):
            excess = excess_length(places[n, 0], places[n, 1], ends, link)
            near, wide, far = profiles(excess, lengths[0], lengths[1], lengths[2])
            for way in range(2):
                row = ways[link, way]
                for channel in range(channels):
                    seen = change[row, channel]
                    if np.isnan(seen):
                        continue
                    off = seen - mean[row, channel] + weight * near * loss[row, channel]
                    squared = variance[row, channel] + weight * (
                        wide * near_variance[row, channel] + far * far_variance[row, channel]
                    )
                    scales *= squared
                    residuals *= degrees * squared + off * off
                    if max(residuals, scales) > FLUSH or min(residuals, scales) < 1.0 / FLUSH:
                        log_sum += half * np.log(scales) - more * np.log(residuals)
                        scales, residuals = 1.0, 1.0
        total[n] = log_sum + half * np.log(scales) - more * np.log(residuals)
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def mean_profiles(places: Array, ends: Array, lengths: tuple[float, float, float]) -> tuple[Array, Array, Array, Array]:
    """Mean over places ``(N, 2)`` of a person's three profiles on each link, and of the first one's square."""
    links = len(ends)
    near_sum, square_sum, wide_sum, far_sum = np.zeros(links), np.zeros(links), np.zeros(links), np.zeros(links)
    for n in range(len(places)):
        for link in range(links):
            excess = excess_length(places[n, 0], places[n, 1], ends, link)
            near, wide, far = profiles(excess, lengths[0], lengths[1], lengths[2])
            near_sum[link] += near
            square_sum[link] += near * near
            wide_sum[link] += wide
            far_sum[link] += far
    size = len(places)
    return near_sum / size, square_sum / size, wide_sum / size, far_sum / size
