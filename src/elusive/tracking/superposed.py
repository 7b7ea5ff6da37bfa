"""Several targets whose contributions to a measurement add up: a multi-Bernoulli particle filter.

Each target has a probability of existence and particles given existence. It is updated given the others' expected
effect and the covariance of it, in turn, and once more when all have been: Nannuru, Coates and Mahler (2013), IEEE J.
Sel. Topics Signal Process. 7(3), 370-380; Davies and Garcia-Fernandez (2024), IEEE Trans. Signal Process. 72, 607-620.
Newborn targets are drawn from what the known ones leave over (:mod:`elusive.filters.particle.annealed`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import ConfigDict, Field, SerializeAsAny

from elusive.contracts import AdditiveSensor, Array, Knowledge, Motion, interval_since
from elusive.filters.particle import _kernels
from elusive.filters.particle.annealed import anneal
from elusive.filters.particle.parts import posterior
from elusive.filters.particle.resampling import resample
from elusive.model import Model, Positive, Probability
from elusive.tracking.birth_density import BirthComponent, BirthDensity, within
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.track import Track

SUREST = 1 - 1e-9  # existence, at most: a target may always have just gone
FIRST_S = 1.0  # time before the first measurement in which its targets may have appeared
SCREENED = 0.1  # of the least existence: what the drawn states must promise for a newborn target to be sought


class Target(NamedTuple):
    """Somebody who may be there."""

    life: Life
    existence: float  # posterior probability that it is there
    particles: Array  # (N, d) given that it is
    weights: Array  # (N,) summing to one
    mean: Array  # (d,)
    covariance: Array  # (d, d)


class SuperposedState(NamedTuple):
    """Belief after a measurement."""

    time_s: float  # NaN before the first measurement, where no time was given
    targets: tuple[Target, ...]
    numbered: int  # tracks so far

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The targets that have a number."""
        return tuple(
            Track(target.life.track, target.life.status, target.existence, target.mean, target.covariance)
            for target in self.targets
            if target.life.track is not None and target.life.status is not None
        )


class _Sought(NamedTuple):
    """A target while a measurement is taken in."""

    life: Life
    prior: float  # existence before the measurement
    existence: float
    particles: Array
    log_prior: Array  # (N,) log weights before the measurement
    weights: Array  # (N,)
    expected: Any  # what each particle adds to the measurement
    effect: Any  # what the target adds, as it is believed now


