"""The prediction of a target: where its motion may have taken it, and where what is known lets it be.

Plain, by place (:mod:`elusive.tracking.by_place`), or with the measurement in view
(:mod:`elusive.filters.particle.informed`), of which a few plain predictions, the pilot, tell; in stages
(:mod:`elusive.filters.particle.annealed`) where they do not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from scipy.linalg import solve_triangular

from elusive.contracts import AdditiveSensor, Array, Motion, X, Y
from elusive.filters.particle import _kernels
from elusive.filters.particle.annealed import anneal
from elusive.filters.particle.informed import Cloud, draw_informed, fit_likelihood
from elusive.filters.particle.parts import Known, allowed_by, posterior
from elusive.filters.particle.resampling import Indices, resample
from elusive.motion import transition
from elusive.tracking.by_place import ByPlace, Placed
from elusive.tracking.lifecycle import Life
from elusive.tracking.sought import Sought, Update, settled
from elusive.tracking.superposed_state import Target

LEAST_FREE = 1e-9  # share of its variance that each axis has for itself


class Predictor(NamedTuple):
    """What targets are predicted with."""

    motion: Motion
    sensor: AdditiveSensor
    known: Known
    by_place: ByPlace | None
    observed: Sequence[int]  # components that the measurement depends on
    particles: int

    def predicted(self, target: Target, prior: float, usual: int, interval_s: float, rng: Generator) -> Sought:
        """Predict a target that exists with a probability, as a rule by so many particles."""
        n = self._count(target, usual)
        if interval_s == 0:
            with np.errstate(divide="ignore"):
                return self._allowed(target.life, prior, Cloud(target.particles, np.log(target.weights)))
        before = _kernels.gather(target.particles, resample(target.weights, n, rng), n)
        even = np.full(n, -math.log(n))
        moved = self.motion.propagate(before, interval_s, rng)
        sought = self._allowed(target.life, prior, Cloud(moved, even))
        if self.by_place is None:
            return sought
        kept = resample(sought.weights, n, rng)
        moved = _kernels.gather(moved, kept, n)
        placed = Placed(_kernels.gather(before, kept, n), moved[:, [X, Y]], interval_s)
        return sought._replace(
            prior=sought.existence, particles=moved, log_prior=even, weights=np.exp(even), placed=placed
        )

    def informed(self, target: Target, prior: float, pilot: Sought, interval_s: float, rng: Generator) -> Sought:
        """Predict a target with the measurement in view, given which a pilot has been updated."""
        assert pilot.log_ratio is not None
        observed = list(self.observed)
        likelihood = fit_likelihood(pilot.particles[:, observed], pilot.log_prior, pilot.log_ratio)
        n = self._count(target, self.particles)
        cloud = draw_informed(target.particles, target.weights, self.motion, interval_s, likelihood, observed, n, rng)
        sought = self._allowed(target.life, prior, cloud)
        expected = self.sensor.expected(cloud.states)
        return sought._replace(existence=pilot.existence, expected=expected, effect=pilot.effect)

    def annealed(
        self, target: Target, prior: float, update: Update, others: Sequence[Any], interval_s: float
    ) -> Sought | None:
        """Bring a target's plain predictions to their posterior in stages, where its motion has noise in all axes.

        A measurement that tells its place far better than the prediction does may leave no informed draw near it.
        """
        linear = transition(self.motion, interval_s)
        if linear is None or not _full_rank(linear[1]):
            return None
        (F, Q), n, rng = linear, self.particles, update.rng
        before = _kernels.gather(target.particles, resample(target.weights, n, rng), n)
        even = np.full(n, -math.log(n))
        plain = self._allowed(target.life, prior, Cloud(self.motion.propagate(before, interval_s, rng), even))
        towards, root, members = before @ F.T, np.linalg.cholesky(Q), (*self.known.maps, *self.known.views)

        def log_prior(states: Array, origin: Indices) -> Array:
            off = solve_triangular(root, (states - towards[origin]).T, lower=True, check_finite=False)
            level: Array = -0.5 * np.einsum("dn,dn->n", off, off)
            return level + allowed_by(members, states) if members else level

        def log_likelihood(states: Array) -> Array:
            return self.sensor.log_ratio(self.sensor.expected(states), update.measurement, others)

        log_weight = plain.log_prior - even
        after = anneal(plain.particles, log_prior, log_likelihood, rng, log_weight=log_weight, centres=towards)
        if after.log_evidence == -math.inf:
            return None
        return settled(target.life, plain.prior, after, self.sensor, update.measurement, others)

    def _count(self, target: Target, usual: int) -> int:
        if len(target.particles) > self.particles:  # newborn, of many velocities
            return self.particles
        return usual

    def _allowed(self, life: Life, prior: float, cloud: Cloud) -> Sought:
        """Let a target be where its particles are and can be."""
        log_prior = cloud.log_prior
        for known in self.known.maps:
            log_prior = log_prior + known.log_probability(cloud.states)
        for view in self.known.views:
            # who has left the field of view is not there
            _, before = _kernels.weigh(log_prior)
            seen = log_prior + view.log_probability(cloud.states)
            _, log_stays = _kernels.weigh(seen)
            prior *= math.exp(min(log_stays - before, 0.0))
            log_prior = seen if prior == 0.0 else seen - min(log_stays - before, 0.0)
        weights, log_allowed = _kernels.weigh(log_prior)
        return Sought(life, prior, posterior(prior, min(log_allowed, 0.0)), cloud.states, log_prior, weights)


def _full_rank(covariance: Array) -> bool:
    """Whether noise moves each axis by itself: of one acceleration an interval place and velocity are one draw."""
    deviation = np.sqrt(np.diagonal(covariance))
    if not deviation.all():
        return False
    return bool(np.linalg.eigvalsh(covariance / np.outer(deviation, deviation))[0] > LEAST_FREE)
