"""Compiled kernels of the shadowed links: a person's effect on every link, and the likelihood of places.

What a link's readings say depends on a place by one number alone, the excess path length. So it is evaluated at knots,
evenly within each doubling of it, over the reach of the cloud, and read by cubics between them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array, Flags

Indices = NDArray[np.int64]
Slope = tuple[float, float]  # a value and its slope
CHUNK = 16  # readings whose ratios stay within the range of numbers when multiplied
GONE = 36.0  # lengths after which a decay, 2e-16, is nothing
PRODUCT = 300.0  # lengths of a link up to which its decay is a product of numbers within their range
SHIFT = 49  # bits of a number below the eighth of its power of two: eight knots a doubling
KNOTS = 160  # twenty doublings of the shortest length


@njit(cache=True, nogil=True, error_model="numpy")
def decay(excess: float, length: float) -> float:
    """Exponential decay; most places are far from most links, and cost no exponential."""
    value: float = 0.0 if excess > GONE * length else np.exp(-excess / length)
    return value


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def level(excess: float, weight: float, own: Array, lengths: tuple[float, float, float], degrees: float) -> Slope:
    """Log likelihood of a link's readings, but for a constant, of a person of a weight, and its slope.

    ``own`` ``(4, R)``: residual and loss in the deviations without the person, near and far variance in the variance.
    Student's t: the scales and the residuals are gathered in products, whose logarithms are few.
    """
    near, wide = weight * decay(excess, lengths[0]), weight * decay(excess, lengths[1])
    far = weight * decay(excess, lengths[2])
    half, more = 0.5 * degrees, 0.5 * (degrees + 1.0)
    total, slope = 0.0, 0.0
    for first in range(0, own.shape[1], CHUNK):
        scales, residuals = 1.0, 1.0
        for r in range(first, min(first + CHUNK, own.shape[1])):
            off = own[0, r] + near * own[1, r]
            near_part, far_part = wide * own[2, r], far * own[3, r]
            scale = 1.0 + near_part + far_part
            residual = degrees * scale + off * off
            scales *= scale
            residuals *= residual
            shrink = near_part / lengths[1] + far_part / lengths[2]
            turn = near * own[1, r] / lengths[0]
            slope += more * (degrees * shrink + 2.0 * off * turn) / residual - half * shrink / scale
        total += half * np.log(scales) - more * np.log(residuals)
    return total, slope


@njit(cache=True, nogil=True, error_model="numpy")
def prepare(
    residual: Array,
    variance: Array,
    loss: Array,
    near_variance: Array,
    far_variance: Array,
    degrees: float,
    ways: Indices,
) -> tuple[Array, Indices, Array, Array, Flags]:
    """Lay out what links say of one more person: a link's ``own`` readings, how many, their level without the person.

    ``ways`` ``(L, 2)`` are the two rows of each undirected link in the arrays ``(D, C)``; NaN residuals say nothing.
    The cubics between a link's knots ``(L, KNOTS, 4)`` are found as they are asked for; the flags tell which are.
    """
    links, channels = len(ways), residual.shape[1]
    own, heard, without = np.empty((links, 4, 2 * channels)), np.zeros(links, np.int64), np.zeros(links)
    for link in range(links):
        count = 0
        for way in range(2):
            row = ways[link, way]
            for channel in range(channels):
                if not np.isnan(residual[row, channel]):
                    deviation = np.sqrt(variance[row, channel])
                    own[link, 0, count] = residual[row, channel] / deviation
                    own[link, 1, count] = loss[row, channel] / deviation
                    own[link, 2, count] = near_variance[row, channel] / variance[row, channel]
                    own[link, 3, count] = far_variance[row, channel] / variance[row, channel]
                    count += 1
        heard[link] = count
        without[link] = level(0.0, 0.0, own[link, :, :count], (1.0, 1.0, 1.0), degrees)[0]
    return own, heard, without, np.empty((links, KNOTS, 4)), np.zeros((links, KNOTS), np.bool_)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def log_ratio(
    distances: Array,
    ends: Indices,
    straight: Array,
    lengths: tuple[float, float, float],
    degrees: float,
    own: Array,
    heard: Indices,
    without: Array,
    cubics: Array,
    known: Flags,
) -> Array:
    """Log likelihood ratio ``(N,)`` of one more person at places whose distances to the nodes are ``(S, N)``.

    ``ends`` ``(L, 2)`` are the nodes of each undirected link, ``straight`` its length; the rest is from ``prepare``.
    """
    places = distances.shape[1]
    total, shifted = np.zeros(places), np.empty(places)
    bits = shifted.view(np.uint64)
    core = 0.5 * min(lengths)
    first = np.array([core]).view(np.int64)[0] >> SHIFT
    at = ((np.arange(KNOTS + 1) + first) << SHIFT).view(np.float64)
    origin = np.uint64(first)
    for link in range(len(ends)):
        if heard[link] == 0:
            continue
        mine, cubic = own[link, :, : heard[link]], cubics[link]
        one, other = distances[ends[link, 0]], distances[ends[link, 1]]
        low, high = np.inf, 0.0
        for n in range(places):
            shifted[n] = max(one[n] + other[n] - straight[link], 0.0) + core
            low, high = min(low, shifted[n]), max(high, shifted[n])
        reach = (np.array([low, high]).view(np.int64) >> SHIFT) - first
        if reach[1] - reach[0] + 2 > places or reach[1] >= KNOTS:
            for n in range(places):
                total[n] += level(shifted[n] - core, 1.0, mine, lengths, degrees)[0] - without[link]
            continue
        end = -1  # knot whose level is at hand
        value, slope = 0.0, 0.0
        for k in range(reach[0], reach[1] + 1):
            if known[link, k]:
                continue
            if end != k:
                value, slope = level(at[k] - core, 1.0, mine, lengths, degrees)
            ahead, turn = level(at[k + 1] - core, 1.0, mine, lengths, degrees)
            width = at[k + 1] - at[k]
            rise = (ahead - value) / width
            cubic[k, 0], cubic[k, 1] = value - without[link], slope
            cubic[k, 2] = (3.0 * rise - 2.0 * slope - turn) / width
            cubic[k, 3] = (slope + turn - 2.0 * rise) / (width * width)
            known[link, k] = True
            end, value, slope = k + 1, ahead, turn
        for n in range(places):
            k = (bits[n] >> np.uint64(SHIFT)) - origin
            d = shifted[n] - at[k]
            total[n] += cubic[k, 0] + d * (cubic[k, 1] + d * (cubic[k, 2] + d * cubic[k, 3]))
    return total


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def mean_profiles(
    distances: Array, weights: Array, ends: Indices, straight: Array, lengths: tuple[float, float, float]
) -> Array:
    """Weighted mean over places of a person's three decays on each link, and of the first one's square, ``(4, L)``.

    The far decay of a sum of distances is a product; the others are asked for where the cloud comes near a link.
    """
    nodes, places = distances.shape
    sums, least, faded = np.zeros((4, len(ends))), np.empty(nodes), np.empty((nodes, places))
    for node in range(nodes):
        least[node] = distances[node].min()
        for n in range(places):
            faded[node, n] = np.exp(-distances[node, n] / lengths[2])
    reach = GONE * max(lengths[0], lengths[1])
    for link in range(len(ends)):
        first, second = ends[link, 0], ends[link, 1]
        one, other, far = distances[first], distances[second], 0.0
        if straight[link] < PRODUCT * lengths[2]:
            for n in range(places):
                far += weights[n] * faded[first, n] * faded[second, n]
            sums[3, link] = far * np.exp(straight[link] / lengths[2])
        else:
            for n in range(places):
                far += weights[n] * decay(max(one[n] + other[n] - straight[link], 0.0), lengths[2])
            sums[3, link] = far
        if least[first] + least[second] - straight[link] > reach:
            continue
        for n in range(places):
            excess = max(one[n] + other[n] - straight[link], 0.0)
            if excess < reach:
                near = decay(excess, lengths[0])
                sums[0, link] += weights[n] * near
                sums[1, link] += weights[n] * near * near
                sums[2, link] += weights[n] * decay(excess, lengths[1])
    return sums


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def slopes(
    distances: Array,
    weights: Array,
    ends: Indices,
    straight: Array,
    ways: Indices,
    lengths: tuple[float, float, float],
    degrees: float,
    residual: Array,
    variance: Array,
    loss: Array,
    near_variance: Array,
    far_variance: Array,
    by_reading: Array,
    by_constant: Array,
) -> float:
    """Mean log likelihood of the readings over places that a person may be at, and nowhere, and add its slopes.

    ``by_reading`` ``(3, D, C)`` takes the slopes by the squared scale and by the mean of each reading without the
    person, and by the logarithm of the spread that the person adds; ``by_constant`` ``(6,)`` those by the logarithms of
    loss, its length, near spread, its length, far spread and its length. Residuals are finite where a reading is heard.
    """
    nobody, total, more = 1.0 - weights.sum(), 0.0, degrees + 1.0
    places, channels = len(weights), residual.shape[1]
    for link in range(len(ends)):
        one, other = distances[ends[link, 0]], distances[ends[link, 1]]
        for place in range(places + 1):
            weight, near, wide, far, excess = nobody, 0.0, 0.0, 0.0, 0.0
            if place < places:
                weight = weights[place]
                excess = max(one[place] + other[place] - straight[link], 0.0)
                near, wide, far = decay(excess, lengths[0]), decay(excess, lengths[1]), decay(excess, lengths[2])
            for way in range(2):
                row, scales, residuals = ways[link, way], 1.0, 1.0
                for c in range(channels):
                    if np.isnan(residual[row, c]):
                        continue
                    turn = near * loss[row, c]
                    near_part, far_part = wide * near_variance[row, c], far * far_variance[row, c]
                    scale = variance[row, c] + near_part + far_part
                    off = residual[row, c] + turn
                    heavy = degrees * scale + off * off
                    scales *= scale
                    residuals *= heavy
                    if c % CHUNK == CHUNK - 1:
                        total += 0.5 * weight * (degrees * np.log(scales) - more * np.log(residuals))
                        scales, residuals = 1.0, 1.0
                    by_scale = 0.5 * weight * degrees * (1.0 / scale - more / heavy)
                    by_mean = weight * more * off / heavy
                    by_reading[0, row, c] += by_scale
                    by_reading[1, row, c] += by_mean
                    by_reading[2, row, c] += by_scale * (near_part + far_part)
                    by_constant[0] -= by_mean * turn
                    by_constant[1] -= by_mean * turn * excess / lengths[0]
                    by_constant[2] += 2.0 * by_scale * near_part
                    by_constant[3] += by_scale * near_part * excess / lengths[1]
                    by_constant[4] += 2.0 * by_scale * far_part
                    by_constant[5] += by_scale * far_part * excess / lengths[2]
                total += 0.5 * weight * (degrees * np.log(scales) - more * np.log(residuals))
    return total