class SuperposedTracker(Model):
    """Tracks any number of targets through any sensor whose readings add up."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    motion: SerializeAsAny[Motion] = Field(description="How a target moves")
    sensor: SerializeAsAny[AdditiveSensor] = Field(description="What targets add to a measurement")
    birth: SerializeAsAny[BirthDensity] = Field(description="Where and how often targets appear")
    knowledge: tuple[SerializeAsAny[Knowledge], ...] = Field((), description="Where a target can be")
    death_probability: Probability = Field(0.01, description="Probability that a target disappears in 1 s")
    particles: int = Field(1000, ge=10, le=1_000_000, description="Particles of a target, N")
    sweeps: int = Field(2, ge=1, le=20, description="Updates of each target given the others, a measurement")
    forget_below: float = Field(1e-3, gt=0, lt=1, description="Existence below which a target is forgotten")
    merge_within: Positive = Field(
        0.5, description="Two targets nearer than this that are together one at most are one [deviations]"
    )
    lifecycle: Lifecycle = Field(Lifecycle(), description="When a track begins, is confirmed and ends")

    def init(self, rng: Generator, time_s: float = math.nan) -> SuperposedState:
        """Return the belief before any measurement: no target."""
        return SuperposedState(time_s, (), 0)

    def step(self, state: SuperposedState, time_s: float, measurement: Any | None, rng: Generator) -> SuperposedState:
        """Return the belief at a time, with the measurement made then; without one (``None``), the prediction.

        Raises
        ------
        DataError
            If time runs backwards, or the sensor refuses the measurement.
        """
        interval_s = interval_since(state.time_s, time_s)
        survival = 1 - within(self.death_probability, interval_s)
        living = [target for target in state.targets if target.life.status != "deleted"]
        found = [self._predicted(target, interval_s, survival, rng) for target in living]
        if measurement is not None:
            found = self._updated(found, measurement)
            found += self._newborn(found, measurement, FIRST_S if math.isnan(state.time_s) else interval_s, rng)
        return self._judged(time_s, self._merged(found), state.numbered)

    def _predicted(self, target: Target, interval_s: float, survival: float, rng: Generator) -> _Sought:
        """Move a target's particles; where it cannot be, it is not."""
        n = self.particles
        particles, log_prior = target.particles, np.full(n, -math.log(n))
        if interval_s > 0:
            chosen = resample(target.weights, n, rng)
            particles = self.motion.propagate(_kernels.gather(particles, chosen, n), interval_s, rng)
        else:
            with np.errstate(divide="ignore"):
                log_prior = np.log(target.weights)
        existence = survival * target.existence
        for known in self.knowledge:
            log_prior = log_prior + known.log_probability(particles)
        if self.knowledge:
            weights, log_allowed = _kernels.weigh(log_prior)
            allowed = math.exp(log_allowed)
            existence = existence * allowed / (1 - existence + existence * allowed)
            with np.errstate(divide="ignore"):
                log_prior = np.log(weights)
        return self._sought(target.life, existence, particles, log_prior)

    def _sought(self, life: Life, existence: float, particles: Array, log_prior: Array) -> _Sought:
        expected = self.sensor.expected(particles)
        weights = np.exp(log_prior)
        effect = self.sensor.effect(expected, weights, existence)
        return _Sought(life, existence, existence, particles, log_prior, weights, expected, effect)

    def _updated(self, found: list[_Sought], measurement: Any) -> list[_Sought]:
        """Update each target given the others, in turn."""
        for _ in range(self.sweeps if len(found) > 1 else 1):
            for k, target in enumerate(found):
                others = [other.effect for other in found[:k] + found[k + 1 :]]
                log_ratio = self.sensor.log_ratio(target.expected, measurement, others)
                weights, log_evidence = _kernels.weigh(target.log_prior + log_ratio)
                existence = min(posterior(target.prior, log_evidence), SUREST)
                effect = self.sensor.effect(target.expected, weights, existence)
                found[k] = target._replace(existence=existence, weights=weights, effect=effect)
        return found

    def _newborn(self, found: list[_Sought], measurement: Any, interval_s: float, rng: Generator) -> list[_Sought]:
        """Look for targets that the known ones do not explain, a component of the birth after the other."""
        newborn: list[_Sought] = []
        effects = [target.effect for target in found]
        for component in self.birth.components:
            probability = component.probability(interval_s)
            if probability == 0.0:
                continue
            target = self._born(component, probability, measurement, effects, rng)
            if target is not None:
                newborn.append(target)
                effects.append(target.effect)
        return newborn

    def _born(
        self, component: BirthComponent, probability: float, measurement: Any, others: Sequence[Any], rng: Generator
    ) -> _Sought | None:
        """Draw a component's target from what the others leave over, if that promises any."""
        n = self.particles

        def log_prior(states: Array, _: Any) -> Array:
            density = component.log_density(states)
            for known in self.knowledge:
                density = density + known.log_probability(states)
            return density

        def log_likelihood(states: Array) -> Array:
            return self.sensor.log_ratio(self.sensor.expected(states), measurement, others)

        drawn = component.sample(n, rng)
        _, promise = _kernels.weigh(log_likelihood(drawn) - math.log(n))
        if posterior(probability, promise) < SCREENED * self.forget_below:
            return None
        after = anneal(drawn, log_prior, log_likelihood, rng)
        existence = min(posterior(probability, after.log_evidence), SUREST)
        if existence < self.forget_below:
            return None
        return self._sought(Life(), existence, after.states, np.full(n, -math.log(n)))

    def _merged(self, found: list[_Sought]) -> list[_Sought]:
        """Make one of two targets in one place that are together hardly more than one."""
        kept: list[_Sought] = []
        moments = [_kernels.moments(target.particles, target.weights) for target in found]
        order = sorted(range(len(found)), key=lambda k: (found[k].life.track is None, -found[k].existence))
        places: list[int] = []
        for k in order:
            for slot, other in enumerate(places):
                both = kept[slot].existence + found[k].existence
                if both < 1.5 and _apart(moments[k], moments[other]) < self.merge_within:
                    kept[slot] = kept[slot]._replace(existence=min(both, SUREST))
                    break
            else:
                kept.append(found[k])
                places.append(k)
        return kept

    def _judged(self, time_s: float, found: Sequence[_Sought], numbered: int) -> SuperposedState:
        """Let each target's life go on, and forget those that hardly exist."""
        targets = []
        for target in found:
            life, numbered = self.lifecycle.step(target.life, target.existence, numbered)
            if target.existence >= self.forget_below or life.status == "deleted":
                moments = _kernels.moments(target.particles, target.weights)
                targets.append(Target(life, target.existence, target.particles, target.weights, *moments))
        return SuperposedState(time_s, tuple(targets), numbered)


def _apart(first: tuple[Array, Array], second: tuple[Array, Array]) -> float:
    """Root mean square difference of two beliefs, in their deviations."""
    off = first[0] - second[0]
    return math.sqrt(max(0.0, float(off @ np.linalg.lstsq(first[1] + second[1], off)[0])) / len(off))
