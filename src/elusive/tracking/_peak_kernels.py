"""Compiled kernels of the tracker of peaks: motions of each target side by side, and what peaks say of them.

Orders are handed in: Numba would compile a sort anew for each kind of array, which takes longer than all the rest.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elusive._kernels import copy_rows
from elusive.contracts import Array

GATE = 16.0  # squared deviations within which a peak may be a target's
HEAVY = 3.0  # degrees of freedom of a level's change


@njit(cache=True, nogil=True, error_model="numpy")
def predict(
    place: Array, velocity: Array, variance: Array, weight: Array, motions: Array, switch: Array, frames: float
) -> None:
    """Carry targets on by some frames, in place: Blom and Bar-Shalom (1988), an interacting mixture of motions.

    ``place`` and ``velocity`` are ``(n, M, 2)``, ``variance`` ``(n, M, 3)`` of an axis (place, place and velocity,
    velocity), ``weight`` ``(n, M)``. ``motions`` ``(M, 5)``: jitter, walk, acceleration, starting speed, unevenness.
    """
    n, kinds = weight.shape
    old_place, old_velocity, old_variance = np.empty((kinds, 2)), np.empty((kinds, 2)), np.empty((kinds, 3))
    share = np.empty(kinds)
    for i in range(n):
        copy_rows(old_place, place[i])
        copy_rows(old_velocity, velocity[i])
        copy_rows(old_variance, variance[i])
        before = weight[i].copy()
        for k in range(kinds):
            total = 0.0
            for j in range(kinds):
                share[j] = before[j] * switch[j, k]
                total += share[j]
            weight[i, k] = total
            if total <= 0.0:
                continue
            for c in range(3):
                variance[i, k, c] = 0.0
            for a in range(2):
                place[i, k, a] = 0.0
                velocity[i, k, a] = 0.0
            starts = motions[k, 3] ** 2
            for j in range(kinds):
                share[j] /= total
                rests = motions[j, 3] == 0.0
                for a in range(2):
                    place[i, k, a] += share[j] * old_place[j, a]
                    velocity[i, k, a] += share[j] * old_velocity[j, a]
                variance[i, k, 0] += share[j] * old_variance[j, 0]
                variance[i, k, 1] += share[j] * old_variance[j, 1]
                variance[i, k, 2] += share[j] * (starts if rests else old_variance[j, 2])
            for j in range(kinds):
                if share[j] < 1e-9:
                    continue
                for a in range(2):
                    off = old_place[j, a] - place[i, k, a]
                    faster = old_velocity[j, a] - velocity[i, k, a]
                    variance[i, k, 0] += 0.5 * share[j] * off * off
                    variance[i, k, 1] += 0.5 * share[j] * off * faster
                    variance[i, k, 2] += 0.5 * share[j] * faster * faster
            for a in range(2):
                place[i, k, a] += frames * velocity[i, k, a]
            pushed = motions[k, 2]
            variance[i, k, 0] += (
                2 * frames * variance[i, k, 1]
                + frames**2 * variance[i, k, 2]
                + pushed * frames**3 / 3
                + motions[k, 1] ** 2 * frames
            )
            variance[i, k, 1] += frames * variance[i, k, 2] + pushed * frames**2 / 2
            variance[i, k, 2] += pushed * frames


@njit(cache=True, nogil=True, error_model="numpy")
def crowding(places: Array, bright: NDArray[np.bool_], radius: float) -> Array:
    """Count, for each peak, those at least as strong of its polarity within a radius; the strongest stand first."""
    found = np.zeros(len(places))
    for i in range(len(places)):
        for j in range(i):
            if bright[i] == bright[j]:
                x, y = places[i, 0] - places[j, 0], places[i, 1] - places[j, 1]
                if x * x + y * y <= radius * radius:
                    found[i] += 1.0
    return found


@njit(cache=True, nogil=True)
def _first(values: Array, least: float) -> int:
    """Return the place of the first of increasing values that is not below a bound."""
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if values[middle] < least:
            low = middle + 1
        else:
            high = middle
    return low


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
    by_x: NDArray[np.int64],
    spread: Array,
    levels: Array,
    bright: NDArray[np.bool_],
    log_clutter: Array,
    level_spread: float,
    detected: float,
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array]:
    """Likelihood ratio of each peak in reach of each target against clutter, by motion.

    ``by_x`` is the order of the peaks' ``places``.

    Returns the pairs' targets and peaks, ``(E, M)`` ratios, and ``(E,)`` how much of the last motion's is uneven.
    """
    n, kinds = weight.shape
    target, peak = np.empty(4 * n + 16, np.int64), np.empty(4 * n + 16, np.int64)
    ratio, rough = np.zeros((len(target), kinds)), np.zeros((len(target), kinds))
    pairs, widest = 0, 0.0
    for j in range(len(places)):
        widest = max(widest, spread[j])
    across, inside = places[by_x, 0], np.empty(len(places), np.int64)
    box = np.empty((2, 2))
    for i in range(n):
        box[0], box[1] = np.inf, -np.inf
        for k in range(kinds):
            speed = velocity[i, k, 0] ** 2 + velocity[i, k, 1] ** 2
            reach = variance[i, k, 0] + motions[k, 0] ** 2 + widest + motions[k, 4] ** 2 * speed + motions[k, 5] ** 2
            reach = np.sqrt(GATE * reach)
            for a in range(2):
                box[0, a] = min(box[0, a], place[i, k, a] - reach)
                box[1, a] = max(box[1, a], place[i, k, a] + reach)
        found = 0
        for at in range(_first(across, box[0, 0]), len(places)):
            if across[at] > box[1, 0]:
                break
            j = by_x[at]
            if bright[j] == polarity[i] and box[0, 1] <= places[j, 1] <= box[1, 1]:
                to = found
                while to > 0 and inside[to - 1] > j:
                    inside[to] = inside[to - 1]
                    to -= 1
                inside[to] = j
                found += 1
        for j in inside[:found]:
            if pairs == len(target):
                target, peak = np.concatenate((target, target)), np.concatenate((peak, peak))
                nothing = np.zeros_like(ratio)
                ratio, rough = np.concatenate((ratio, nothing)), np.concatenate((rough, nothing))
            near = False
            for k in range(kinds):
                x, y = places[j, 0] - place[i, k, 0], places[j, 1] - place[i, k, 1]
                far = x * x + y * y
                own = variance[i, k, 0] + motions[k, 0] ** 2 + spread[j]
                speed = velocity[i, k, 0] ** 2 + velocity[i, k, 1] ** 2
                wide = own + motions[k, 4] ** 2 * speed + motions[k, 5] ** 2
                if far > GATE * wide:
                    continue
                density = np.exp(-0.5 * far / own) / (2 * np.pi * own)
                if motions[k, 4] + motions[k, 5] > 0.0:
                    other = uneven * np.exp(-0.5 * far / wide) / (2 * np.pi * wide)
                    density = (1 - uneven) * density + other
                    rough[pairs, k] = other / density
                ratio[pairs, k] = density
                near = True
            if not near:
                continue
            target[pairs], peak[pairs] = i, j
            change = (levels[j] - level[i]) / level_spread
            alike = (1 + change * change / HEAVY) ** -2 / (2.2 * level_spread)
            factor = detected * alike * np.exp(-log_clutter[j])
            for k in range(kinds):
                ratio[pairs, k] *= factor
            pairs += 1
    return target[:pairs], peak[:pairs], ratio[:pairs], rough[:pairs]


@njit(cache=True, nogil=True, error_model="numpy")
def absorb(
    place: Array,
    velocity: Array,
    variance: Array,
    weight: Array,
    motions: Array,
    target: NDArray[np.int64],
    peak: NDArray[np.int64],
    ratio: Array,
    rough: Array,
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
    likelihood = np.empty((n, kinds))
    start = 0
    for i in range(n):
        end = start
        while end < len(target) and target[end] == i:
            end += 1
        for k in range(kinds):
            likelihood[i, k] = 1.0 - seen[i]
            for e in range(start, end):
                likelihood[i, k] += message[e] * ratio[e, k]
            before, cross = variance[i, k, 0], variance[i, k, 1]
            moved, faster = np.zeros(2), np.zeros(2)
            shrink = shrink_cross = second = second_cross = second_speed = 0.0
            for e in range(start, end):
                part = message[e] * ratio[e, k] / likelihood[i, k]
                j = peak[e]
                noise = spread[j] + motions[k, 0] ** 2
                speed = velocity[i, k, 0] ** 2 + velocity[i, k, 1] ** 2
                wide = before + motions[k, 4] ** 2 * speed + motions[k, 5] ** 2
                gain = (1 - rough[e, k]) * before / (before + noise) + rough[e, k] * wide / (wide + noise)
                pull = cross * ((1 - rough[e, k]) / (before + noise) + rough[e, k] / (wide + noise))
                shrink += part * gain
                shrink_cross += part * pull
                squared = 0.0
                for a in range(2):
                    off = places[j, a] - place[i, k, a]
                    moved[a] += part * gain * off
                    faster[a] += part * pull * off
                    squared += 0.5 * off * off
                second += part * gain * gain * squared
                second_cross += part * gain * pull * squared
                second_speed += part * pull * pull * squared
            for a in range(2):
                second -= 0.5 * moved[a] * moved[a]
                second_cross -= 0.5 * moved[a] * faster[a]
                second_speed -= 0.5 * faster[a] * faster[a]
                place[i, k, a] += moved[a]
                velocity[i, k, a] += faster[a]
            variance[i, k, 2] = max(variance[i, k, 2] - shrink_cross * cross + max(second_speed, 0.0), 0.0)
            variance[i, k, 1] = (1 - shrink) * cross + second_cross
            variance[i, k, 0] = max((1 - shrink) * before + max(second, 0.0), 1e-4)
        total = 0.0
        for k in range(kinds):
            weight[i, k] = max(weight[i, k] * likelihood[i, k], 1e-300)
            total += weight[i, k]
        for k in range(kinds):
            weight[i, k] /= total
        start = end
    return likelihood


@njit(cache=True, nogil=True, error_model="numpy")
def leave_doubles(
    order: NDArray[np.int64],
    by_x: NDArray[np.int64],
    place: Array,
    velocity: Array,
    scale: Array,
    bright: NDArray[np.bool_],
    age: NDArray[np.int64],
    kept: NDArray[np.bool_],
) -> None:
    """Take out of ``kept``, in place, what follows the same object as a target of higher rank: earlier in ``order``.

    ``by_x`` is the order of ``place`` along x.
    """
    across, later = place[by_x, 0], np.empty(len(order), np.int64)
    widest = 0.0
    for a in range(len(order)):
        later[order[a]] = a
        widest = max(widest, scale[a])
    for i in order:
        if not kept[i]:
            continue
        speed = np.sqrt(velocity[i, 0] ** 2 + velocity[i, 1] ** 2)
        farthest = 0.5 + 0.8 * widest
        for at in range(_first(across, place[i, 0] - farthest), len(by_x)):
            j = by_x[at]
            if across[at] > place[i, 0] + farthest:
                break
            if later[j] <= later[i] or not kept[j] or bright[i] != bright[j] or age[i] + age[j] == 0:
                continue
            reach = 0.5 + 0.8 * max(scale[i], scale[j])
            apart = np.sqrt((place[i, 0] - place[j, 0]) ** 2 + (place[i, 1] - place[j, 1]) ** 2)
            if apart > reach:
                continue
            faster = np.sqrt((velocity[i, 0] - velocity[j, 0]) ** 2 + (velocity[i, 1] - velocity[j, 1]) ** 2)
            if apart <= 1.0 or faster <= 0.5 + 0.3 * speed:
                kept[j] = False


@njit(cache=True, nogil=True, error_model="numpy")
def nearest(known: Array, order: NDArray[np.int64], sought: Array, reach: float) -> tuple[Array, NDArray[np.int64]]:
    """Return how far off the nearest known point of each sought one is, ``(n,)``, and which; inf, -1 beyond a reach.

    ``known`` ``(m, d)``, ``sought`` ``(n, d)``; ``order`` is that of the known along the first axis, along which they
    are spread.
    """
    first = known[order, 0]
    apart, which = np.full(len(sought), np.inf), np.full(len(sought), -1)
    for i in range(len(sought)):
        least = reach * reach
        for at in range(_first(first, sought[i, 0] - reach), len(first)):
            j = order[at]
            if first[at] > sought[i, 0] + reach:
                break
            square = 0.0
            for a in range(known.shape[1]):
                square += (known[j, a] - sought[i, a]) ** 2
            if square < least:
                least, apart[i], which[i] = square, np.sqrt(square), j
    return apart, which


@njit(cache=True, nogil=True, error_model="numpy")
def moments(place: Array, velocity: Array, variance: Array, weight: Array) -> tuple[Array, Array]:
    """Mean ``(n, 4)`` of x, vx, y, vy and covariance ``(n, 4, 4)`` of a mixture of motions, see :func:`predict`."""
    n, kinds = weight.shape
    mean, covariance = np.zeros((n, 4)), np.zeros((n, 4, 4))
    off = np.empty(4)
    for i in range(n):
        for k in range(kinds):
            for a in range(2):
                mean[i, 2 * a] += weight[i, k] * place[i, k, a]
                mean[i, 2 * a + 1] += weight[i, k] * velocity[i, k, a]
        for k in range(kinds):
            for a in range(2):
                off[2 * a] = place[i, k, a] - mean[i, 2 * a]
                off[2 * a + 1] = velocity[i, k, a] - mean[i, 2 * a + 1]
                for b in range(2):
                    for c in range(2):
                        covariance[i, 2 * a + b, 2 * a + c] += weight[i, k] * variance[i, k, b + c]
            for a in range(4):
                for b in range(4):
                    covariance[i, a, b] += weight[i, k] * off[a] * off[b]
    return mean, covariance
