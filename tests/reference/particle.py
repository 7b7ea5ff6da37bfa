"""Plain NumPy twins of the SIR particle filter: its weights, its whole step, its MAP."""

from __future__ import annotations

import numpy as np
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from tests.reference.filters import moments
from tests.reference.motion import keyed_noise, propagate_linear
from tests.reference.resampling import systematic_by_repeat


def reweigh(weights, seen, chart, least):
    """Weights, log p(measurement | map), P(allowed) and whether the map was left out, in logarithms throughout."""
    with np.errstate(divide="ignore"):
        log_weights = np.log(weights)
    prior_and_map = logsumexp(log_weights + chart) if len(chart) else 0.0
    posterior = log_weights + seen if len(seen) else log_weights
    free = logsumexp(posterior)
    allowed = float(np.exp(prior_and_map))
    if free == -np.inf:
        return weights, free, allowed, allowed <= least
    if not len(chart):
        return np.exp(posterior - free), free, allowed, False
    joint = logsumexp(posterior + chart)
    if np.exp(joint - free) <= least:
        return np.exp(posterior - free), free, allowed, True
    return np.exp(posterior + chart - joint), joint - prior_and_map, allowed, False


def map_index(after, score, before, weights, motion):
    """Index of the particle of greatest posterior density: every candidate, every parent, densities by SciPy."""
    prediction = [
        logsumexp(
            multivariate_normal(np.zeros(len(state)), motion.Q(1.0)).logpdf(state - before @ motion.F(1.0).T), b=weights
        )
        for state in after
    ]
    return int(np.argmax(score + prediction))


def plot_log_likelihood(sensor, states, plot):
    """Log density of one plot, the field of view having no border: what one would write in NumPy."""
    x, vx, y, vy = states.T[:4]
    distance = np.hypot(x, y)
    angle = plot.bearing_rad - np.arctan2(x, y)
    angle -= 2 * np.pi * np.round(angle / (2 * np.pi))
    rate = (x * vx + y * vy) / distance
    errors = (plot.range_m - distance, sensor.range_sd_m), (angle, sensor.bearing_sd_mrad / 1000)
    errors = (*errors, (plot.doppler_mps - rate, sensor.doppler_sd_mps))
    return sum(-0.5 * (error / sd) ** 2 - np.log(np.sqrt(2 * np.pi) * sd) for error, sd in errors)


def step(model, root, state, plot, rng, noise=keyed_noise):
    """Step by 1 s to one plot: (time, particles, weights, mean, covariance, log evidence, allowed).

    ``root`` is the lower-triangular root of Q; the draws are those of the filter, in its order.
    """
    time_s, particles, weights = state[:3]
    if 1 / (weights @ weights) < model.resample_below * len(weights):
        particles = particles[systematic_by_repeat(weights, len(weights), rng.random())]
        weights = np.full(len(weights), 1 / len(weights))
    particles = propagate_linear(particles, model.motion.F(1.0), root, rng, noise)
    allowed, log_ratio = 1.0, plot_log_likelihood(model.sensor, particles, plot)
    for member in model.knowledge:
        chart = member.log_probability(particles)
        allowed = weights @ np.exp(chart)
        log_ratio = log_ratio + chart
    best = log_ratio.max()
    weights = weights * np.exp(log_ratio - best)
    total = weights.sum()
    weights = weights / total
    return (time_s + 1, particles, weights, *moments(particles, weights), best + np.log(total / allowed), allowed)


def selection(states, weights, F, mean, precision):
    """Log weight of each state for a proposal, but for a constant."""
    off = mean - states @ F.T
    return np.log(weights) - 0.5 * np.einsum("ni,ij,nj->n", off, precision, off)


def corrected(moved, seen, mean, root, precision, gain, noise):
    """Predictions corrected by draws of what is measured, and the log density of that there, but for a constant."""
    moved = moved.copy()
    moved[-len(noise) :] += (mean + noise @ root.T - moved[-len(noise) :][:, seen]) @ gain
    off = mean - moved[:, seen]
    return moved, -0.5 * np.einsum("ni,ij,nj->n", off, precision, off)


def effective_size(log_weights):
    """Effective number of particles."""
    weights = np.exp(log_weights - logsumexp(log_weights))
    return 1 / (weights @ weights)
