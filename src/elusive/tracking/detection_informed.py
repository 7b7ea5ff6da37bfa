"""Particles of a target of the tracker of detections drawn where a detection has it, if it would leave few of them.

A second detection says far more of a velocity than the first: of the particles that the first began few reach it,
fewest where the target is fast, and what these say of existence and covariance is too low and too narrow. Half of them
are drawn anew, from a Gaussian like the posterior that is found in stages, each of more of the likelihood, by the cross
entropy: Rubinstein and Kroese (2004), The cross-entropy method, section 2.3. Weights of the mixture of both halves
leave the prediction what it is: Owen and Zhou (2000), J. Am. Stat. Assoc. 95(449), 135-143. It has to be a Gaussian's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array, DetectionSensor, Knowledge
from elusive.filters.particle import _kernels
from elusive.filters.particle.annealed import share_of
from elusive.filters.particle.informed import proper_moments
from elusive.filters.particle.parts import allowed_by
from elusive.filters.particle.resampling import resample
from elusive.tracking.detection_targets import Evidence, Expected, kurtosis

LEAST_ODDS = 1e-3  # that it is the target's
DRAWN = 0.5  # share of the particles that are drawn anew
GAUSSIAN = 2.0, 4.5  # kurtosis along each axis of what is like a Gaussian: a line has 1.8, an exponential fall 9
PILOTS = 500  # particles of a stage
EFFECTIVE = 0.2  # share of them that it leaves
STAGES = 10
WIDENED = 1.5  # covariance of what is drawn, for what a Gaussian does not know of tails


class _Gaussian(NamedTuple):
    mean: Array  # (d,)
    covariance: Array  # (d, d)

    def drawn(self, n: int, rng: Generator) -> Array:
        """Draw states, ``(n, d)``."""
        noise = rng.standard_normal((n, len(self.mean)))
        return np.asfortranarray(self.mean + noise @ np.linalg.cholesky(self.covariance).T)

    def log_density(self, states: Array) -> Array:
        """Log density, but for the constant of the dimension, ``(N, d) -> (N,)``."""
        root = np.linalg.cholesky(self.covariance)
        off = np.linalg.solve(root, (states - self.mean).T)
        return np.asarray(-0.5 * (off**2).sum(axis=0) - np.log(np.diagonal(root)).sum())


def informed(
    one: Expected,
    found: Evidence,
    sensor: DetectionSensor,
    measurement: Any,
    log_new: Array,
    known: Sequence[Knowledge],
    share: float,
    rng: Generator,
) -> Expected | None:
    """Return a target before a scan with particles where each detection has it that would leave few; else nothing.

    Parameters
    ----------
    one, found
        The target before the scan, and what the scan says of it.
    sensor, measurement
        What reports the detections.
    log_new
        ``(k,)`` logarithm of the intensity of each detection within reach, if it is not this target's.
    known
        What is known of places.
    share
        Of the particles, below which a detection leaves few.
    rng
        Source of the draws.
    """
    # joint samples of a pair stand row by row
    if not found.which.size or one.target.pair is not None:
        return None
    few = _leave_few(found, log_new, share)
    if not few.size or not _is_gaussian(one):
        return None
    n = len(one.weights)
    before = _Gaussian(*proper_moments(one.particles, one.weights))
    places = [_posterior(one, before, sensor, measurement, number, rng) for number in found.which[few]]
    each = round(DRAWN * n / len(places))
    left = n - each * len(places)
    kept = _kernels.gather(one.particles, resample(one.weights, left, rng), left)
    particles = np.asfortranarray(np.concatenate([kept, *(place.drawn(each, rng) for place in places)]))
    level = before.log_density(particles)
    mixture = np.logaddexp.reduce(
        [
            math.log(left) + level,
            *(math.log(each) + place.log_density(particles) for place in places),
        ]
    )
    weights, _ = _kernels.weigh(level - mixture)
    allowed = None if one.allowed is None else np.exp(allowed_by(known, particles))
    return one._replace(particles=particles, weights=weights, allowed=allowed)


def _leave_few(found: Evidence, log_new: Array, share: float) -> NDArray[np.int64]:
    """Which detections within reach may be the target's, and would leave few particles."""
    may_be = found.log_made_itself - found.log_missed - log_new > math.log(LEAST_ODDS)
    if not may_be.any():
        return np.empty(0, dtype=np.int64)
    squares = found.likely[1:] ** 2 @ found.weights**2
    return np.flatnonzero(may_be & (found.total[1:] ** 2 < share * len(found.weights) * squares))


def _is_gaussian(one: Expected) -> bool:
    fourth = kurtosis(one)
    return bool(((fourth > GAUSSIAN[0]) & (fourth < GAUSSIAN[1])).all())


def _posterior(
    one: Expected, before: _Gaussian, sensor: DetectionSensor, measurement: Any, number: int, rng: Generator
) -> _Gaussian:
    """Find a Gaussian like the posterior of a detection, and a little wider."""
    states = _kernels.gather(one.particles, resample(one.weights, PILOTS, rng), PILOTS)
    log_weight, after = np.zeros(PILOTS), before
    for stage in range(STAGES):
        if stage:
            states = after.drawn(PILOTS, rng)
            log_weight = before.log_density(states) - after.log_density(states)
        level = np.ascontiguousarray(sensor.log_densities(states, measurement, np.array([number]))[:, 0])
        share = share_of(level, log_weight, 1.0, EFFECTIVE * PILOTS)
        after = _Gaussian(*proper_moments(states, _kernels.weigh(log_weight + share * level)[0]))
        if share == 1.0:
            break
    return after._replace(covariance=WIDENED * after.covariance)
