"""Compiled kernels of the tracker of peaks: motions of each target side by side, and what lies beside what.

Orders are handed in: Numba would compile a sort anew for each kind of array, which takes longer than all the rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._kernels import copy_row, copy_rows
from elusive._njit import njit
from elusive.contracts import Array

YOUNG, RESTS = 10, 0.01  # frames from which, and share of its energy up to which, a target may pass another by


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
def first_of(values: Array, least: float) -> int:
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

    ``by_x`` is the order of ``place`` along x. What has rested for long is passed by, and is no double of what moves.
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
        for at in range(first_of(across, place[i, 0] - farthest), len(by_x)):
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
            passed = age[j] >= YOUNG and velocity[j, 0] ** 2 + velocity[j, 1] ** 2 < RESTS * speed**2
            if (apart <= 1.0 and not passed) or faster <= 0.5 + 0.3 * speed:
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
        for at in range(first_of(first, sought[i, 0] - reach), len(first)):
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


@njit(cache=True, nogil=True, error_model="numpy")
def fit_affine(
    at: Array, to: Array, guess: Array, gate: float, cauchy: float, ridge: float, tight: float, near: float
) -> tuple[Array, Array, int, float]:
    """Fit an affine map from places ``at`` to places ``to``, ``(n, 2)``, with Cauchy weights by how far off a guess is.

    Deviations are from the median way of both axes (Rayleigh), ``tight`` at least.

    Returns
    -------
    tuple
        Shift ``(2,)`` and linear part ``(2, 2)`` beside the identity; how many are within ``near`` of it; Wald's
        statistic of the linear part.
    """
    n = len(at)
    centre, unit, error = np.zeros(2), 0.0, np.empty(n)
    for i in range(n):
        centre += at[i] / n
    for i in range(n):
        unit += ((at[i, 0] - centre[0]) ** 2 + (at[i, 1] - centre[1]) ** 2) / (2 * n)
        error[i] = np.sqrt((to[i, 0] - guess[i, 0]) ** 2 + (to[i, 1] - guess[i, 1]) ** 2)
    unit = max(np.sqrt(unit), 1.0)
    wide = cauchy * max(np.median(error) / 1.18, tight)
    # normal equations of one, x and y about the centre, and their right sides
    one, x, y, xx, xy, yy, right = ridge, 0.0, 0.0, ridge, 0.0, ridge, np.zeros((3, 2))
    for i in range(n):
        if not error[i] < gate:
            continue
        weight = 1 / (1 + (error[i] / wide) ** 2)
        u, v = (at[i, 0] - centre[0]) / unit, (at[i, 1] - centre[1]) / unit
        one, x, y = one + weight, x + weight * u, y + weight * v
        xx, xy, yy = xx + weight * u * u, xy + weight * u * v, yy + weight * v * v
        for a in range(2):
            way = weight * (to[i, a] - at[i, a])
            right[0, a] += way
            right[1, a] += u * way
            right[2, a] += v * way
    # without the shift: Schur's complement, which is the linear part's information, too
    xx, xy, yy = xx - x * x / one, xy - x * y / one, yy - y * y / one
    shift, linear, wald = np.empty(2), np.empty((2, 2)), 0.0
    for a in range(2):
        r, s = right[1, a] - x * right[0, a] / one, right[2, a] - y * right[0, a] / one
        b, c = (yy * r - xy * s) / (xx * yy - xy * xy), (xx * s - xy * r) / (xx * yy - xy * xy)
        wald += xx * b * b + 2 * xy * b * c + yy * c * c
        linear[0, a], linear[1, a] = b / unit, c / unit
        shift[a] = (right[0, a] - x * b - y * c) / one - centre[0] * linear[0, a] - centre[1] * linear[1, a]
    fits = 0
    for i in range(n):
        square = 0.0
        for a in range(2):
            square += (to[i, a] - at[i, a] - shift[a] - at[i, 0] * linear[0, a] - at[i, 1] * linear[1, a]) ** 2
        error[i] = np.sqrt(square)
        fits += error[i] < near
    return shift, linear, fits, wald / max(np.median(error) / 1.18, tight) ** 2
