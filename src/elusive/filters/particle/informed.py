"""Particles drawn with the measurement in view, where the motion is linear with Gaussian noise.

Pitt and Shephard (1999), J. Am. Stat. Assoc. 94(446), 590-599 (auxiliary selection); Doucet, Godsill and Andrieu
(2000), Stat. Comput. 10, 197-208, section II.C (optimal proposals of a Gaussian likelihood). A Gaussian l is fitted to
what the likelihood says of the components that it depends on. For it, selection and proposals have closed forms, and
the particles' density is the prediction's f times l(s) / A, A the mean of l: a mixture of a share e of plain
predictions and of these has the weights f / q = 1 / (e + (1 - e) l / A). Whatever the fit is worth, they are exact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from scipy.linalg.lapack import dsygv

from elusive.contracts import Array, Motion
from elusive.filters.particle import _kernels
from elusive.filters.particle.annealed import share_of
from elusive.filters.particle.resampling import resample
from elusive.motion import transition

PLAIN_SHARE = 0.1  # of the particles: plain predictions, e
EFFECTIVE = 0.2  # share of the pilot's particles that the fit is left with at least
WIDENED = 1.8  # covariance of the fitted likelihood, for what the fit cannot know of its tails
LEAST_GAIN = 1e-6  # of precision, relative to the prediction's
LEAST_SPREAD = 1e-9  # of a component, relative to its size: particles that all stand in one place


class Cloud(NamedTuple):
    """Particles for a prediction."""

    states: Array  # (n, d)
    log_prior: Array  # (n,) log of prediction over proposal, less log n: exp(log_prior) @ likelihood is the evidence


class FittedLikelihood(NamedTuple):
    """A Gaussian of some components that rises and falls as the likelihood does."""

    mean: Array  # (k,)
    covariance: Array  # (k, k)


def fit_likelihood(places: Array, log_prior: Array, log_likelihood: Array) -> FittedLikelihood:
    """Fit a Gaussian to a likelihood: posterior precision less prediction precision.

    Where the likelihood is so narrow that it would leave few particles, a power of it is fitted, and taken back.

    Parameters
    ----------
    places
        ``(n, k)`` components that the likelihood depends on, of predicted particles.
    log_prior, log_likelihood
        ``(n,)`` of each.
    """
    weights, _ = _kernels.weigh(log_prior)
    log_weights = np.log(np.maximum(weights, 1e-300))
    power = share_of(log_likelihood, log_weights, 1.0, EFFECTIVE / float(weights @ weights))
    after, _ = _kernels.weigh(log_weights + power * log_likelihood)
    mean, covariance = proper_moments(places, weights)
    found, left = proper_moments(places, after)
    # axes in which the posterior has unit covariance, and the prediction has that of the values
    values, axes, failed = dsygv(covariance, left, uplo="L")
    if failed:
        raise np.linalg.LinAlgError("a covariance of particles is not positive definite")
    gain = np.maximum((values - 1) / power, LEAST_GAIN)
    # information of the posterior, about the prediction's mean: nothing where nothing was gained
    offset = np.where(gain > LEAST_GAIN, values * (axes.T @ (found - mean)) / (power * gain), 0.0)
    scaled = left @ axes
    return FittedLikelihood(mean + scaled @ offset, WIDENED * (scaled * (values / gain)) @ scaled.T)


def draw_informed(
    states: Array,
    weights: Array,
    motion: Motion,
    interval_s: float,
    likelihood: FittedLikelihood,
    observed: Sequence[int],
    n: int,
    rng: Generator,
) -> Cloud:
    """Draw predicted particles where the likelihood lets expect them; plain predictions of a motion that is not linear.

    Parameters
    ----------
    states, weights
        ``(N, d)`` before, ``(N,)``.
    motion, interval_s
        How the target moved, and for how long.
    likelihood
        Of the observed components.
    observed
        Their places in the state.
    n
        Particles to draw.
    rng
        Source of randomness.
    """
    linear = transition(motion, interval_s)
    if linear is None or interval_s == 0:
        chosen = resample(weights, n, rng)
        moved = motion.propagate(_kernels.gather(states, chosen, n), interval_s, rng)
        return Cloud(moved, np.full(n, -math.log(n)))
    from elusive.filters.particle import _informed_kernels as kernels

    F, Q = linear
    seen = np.arange(states.shape[1])[list(observed)]
    both = np.array([Q[seen][:, seen] + likelihood.covariance, likelihood.covariance])  # of a prediction, and alone
    roots, (precision, inverse) = np.linalg.cholesky(both), np.linalg.inv(both)
    # first stage: how well each particle's own prediction fits
    fits = kernels.selection(states, weights, F[seen], likelihood.mean, precision)
    selected, log_mean = _kernels.weigh(fits)
    plain = round(PLAIN_SHARE * n)
    chosen = np.concatenate([resample(weights, plain, rng), resample(selected, n - plain, rng)])
    moved = motion.propagate(_kernels.gather(states, chosen, n), interval_s, rng)
    # second stage: a draw of the prediction, corrected by a draw of what is measured, is one of the posterior
    noise = rng.standard_normal((n - plain, len(seen)))
    level = kernels.correct(moved, seen, likelihood.mean, roots[1], inverse, precision @ Q[seen], noise)
    scale = float(np.log(np.diagonal(roots[1]) / np.diagonal(roots[0])).sum())
    log_ratio = level - (log_mean + scale)
    share = plain / n
    mixture = share + (1 - share) * np.exp(np.minimum(log_ratio, 700.0))
    return Cloud(moved, -np.log(n * mixture))


def smoothed(states: Array, weights: Array, n: int, width: float, rng: Generator) -> Array:
    """Draw n states from kernels about some that leave mean and covariance: Liu and West (2001).

    ``width`` is that of the kernel, in deviations of the cloud.
    """
    mean, covariance = proper_moments(states, weights)
    drawn = mean + math.sqrt(1 - width**2) * (_kernels.gather(states, resample(weights, n, rng), n) - mean)
    drawn += width * rng.standard_normal(drawn.shape) @ np.linalg.cholesky(covariance).T
    return np.asfortranarray(drawn)


def proper_moments(places: Array, weights: Array) -> tuple[Array, Array]:
    """Mean and covariance of a cloud, the latter positive definite even where all stand in one place."""
    mean, covariance = _kernels.moments(places, weights)
    covariance.flat[:: len(mean) + 1] += LEAST_SPREAD * (1.0 + mean**2)
    return mean, covariance
