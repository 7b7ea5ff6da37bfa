"""Plain NumPy twins of the particle filters' steps: the same draws in the same order, nothing compiled."""

from __future__ import annotations

import numpy as np

from tests.reference.image import birth_map, log_ratio_by_patch
from tests.reference.random_numbers import normals, uniforms
from tests.reference.resampling import systematic


def moments(states, weights):
    """Weighted mean and covariance."""
    mean = weights @ states
    return mean, (weights[:, None] * (states - mean)).T @ (states - mean)


def newborns(birth, n, frame, sensor, names, draws, log_map=birth_map):
    """Cells from the mixture of preference and uniform, then a state in each; and log p_b / q_b."""
    preference = log_map(frame, sensor, sensor.intensity_of(birth.snr_db)).ravel()
    share = np.exp(preference - preference.max())
    mixture = (1 - birth.uniform_share) * share / share.sum() + birth.uniform_share / share.size
    cells = systematic(mixture, n, draws[0])
    low, high, deviation = birth.ranges(sensor, names).table
    states = low + (high - low) * uniforms(draws[1], n * len(low)).reshape(-1, n).T
    if deviation.any():
        states += deviation * normals(draws[2], n * len(low)).reshape(-1, n).T
    states[:, 0] += cells % sensor.columns * sensor.dx
    states[:, 2] += cells // sensor.columns * sensor.dy
    return states, np.log(1 / (share.size * mixture[cells]))


def lower_root(covariance):
    """Cholesky's root, row by row; what is left of a variance below 1e-8 of it is nothing."""
    root = np.zeros_like(covariance)
    for k, row in enumerate(covariance):
        for c in range(k):
            root[k, c] = (row[c] - root[k, :c] @ root[c, :c]) / root[c, c] if root[c, c] else 0.0
        left = row[k] - root[k, :k] @ root[k, :k]
        root[k, k] = np.sqrt(left) if left > 1e-8 * row[k] else 0.0
    return root


def predicted(states, weights, n, side, F, root, draws):
    """Survivors moved on, smoothed cell by cell of that side; 0: moved alone."""
    d = states.shape[1]
    cell = np.floor(states[:, [2, 0]] / side) if side else np.zeros((len(states), 2))
    cell -= cell[weights > 0].min(axis=0)
    place = (cell[:, 0] * (cell[:, 1].max() + 1) + cell[:, 1]).astype(int)
    order = np.argsort(place, kind="stable")
    order = order[weights[order] > 0]
    states, weights, place = states[order], weights[order], place[order]
    chosen = systematic(weights, n, draws[0])
    noise = normals(draws[1], n * d).reshape(d, n).T
    moved = states[chosen] @ F.T + noise @ root.T
    where, counts = np.unique(place[chosen], return_counts=True)
    for corner in where[counts >= 8] if side else ():
        members = place == corner
        children = members[chosen]
        share = weights[members] / weights[members].sum()
        effective = 1 / (share**2).sum()
        if effective < 1.5:
            continue
        mean, covariance = moments(states[members], share)
        bandwidth = (4 / ((d + 2) * effective)) ** (1 / (d + 4))
        kept = mean + np.sqrt(1 - bandwidth**2) * (states[chosen][children] - mean)
        spread = (bandwidth**2 + 1 / (effective - 1)) * F @ covariance @ F.T + root @ root.T
        moved[children] = kept @ F.T + noise[children] @ lower_root(spread).T
    return moved


def bernoulli_step(model, root, state, frame, rng, log_map=birth_map):
    """Step the Bernoulli filter of a linear motion by 1 s: (time, existence, particles, weights, mean, covariance).

    ``root`` is the lower-triangular root of Q.
    """
    time_s, existence, particles, weights = state[:4]
    draws, sensor, p = rng.random(5), model.sensor, model.sensor.patch_cells
    side = 3 * sensor.psf_sigma if model.spread_within is None else model.spread_within
    old = predicted(particles, weights, model.particles, side, model.motion.F(1.0), root, draws)
    new, log_ratio = newborns(model.birth, model.newborns, frame, sensor, model.state_names, draws[2:], log_map)
    x, y = old[:, 0] / sensor.dx, old[:, 2] / sensor.dy
    stays = (x >= -p) & (x <= sensor.columns - 1 + p) & (y >= -p) & (y <= sensor.rows - 1 + p)
    survive, appear = (1 - model.death_probability) * existence, model.birth_probability * (1 - existence)
    mass = np.concatenate([survive * stays / model.particles, appear * np.exp(log_ratio) / model.newborns])
    states = np.concatenate([old, new])
    mass *= np.exp(log_ratio_by_patch(states, frame, sensor))
    present, absent = mass.sum(), 1 - survive - appear + survive * (1 - stays.mean())
    weights = mass / present
    return (time_s + 1, present / (present + absent), states, weights, *moments(states, weights))


def transition(present, birth_probability, death_probability, rng):
    """Existence of each particle one step later: the two-state Markov chain."""
    u = rng.random(len(present))
    later = np.empty(len(present), dtype=bool)
    for i, here in enumerate(present):
        later[i] = (u[i] >= death_probability) if here else (u[i] < birth_probability)
    return later


def existence_update(present, particles, ratio):
    """Existence, mean and covariance of equal-weight particles of which the present ones see ``ratio``."""
    total, inside = 0.0, 0.0
    mean, second = np.zeros(particles.shape[1]), np.zeros((particles.shape[1],) * 2)
    for here, state, likelihood in zip(present, particles, ratio, strict=True):
        total += likelihood if here else 1.0
        if here:
            inside += likelihood
            mean += likelihood * state
            second += likelihood * np.outer(state, state)
    mean /= inside
    return inside / total, mean, second / inside - np.outer(mean, mean)
