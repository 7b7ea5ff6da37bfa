"""Bernoulli particle filter: track-before-detect of a target that may be absent.

Amrouche, Khenchaf and Berkani (2018), eqs. 3-7, 11-12 and 17-21, Rao-Blackwellised over existence: the particles
describe the target given that it is there, and the probability that it is there is carried beside them, exactly
(Ristic, Vo, Vo and Farina (2013), section V).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal, NamedTuple, cast

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array, Knowledge
from elusive.filters import _kernels
from elusive.filters.births import MeasurementBirth
from elusive.filters.parts import AnyBirth, AnyMotion, AnySensor
from elusive.filters.resampling import Scheme, resample
from elusive.model import Model, Probability
from elusive.motion import WithIntensity
from elusive.sensors.image import ImageSensor


class BernoulliState(NamedTuple):
    """Belief after a frame: is there a target, and where it is if there is one."""

    existence: float  # P(present | frames so far)
    particles: Array  # (N, d) states given presence, not yet resampled
    weights: Array  # (N,) summing to one
    mean: Array  # (d,) given presence
    covariance: Array  # (d, d) given presence


class BernoulliFilter(Model):
    """Detects and tracks one target that appears, moves and disappears.

    Mass that leaves the field of view (where the sensor has one) counts as absence, so that a target that
    comes back is found anew.
    """

    kind: Literal["bernoulli"] = "bernoulli"
    motion: AnyMotion = Field(WithIntensity(), description="How the target moves")
    sensor: AnySensor = Field(ImageSensor(), description="What a frame says of a state")
    birth: AnyBirth = Field(MeasurementBirth(), description="Where a target appears, p_b and q_b")
    birth_probability: Probability = Field(0.05, description="Probability that a target appears in a step, P_b, eq. 3")
    death_probability: Probability = Field(0.05, description="Probability that it disappears in a step, P_d, eq. 4")
    initial_existence: Probability = Field(0.05, description="Probability of existence before the first frame, mu_1")
    particles: int = Field(1500, gt=0, description="Particles that continue, N_c")
    newborns: int = Field(500, gt=0, description="Particles born at each step, N_b")
    resampling: Scheme = Field("systematic", description="Resampling scheme")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return self.motion.state_names

    @cached_property
    def _has_edges(self) -> bool:
        return isinstance(self.sensor, Knowledge)

    def init(self, rng: Generator) -> BernoulliState:
        """Return the belief before the first frame: the birth density, and the initial existence."""
        births = self.birth.draw(self.particles, None, self.sensor, self.state_names, rng)
        return self._posterior(births.states, births.log_ratio - math.log(self.particles), None, self.initial_existence)

    def step(self, state: BernoulliState, measurement: Any | None, rng: Generator) -> BernoulliState:
        """Return the belief after one more frame; without a frame (``None``), the prediction.

        Raises
        ------
        DataError
            If the sensor refuses the frame.
        """
        survivors = resample(state.weights, self.particles, rng, self.resampling)
        moved = self.motion.propagate(state.particles.take(survivors, axis=0), rng)
        births = self.birth.draw(self.newborns, measurement, self.sensor, self.state_names, rng)

        alive = (1 - self.death_probability) * state.existence
        born = self.birth_probability * (1 - state.existence)
        log_prior = np.empty(self.particles + self.newborns)
        log_prior[: self.particles] = _log(alive / self.particles)
        log_prior[self.particles :] = births.log_ratio + _log(born / self.newborns)
        left = 0.0
        if self._has_edges:
            stay = cast(Knowledge, self.sensor).log_probability(moved)
            if stay.any():
                log_prior[: self.particles] += stay
                left = alive * (1 - float(np.exp(stay).mean()))
        absent = self.death_probability * state.existence + (1 - self.birth_probability) * (1 - state.existence) + left
        return self._posterior(np.concatenate([moved, births.states]), log_prior, measurement, None, absent)

    def _posterior(
        self, states: Array, log_prior: Array, measurement: Any | None, existence: float | None, absent: float = 0.0
    ) -> BernoulliState:
        log_likelihood = (
            np.zeros(len(states)) if measurement is None else self.sensor.log_likelihood(states, measurement)
        )
        weights, posterior = _weigh(log_likelihood + log_prior, absent)
        mean, covariance = _kernels.moments(states, weights)
        return BernoulliState(posterior if existence is None else existence, states, weights, mean, covariance)


def _weigh(log_mass: Array, absent: float) -> tuple[Array, float]:
    """Weights (summing to one) and existence, from the log mass of each particle and the mass of absence."""
    best = float(log_mass.max())
    if best == -math.inf:
        return np.full(len(log_mass), 1 / len(log_mass)), 0.0
    weights = np.exp(log_mass - best)
    total = float(weights.sum())
    weights /= total
    return weights, float(np.exp(-np.logaddexp(0.0, _log(absent) - best - math.log(total))))


def _log(mass: float) -> float:
    return math.log(mass) if mass > 0 else -math.inf
