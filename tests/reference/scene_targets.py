"""Slow twins of the kernels that follow peaks: one target, one motion, one peak at a time, with full matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def joint(variance: Array) -> Array:
    """Return the covariance (2, 2) of place and velocity on an axis."""
    return np.array([[variance[0], variance[1]], [variance[1], variance[2]]])


def predicted(
    places: Array, velocities: Array, variances: Array, weights: Array, motions: Array, switch: Array, frames: float
) -> tuple[Array, Array, Array, Array]:
    """Mix the motions of one target, (M, ...) each, and carry each of them on: Blom and Bar-Shalom (1988)."""
    kinds = len(weights)
    after = weights @ switch
    moved = [np.empty_like(values) for values in (places, velocities, variances)]
    for k in range(kinds):
        share = weights * switch[:, k] / after[k]
        states = np.stack([places, velocities], axis=1)  # (M, 2, axes)
        mean = np.einsum("j,jca->ca", share, states)
        spread = np.zeros((2, 2))
        for j in range(kinds):
            own = joint(variances[j])
            if motions[j, 3] == 0:
                own[1, 1] = motions[k, 3] ** 2
            off = states[j] - mean
            spread += share[j] * (own + off @ off.T / 2)
        flow = np.array([[1.0, frames], [0.0, 1.0]])
        noise = motions[k, 2] * np.array([[frames**3 / 3, frames**2 / 2], [frames**2 / 2, frames]])
        spread = flow @ spread @ flow.T + noise
        spread[0, 0] += motions[k, 1] ** 2 * frames
        mean = flow @ mean
        moved[0][k], moved[1][k] = mean
        moved[2][k] = spread[0, 0], spread[0, 1], spread[1, 1]
    return moved[0], moved[1], moved[2], after


def normal(off: Array, variance: float) -> float:
    """Density of an isotropic normal distribution in the plane."""
    return float(np.exp(-0.5 * off @ off / variance) / (2 * np.pi * variance))


def ratio(
    place: Array, velocity: Array, variance: Array, motion: Array, uneven: float, peak: Array, spread: float
) -> tuple[float, float]:
    """Density of a peak's place in one motion, and how much of it is of uneven ways; 0 out of reach."""
    own = variance[0] + motion[0] ** 2 + spread
    wide = own + motion[4] ** 2 * velocity @ velocity + motion[5] ** 2
    off = peak - place
    if off @ off > 16 * wide:
        return 0.0, 0.0
    if motion[4] + motion[5] == 0:
        return normal(off, own), 0.0
    rough = uneven * normal(off, wide)
    density = (1 - uneven) * normal(off, own) + rough
    return density, rough / density


def absorbed(
    place: Array, velocity: Array, variance: Array, motion: Array, peaks: Array, spread: Array, ratios: Array,
    rough: Array, missed: float,
) -> tuple[Array, Array, Array, float]:  # fmt: skip
    """Update one motion of one target by peaks that it may have made: a mixture of Kalman updates, moment-matched.

    ``ratios`` of each peak are weights against ``missed``; the last value is their sum.
    """
    likelihood = missed + ratios.sum()
    parts = [(missed / likelihood, np.stack([place, velocity]), joint(variance))]
    for peak, noise, weight, share in zip(peaks, spread, ratios, rough, strict=True):
        before = joint(variance)
        innovation = variance[0] + noise + motion[0] ** 2
        wide = variance[0] + motion[4] ** 2 * velocity @ velocity + motion[5] ** 2
        gain = (1 - share) * before[:, 0] / innovation
        gain += share * np.array([wide, variance[1]]) / (wide + noise + motion[0] ** 2)
        mean = np.stack([place, velocity]) + np.outer(gain, peak - place)
        after = before - np.outer(gain, before[0])
        parts.append((weight / likelihood, mean, after))
    mean = np.sum([weight * state for weight, state, _ in parts], axis=0)
    total = np.zeros((2, 2))
    for weight, state, spread_after in parts:
        off = state - mean
        total += weight * (spread_after + off @ off.T / 2)
    return mean[0], mean[1], np.array([total[0, 0], total[0, 1], total[1, 1]]), float(likelihood)


def crowd(places: Array, bright: Array, radius: float) -> list[int]:
    """Count the stronger peaks of its polarity about each; the strongest stand first."""
    return [
        sum(bool(bright[j] == bright[i]) and float(np.hypot(*(places[i] - places[j]))) <= radius for j in range(i))
        for i in range(len(places))
    ]


