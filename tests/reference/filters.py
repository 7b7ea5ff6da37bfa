"""Plain NumPy twins of the particle filters' steps: the same draws in the same order, nothing compiled."""

from __future__ import annotations

import numpy as np

from tests.reference.image import birth_map, log_ratio_by_patch
from tests.reference.motion import propagate_linear
from tests.reference.resampling import systematic


def moments(states, weights):
    """Weighted mean and covariance."""
    mean = weights @ states
    return mean, (weights[:, None] * (states - mean)).T @ (states - mean)


def newborns(birth, n, frame, sensor, names, rng, log_map=birth_map):
    """Cells from the mixture of preference and uniform, then a state in each; and log p_b / q_b."""
    preference = log_map(frame, sensor, sensor.intensity_of(birth.snr_db)).ravel()
    share = np.exp(preference - preference.max())
    mixture = (1 - birth.uniform_share) * share / share.sum() + birth.uniform_share / share.size
    cells = systematic(mixture, n, rng.random())
    low, high, *_ = birth._ranges(sensor, names)
    states = low + (high - low) * rng.random((len(low), n)).T
    states[:, 0] += cells % sensor.columns * sensor.dx
    states[:, 2] += cells // sensor.columns * sensor.dy
    return states, np.log(1 / (share.size * mixture[cells]))


def bernoulli_step(model, root, state, frame, rng, log_map=birth_map):
    """Step the Bernoulli filter of a linear motion by 1 s: (time, existence, particles, weights, mean, covariance).

    ``root`` is the lower-triangular root of Q.
    """
    time_s, existence, particles, weights = state[:4]
    chosen = systematic(weights, model.particles, rng.random())
    old = propagate_linear(particles[chosen], model.motion.F(1.0), root, rng)
    new, log_ratio = newborns(model.birth, model.newborns, frame, model.sensor, model.state_names, rng, log_map)
    sensor, p = model.sensor, model.sensor.truncation
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
