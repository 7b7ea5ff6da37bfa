"""Compiled kernels of the tracker of peaks: motions of each target side by side, and what peaks say of them.

Orders are handed in: Numba would compile a sort anew for each kind of array, which takes longer than all the rest.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elusive._kernels import copy_row, copy_rows
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
    before, share = np.empty(kinds), np.empty(kinds)
    for i in range(n):
        copy_rows(old_place, place[i])
        copy_rows(old_velocity, velocity[i])
        copy_rows(old_variance, variance[i])
        copy_row(before, weight[i])
        for k in range(kinds):
            total = 0.0
            for j in range(kinds):
                share[j] = before[j] * switch[j, k]
                total += share[j]
            weight[i, k] = total
            if total <= 0.0:
                continue
            x = y = along_x = along_y = own = cross = speed = 0.0
            starts = motions[k, 3] ** 2
            for j in range(kinds):
                share[j] /= total
                x += share[j] * old_place[j, 0]
                y += share[j] * old_place[j, 1]
                along_x += share[j] * old_velocity[j, 0]
                along_y += share[j] * old_velocity[j, 1]
                own += share[j] * old_variance[j, 0]
                cross += share[j] * old_variance[j, 1]
                speed += share[j] * (starts if motions[j, 3] == 0.0 else old_variance[j, 2])
            for j in range(kinds):
                if share[j] < 1e-9:
                    continue
                off_x, off_y = old_place[j, 0] - x, old_place[j, 1] - y
                faster_x, faster_y = old_velocity[j, 0] - along_x, old_velocity[j, 1] - along_y
                own += 0.5 * share[j] * (off_x * off_x + off_y * off_y)
                cross += 0.5 * share[j] * (off_x * faster_x + off_y * faster_y)
                speed += 0.5 * share[j] * (faster_x * faster_x + faster_y * faster_y)
            pushed = motions[k, 2]
            place[i, k, 0], place[i, k, 1] = x + frames * along_x, y + frames * along_y
            velocity[i, k, 0], velocity[i, k, 1] = along_x, along_y
            own += 2 * frames * cross + frames**2 * speed + pushed * frames**3 / 3 + motions[k, 1] ** 2 * frames
            variance[i, k, 0] = own
            variance[i, k, 1] = cross + frames * speed + pushed * frames**2 / 2
            variance[i, k, 2] = speed + pushed * frames


@njit(cache=True, nogil=True, error_model="numpy")
def crowding(places: Array, bright: NDArray[np.bool_], radius: float) -> Array:
    """Count, for each peak, those at least as strong of its polarity within a radius; the strongest stand first."""
    found = np.zeros(len(places))
    across, along = places[:, 0].copy(), places[:, 1].copy()
    for i in range(len(places)):
        near = 0
        for j in range(i):
            x, y = across[i] - across[j], along[i] - along[j]
            near += (bright[i] == bright[j]) & (x * x + y * y <= radius * radius)
        found[i] = near
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


@njit(cache=True, nogil=True)
def _doubled(rows: Array) -> Array:
    """Return an array of twice as many rows, of which the second half is not set."""
    more = np.empty((2 * len(rows), rows.shape[1]))
    copy_rows(more, rows)
    return more


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
    ratio, rough = np.empty((len(target), kinds)), np.empty((len(target), kinds))
    pairs, widest = 0, 0.0
    for j in range(len(places)):
        widest = max(widest, spread[j])
    rarity = detected * np.exp(-log_clutter)
    across, along, looks = places[by_x, 0], places[by_x, 1], bright[by_x]
    inside = np.empty(len(places), np.int64)
    # of each motion of a target: variance of a peak's place without its own, and what is uneven of the way
    sure, more = np.empty(kinds), np.empty(kinds)
    for i in range(n):
        left = low = np.inf
        right = high = -np.inf
        for k in range(kinds):
            speed = velocity[i, k, 0] ** 2 + velocity[i, k, 1] ** 2
            sure[k] = variance[i, k, 0] + motions[k, 0] ** 2
            more[k] = motions[k, 4] ** 2 * speed + motions[k, 5] ** 2
            reach = np.sqrt(GATE * (sure[k] + widest + more[k]))
            left, right = min(left, place[i, k, 0] - reach), max(right, place[i, k, 0] + reach)
            low, high = min(low, place[i, k, 1] - reach), max(high, place[i, k, 1] + reach)
        found = 0
        for at in range(_first(across, left), len(places)):
            if across[at] > right:
                break
            # without a branch, which would be foreseen wrongly too often
            inside[found] = by_x[at]
            found += (looks[at] == polarity[i]) & (low <= along[at]) & (along[at] <= high)
        for last in range(1, found):
            to, j = last, inside[last]
            while to > 0 and inside[to - 1] > j:
                inside[to] = inside[to - 1]
                to -= 1
            inside[to] = j
        for j in inside[:found]:
            if pairs == len(target):
                target, peak = np.concatenate((target, target)), np.concatenate((peak, peak))
                ratio, rough = _doubled(ratio), _doubled(rough)
            near = False
            for k in range(kinds):
                x, y = places[j, 0] - place[i, k, 0], places[j, 1] - place[i, k, 1]
                far = x * x + y * y
                own = sure[k] + spread[j]
                wide = own + more[k]
                if far > GATE * wide:
                    ratio[pairs, k] = rough[pairs, k] = 0.0
                    continue
                share = 0.0
                density = np.exp(-0.5 * far / own) / (2 * np.pi * own)
                if motions[k, 4] + motions[k, 5] > 0.0:
                    other = uneven * np.exp(-0.5 * far / wide) / (2 * np.pi * wide)
                    density = (1 - uneven) * density + other
                    share = other / density
                ratio[pairs, k], rough[pairs, k] = density, share
                near = True
            if not near:
                continue
            target[pairs], peak[pairs] = i, j
            change = (levels[j] - level[i]) / level_spread
            alike = (1 + change * change / HEAVY) ** -2 / (2.2 * level_spread)
            factor = alike * rarity[j]
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
    moved, faster = np.empty(2), np.empty(2)
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
            speed = velocity[i, k, 0] ** 2 + velocity[i, k, 1] ** 2
            wide = before + motions[k, 4] ** 2 * speed + motions[k, 5] ** 2
            moved[:] = 0.0
            faster[:] = 0.0
            shrink = shrink_cross = second = second_cross = second_speed = 0.0
            for e in range(start, end):
                # most peaks are in reach of the fastest motions alone
                if ratio[e, k] == 0.0:
                    continue
                part = message[e] * ratio[e, k] / likelihood[i, k]
                j = peak[e]
                noise = spread[j] + motions[k, 0] ** 2
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
