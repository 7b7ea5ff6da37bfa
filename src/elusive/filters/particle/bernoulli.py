"""Bernoulli particle filter: track-before-detect of a target that may be absent.

Amrouche, Khenchaf and Berkani (2018), eqs. 3-7, 11-12 and 17-21, Rao-Blackwellised over existence: the particles
describe the target given that it is there, and the probability that it is there is carried beside them, exactly
(Ristic, Vo, Vo and Farina (2013), section V).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array, interval_since
from elusive.errors import DataError
from elusive.filters.particle import _kernels
from elusive.filters.particle.births import MeasurementBirth
from elusive.filters.particle.parts import (
    AnyBirth,
    AnyKnowledge,
    AnyMotion,
    AnySensor,
    Known,
    allowed_by,
    check_amplitude,
    switching,
)
from elusive.filters.particle.resampling import Scheme, resample
from elusive.model import FROM_RECORDING, Model, Probability
from elusive.motion import WithIntensity
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.image import ImageSensor

LEAST_LOG_ODDS = -700.0  # of existence, below which it is zero


class BernoulliState(NamedTuple):
    """Belief after a frame: is there a target, and where it is if there is one."""

    time_s: float  # NaN before the first frame, where no time was given
    existence: float  # P(present | frames so far)
    particles: Array  # (N, d) states given presence, not yet resampled
    weights: Array  # (N,) summing to one
    mean: Array  # (d,) given presence
    covariance: Array  # (d, d) given presence


class BernoulliFilter(Model):
    """Detects and tracks one target that appears, moves and disappears.

    Knowledge of where a target can be is a part of the evidence, and so of existence. The field of view is another
    thing: mass that leaves it counts as absence, so that a target that comes back is found anew.
    """

    kind: Literal["bernoulli"] = "bernoulli"
    motion: AnyMotion = Field(WithIntensity(), description="How the target moves")
    sensor: AnySensor = Field(ImageSensor(), description="What a frame says of a state")
    birth: AnyBirth = Field(MeasurementBirth(), description="Where a target appears, p_b and q_b")
    knowledge: tuple[AnyKnowledge, ...] = Field(
        (FieldOfView(),), description="Where a target can be: the sensor's view, maps", json_schema_extra=FROM_RECORDING
    )
    birth_probability: Probability = Field(0.05, description="Probability that a target appears in 1 s, P_b, eq. 3")
    death_probability: Probability = Field(0.05, description="Probability that it disappears in 1 s, P_d, eq. 4")
    initial_existence: Probability = Field(0.05, description="Probability of existence before the first frame, mu_1")
    particles: int = Field(1500, gt=0, description="Particles that continue, N_c")
    newborns: int = Field(500, gt=0, description="Particles born at each step, N_b")
    resampling: Scheme = Field("systematic", description="Resampling scheme")

    @model_validator(mode="after")
    def _uses_all(self) -> Self:
        check_amplitude(self.motion, self.birth, self.sensor)
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return self.motion.state_names

    @cached_property
    def _known(self) -> Known:
        return Known.of(self.knowledge, self.sensor)

    def init(self, rng: Generator, time_s: float = math.nan) -> BernoulliState:
        """Return the belief before the first frame: the birth density, and the initial existence."""
        births = self.birth.draw(self.particles, None, self.sensor, self.state_names, rng)
        log_prior = births.log_ratio - math.log(self.particles)
        if self._known.maps:
            log_prior = log_prior + allowed_by(self._known.maps, births.states)
        weights, _ = _kernels.weigh(log_prior)
        moments = _kernels.moments(births.states, weights)
        return BernoulliState(time_s, self.initial_existence, births.states, weights, *moments)

    def step(self, state: BernoulliState, time_s: float, measurement: Any | None, rng: Generator) -> BernoulliState:
        """Return the belief at a frame's time and after it; without a frame (``None``), the prediction.

        Raises
        ------
        DataError
            If time runs backwards, the sensor refuses the frame, or motion or birth give states of another shape.
        """
        interval_s = interval_since(state.time_s, time_s)
        if interval_s == 0:
            with np.errstate(divide="ignore"):
                log_prior = np.log(state.weights) + _log(state.existence)
            return self._posterior(time_s, state.particles, log_prior, measurement, 1 - state.existence)
        appears, disappears = switching(self.birth_probability, self.death_probability, interval_s)
        n = self.particles
        survivors = resample(state.weights, n, rng, self.resampling)
        states = _kernels.gather(state.particles, survivors, n + self.newborns)
        _fill(states[:n], self.motion.propagate(states[:n], interval_s, rng), "motion")
        births = self.birth.draw(self.newborns, measurement, self.sensor, self.state_names, rng)
        _fill(states[n:], births.states, "birth")

        alive = (1 - disappears) * state.existence
        born = appears * (1 - state.existence)
        log_prior = np.empty(n + self.newborns)
        log_prior[:n] = _log(alive / n)
        log_prior[n:] = births.log_ratio + _log(born / self.newborns)
        left = 0.0
        if self._known.views:
            stay = allowed_by(self._known.views, states[:n])
            if stay.any():
                log_prior[:n] += stay
                left = alive * (1 - float(np.exp(stay).sum()) / n)
        if self._known.maps:
            log_prior += allowed_by(self._known.maps, states)
        absent = disappears * state.existence + (1 - appears) * (1 - state.existence) + left
        return self._posterior(time_s, states, log_prior, measurement, absent)

    def _posterior(
        self, time_s: float, states: Array, log_prior: Array, measurement: Any | None, absent: float
    ) -> BernoulliState:
        log_likelihood = (
            np.zeros(len(states)) if measurement is None else self.sensor.log_likelihood(states, measurement)
        )
        weights, log_present = _kernels.weigh(log_likelihood + log_prior)
        mean, covariance = _kernels.moments(states, weights)
        log_odds = log_present - _log(absent) if log_present > -math.inf else -math.inf
        existence = 1 / (1 + math.exp(-log_odds)) if log_odds > LEAST_LOG_ODDS else 0.0
        return BernoulliState(time_s, existence, states, weights, mean, covariance)


def _fill(rows: Array, states: Array, part: str) -> None:
    if states.shape != rows.shape:
        raise DataError(
            f"{part}: gave states of shape {states.shape}, the filter needs {rows.shape}, one row a particle."
        )
    rows[:] = states


def _log(mass: float) -> float:
    return math.log(mass) if mass > 0 else -math.inf
