"""Compiled kernels of the tracker of peaks: which peaks each target may have made, in which motion, and what they say.

Most peaks are in reach of the fastest motions alone, so that what is kept is a list of entries: a pair of a target and
a peak in its reach has one for each motion that reaches so far, pair by pair.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array
from elusive.tracking._peak_kernels import first_of

GATE = 16.0  # squared deviations within which a peak may be a target's
HEAVY = 3.0  # degrees of freedom of a level's change
STUDENT = math.pi * math.sqrt(HEAVY) / 2  # area under Student's law of three degrees of freedom whose peak is one

Index = NDArray[np.int64]


class Pairs(NamedTuple):
    """E targets and peaks in their reach, the targets in order, and Z entries of pair and motion, in order of pairs."""

    target: Index  # (E,)
    peak: Index  # (E,)
    likely: Array  # (E,) likelihood ratio of the peak against clutter, over the target's motions
    begins: Index  # (E + 1,) each pair's first entry
    motion: Index  # (Z,)
    ratio: Array  # (Z,) likelihood ratio in the motion
    rough: Array  # (Z,) how much of it is of uneven ways


@njit(cache=True, nogil=True, error_model="numpy")
def explain(
    place: Array,
    velocity: Array,
    variance: Array,
    weight: Array,
    level: Array,
    polarity: NDArray[np.bool_],
    motions: Array,
    uneven: float,
    places: Array,
    by_x: Index,
    spread: Array,
    levels: Array,
    bright: NDArray[np.bool_],
    log_clutter: Array,
    level_spread: Array,
    detected: float,
) -> Pairs:
    """Likelihood ratio of each peak in reach of each target against clutter, by motion.

    ``by_x`` is the order of the peaks' ``places``, in which those of a target come.
    """
    n, kinds = weight.shape
    target, peak, begins = (
        np.empty(8 * n + 16, np.int64),
        np.empty(8 * n + 16, np.int64),
        np.empty(8 * n + 17, np.int64),
    )
    likely, motion = np.empty(len(target)), np.empty(2 * len(target) + kinds, np.int64)
    ratio, rough = np.empty(len(motion)), np.empty(len(motion))
    across, along, widths, looks = places[by_x, 0], places[by_x, 1], spread[by_x], bright[by_x]
    widest = widths.max() if len(widths) else 0.0
    rarity = detected / STUDENT * np.exp(-log_clutter[by_x])
    inside = np.empty(len(places), np.int64)
    # of each motion of a target: its place, variance of a peak's without its own, what is uneven of the way, reach
    x, y, sure, more, reach = np.empty(kinds), np.empty(kinds), np.empty(kinds), np.empty(kinds), np.empty(kinds)
    far, met = np.empty(kinds), np.empty(kinds, np.int64)
    pairs = entries = 0
    for i in range(n):
        left = low = np.inf
        right = high = -np.inf
        for k in range(kinds):
            x[k], y[k] = place[i, k, 0], place[i, k, 1]
            speed = velocity[i, k, 0] ** 2 + velocity[i, k, 1] ** 2
            sure[k] = variance[i, k, 0] + motions[k, 0] ** 2
            more[k] = motions[k, 4] ** 2 * speed + motions[k, 5] ** 2
            reach[k] = GATE * (sure[k] + more[k])
            most = np.sqrt(reach[k] + GATE * widest)
            left, right, low, high = (
                min(left, x[k] - most),
                max(right, x[k] + most),
                min(low, y[k] - most),
                max(high, y[k] + most),
            )
        found = 0
        for at in range(first_of(across, left), len(places)):
            if across[at] > right:
                break
            # without a branch, which would be foreseen wrongly too often
            inside[found] = at
            found += (looks[at] == polarity[i]) & (low <= along[at]) & (along[at] <= high)
        while pairs + found > len(target):
            target, peak = np.concatenate((target, target)), np.concatenate((peak, peak))
            likely, begins = np.concatenate((likely, likely)), np.concatenate((begins, begins))
        for at in inside[:found]:
            count, most = 0, GATE * widths[at]
            for k in range(kinds):
                off_x, off_y = across[at] - x[k], along[at] - y[k]
                far[k] = off_x * off_x + off_y * off_y
                met[count] = k
                count += far[k] <= reach[k] + most
            if not count:
                continue
            if entries + count > len(motion):
                motion = np.concatenate((motion, motion))
                ratio, rough = np.concatenate((ratio, ratio)), np.concatenate((rough, rough))
            target[pairs], peak[pairs], begins[pairs] = i, by_x[at], entries
            change = (levels[by_x[at]] - level[i]) / level_spread[i]
            tails = 1 + change * change / HEAVY
            factor = rarity[at] / (level_spread[i] * tails * tails)
            total = 0.0
            for k in met[:count]:
                own, part = sure[k] + widths[at], 0.0
                density = np.exp(-0.5 * far[k] / own) / (2 * np.pi * own)
                if motions[k, 4] + motions[k, 5] > 0.0:
                    wide = own + more[k]
                    other = uneven * np.exp(-0.5 * far[k] / wide) / (2 * np.pi * wide)
                    density = (1 - uneven) * density + other
                    part = other / density
                motion[entries], ratio[entries], rough[entries] = k, density * factor, part
                total += weight[i, k] * ratio[entries]
                entries += 1
            likely[pairs] = total
            pairs += 1
    begins[pairs] = entries
    return Pairs(
        target[:pairs], peak[:pairs], likely[:pairs], begins[: pairs + 1], motion[:entries], ratio[:entries],
        rough[:entries],
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def absorb(
    place: Array,
    velocity: Array,
    variance: Array,
    weight: Array,
    motions: Array,
    pairs: Pairs,
    message: Array,
    seen: Array,
    places: Array,
    spread: Array,
) -> Array:
    """Update targets in place by what they may have made: probabilistic data association in each motion.

    ``message`` ``(E,)`` is how far other targets leave a pair's peak to its target, ``seen`` ``(n,)`` the probability
    that a target is seen. Returns the likelihood of what was seen given each motion, ``(n, M)``.
    """
    n, kinds = weight.shape
    target, begins = pairs.target, pairs.begins
    likelihood, wide = np.empty((n, kinds)), np.empty(kinds)
    # of each motion: gains of place and velocity, way and change, and the three second moments
    sums = np.empty((kinds, 9))
    start = 0
    for i in range(n):
        end = start
        while end < len(target) and target[end] == i:
            end += 1
        likelihood[i] = 1.0 - seen[i]
        for e in range(start, end):
            for z in range(begins[e], begins[e + 1]):
                likelihood[i, pairs.motion[z]] += message[e] * pairs.ratio[z]
        for k in range(kinds):
            speed = velocity[i, k, 0] ** 2 + velocity[i, k, 1] ** 2
            wide[k] = variance[i, k, 0] + motions[k, 4] ** 2 * speed + motions[k, 5] ** 2
        sums[:] = 0.0
        for e in range(start, end):
            j = pairs.peak[e]
            for z in range(begins[e], begins[e + 1]):
                k, rough = pairs.motion[z], pairs.rough[z]
                part = message[e] * pairs.ratio[z] / likelihood[i, k]
                before, cross = variance[i, k, 0], variance[i, k, 1]
                noise = spread[j] + motions[k, 0] ** 2
                gain = (1 - rough) * before / (before + noise) + rough * wide[k] / (wide[k] + noise)
                pull = cross * ((1 - rough) / (before + noise) + rough / (wide[k] + noise))
                x, y = places[j, 0] - place[i, k, 0], places[j, 1] - place[i, k, 1]
                squared, total = 0.5 * (x * x + y * y), sums[k]
                total[0] += part * gain
                total[1] += part * pull
                total[2] += part * gain * x
                total[3] += part * gain * y
                total[4] += part * pull * x
                total[5] += part * pull * y
                total[6] += part * gain * gain * squared
                total[7] += part * gain * pull * squared
                total[8] += part * pull * pull * squared
        total_weight = 0.0
        for k in range(kinds):
            before, cross = variance[i, k, 0], variance[i, k, 1]
            shrink, shrink_cross, x, y, faster_x, faster_y, second, second_cross, second_speed = sums[k]
            second -= 0.5 * (x * x + y * y)
            second_cross -= 0.5 * (x * faster_x + y * faster_y)
            second_speed -= 0.5 * (faster_x * faster_x + faster_y * faster_y)
            place[i, k, 0] += x
            place[i, k, 1] += y
            velocity[i, k, 0] += faster_x
            velocity[i, k, 1] += faster_y
            variance[i, k, 2] = max(variance[i, k, 2] - shrink_cross * cross + max(second_speed, 0.0), 0.0)
            variance[i, k, 1] = (1 - shrink) * cross + second_cross
            variance[i, k, 0] = max((1 - shrink) * before + max(second, 0.0), 1e-4)
            weight[i, k] = max(weight[i, k] * likelihood[i, k], 1e-300)
            total_weight += weight[i, k]
        for k in range(kinds):
            weight[i, k] /= total_weight
        start = end
    return likelihood