def undoubled(
    place: Array, velocity: Array, scale: Array, bright: Array, age: Array, rank: Array, kept: Array
) -> list[bool]:
    """Say which targets are left when doubles of those of higher rank are taken out."""
    left = list(kept)
    order = np.argsort(-rank)
    for a, i in enumerate(order):
        for j in order[a + 1 :]:
            apart = np.hypot(*(place[i] - place[j]))
            faster = np.hypot(*(velocity[i] - velocity[j]))
            passed = age[j] >= 10 and np.hypot(*velocity[j]) < 0.1 * np.hypot(*velocity[i])
            alike = (apart <= 1 and not passed) or faster <= 0.5 + 0.3 * np.hypot(*velocity[i])
            near = apart <= 0.5 + 0.8 * max(scale[i], scale[j])
            if left[i] and left[j] and bright[i] == bright[j] and age[i] + age[j] > 0 and near and alike:
                left[j] = False
    return left


def mixed(place: Array, velocity: Array, variance: Array, weight: Array) -> tuple[Array, Array]:
    """Mean and covariance of x, vx, y, vy of one target's mixture of motions."""
    means = np.array([[p[0], v[0], p[1], v[1]] for p, v in zip(place, velocity, strict=True)])
    mean = weight @ means
    covariance = np.zeros((4, 4))
    for w, m, (pp, pv, vv) in zip(weight, means, variance, strict=True):
        covariance += w * (np.outer(m - mean, m - mean) + np.kron(np.eye(2), [[pp, pv], [pv, vv]]))
    return mean, covariance


def affine(at: Array, to: Array, guess: Array, gate: float) -> tuple[Array, Array, int, float]:
    """Fit a map from places to places by weighted least squares: shift, linear part, how many fit, Wald's statistic."""

    def deviation(error: Array) -> float:
        return max(float(np.median(error)) / 1.18, 0.15)

    centre = at.mean(axis=0)
    unit = max(float(np.std(at - centre)), 1.0)
    terms = np.column_stack([np.ones(len(at)), (at - centre) / unit])
    error = np.hypot(*(to - guess).T)
    weight = (error < gate) / (1 + (error / (2 * deviation(error))) ** 2)
    normal = (terms * weight[:, None]).T @ terms + 1e-6 * np.eye(3)
    found = np.linalg.solve(normal, (terms * weight[:, None]).T @ (to - at))
    error = np.hypot(*(to - at - terms @ found).T)
    spread = np.linalg.inv(normal)[1:, 1:] * deviation(error) ** 2
    wald = float(np.trace(found[1:].T @ np.linalg.inv(spread) @ found[1:]))
    linear = found[1:] / unit
    return found[0] - centre @ linear, linear, int((error < 1).sum()), wald


def recent(target: Array, peak: Array, share: Array, known: Array, new: Array, gain: float) -> tuple[Array, Array]:
    """Probability that each target has a peak; its looks, drawn towards the mean of the peaks that it may have."""
    hit, after = np.zeros(known.shape[1]), known.copy()
    for i in range(len(hit)):
        mine = target == i
        hit[i] = share[mine].sum()
        if hit[i] > 1e-6:
            after[:, i] += gain * hit[i] * (np.average(new[:, peak[mine]], axis=1, weights=share[mine]) - known[:, i])
    return hit, after


def ways(
    place: Array, weight: Array, latest: Array, offset: Array, origin: Array, lately: Array, usual: Array,
    strayed: Array,
) -> tuple[Array, ...]:  # fmt: skip
    """How far targets are from where they began and were lately; latest and usual places, and strays from these."""
    now = np.einsum("nm,nma->na", weight, place)
    far, hop = (np.hypot(*(now - before).T) for before in (origin, lately[:, 0]))
    off = np.stack([now, now + offset], axis=1) - usual
    latest = latest[:, None]
    strayed = (1 - latest) * (strayed + latest * np.einsum("nsa,nsa->ns", off, off))
    return far, hop, np.concatenate([lately[:, 1:], now[:, None]], axis=1), usual + latest[:, None] * off, strayed


def moving(
    evidence: Array, resting: Array, place: Array, origin: Array, leash: Array, farthest: Array, hop: Array, age: Array
) -> Array:
    """Log evidence of moving against all ways of resting, no more than its way lets it have."""
    away = place[:, : len(leash)] - origin[:, None]
    still = np.log(np.exp(resting - np.einsum("nra,nra->nr", away, away) * (0.5 / leash**2)).mean(axis=1))
    even = farthest * np.minimum(6 / np.maximum(age, 1), 1.0)
    way = farthest - np.clip(hop - even - leash.min(), 0.0, farthest)
    return np.minimum(evidence - np.maximum(still, 0.0), 0.5 * (way / leash.min()) ** 2)
