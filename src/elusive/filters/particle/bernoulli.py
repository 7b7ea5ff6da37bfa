"""Bernoulli particle filter: track-before-detect of a target that may be absent.

Amrouche, Khenchaf and Berkani (2018), eqs. 3-7, 11-12 and 17-21, Rao-Blackwellised over existence: the particles
describe the target given that it is there, and the probability that it is there is carried beside them, exactly
(Ristic, Vo, Vo and Farina (2013), section V).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array, interval_since
from elusive.errors import DataError
from elusive.filters.particle import _kernels, _step_kernels
from elusive.filters.particle._prediction_kernels import by_cell, predict
from elusive.filters.particle._step_kernels import Masses, Plan
from elusive.filters.particle.births import MeasurementBirth, UniformBirth
from elusive.filters.particle.cells import cell_side
from elusive.filters.particle.detector import Detector
from elusive.filters.particle.parts import allowed_by, step_matrices, switching
from elusive.filters.particle.resampling import resample
from elusive.model import NonNegative
from elusive.sensors.image import ImageSensor

DRAWS = 5  # uniform numbers that a step takes of the generator
LEAST_LOG_ODDS = -700.0  # of existence, below which it is zero


class BernoulliState(NamedTuple):
    """Belief after a frame: is there a target, and where it is if there is one."""

    time_s: float  # NaN before the first frame, where no time was given
    existence: float  # P(present | frames so far)
    particles: Array  # (N, d) states given presence, not yet resampled
    weights: Array  # (N,) summing to one
    mean: Array  # (d,) given presence
    covariance: Array  # (d, d) given presence


class BernoulliFilter(Detector):
    """Detects and tracks one target that appears, moves and disappears.

    Knowledge of where a target can be is a part of the evidence, and so of existence. The field of view is another
    thing: mass that leaves it counts as absence, so that a target that comes back is found anew.
    """

    kind: Literal["single"] = "single"
    particles: int = Field(1500, gt=0, description="Particles that continue, N_c")
    newborns: int = Field(500, gt=0, description="Particles born at each step, N_b")
    spread_within: NonNegative | None = Field(
        None,
        description="Side of the cells of place in which survivors are spread over what they stand for, mean and "
        "covariance kept; 0: they stay as resampled; not given: three point spreads, 0 for a sensor without [px]",
    )

    @cached_property
    def _side(self) -> float:
        return cell_side(self.spread_within, self.sensor)

    @cached_property
    def _plan(self) -> Plan | None:
        """What the compiled step needs; None of models that it does not know."""
        sensor, birth = self.sensor, self.birth
        if not isinstance(birth, UniformBirth) or not isinstance(sensor, ImageSensor) or self._known.maps:
            return None
        known = type(sensor) is ImageSensor and type(birth) in (UniformBirth, MeasurementBirth)
        if not known or sensor.noise != "gaussian" or self.resampling != "systematic":
            return None
        return Plan(
            sensor.optics,
            birth.ranges(sensor, self.state_names),
            sensor.intensity_of(birth.snr_db),
            birth.uniform_share if isinstance(birth, MeasurementBirth) else 1.0,
            self._side,
            self.particles,
            self.newborns,
            bool(self._known.views),
        )

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
        alive = (1 - disappears) * state.existence
        born = appears * (1 - state.existence)
        absent = disappears * state.existence + (1 - appears) * (1 - state.existence)
        matrices = step_matrices(self.motion, interval_s)
        if matrices is not None and measurement is not None and self._plan is not None:
            sensor: Any = self.sensor
            frame, draws = sensor.checked(measurement), rng.random(DRAWS)
            masses = Masses(alive, born)
            states, weights, log_present, left, mean, covariance = _step_kernels.step(
                state.particles, state.weights, masses, frame, *matrices, self._plan, draws
            )
            if not math.isnan(log_present):
                existence = _existence(log_present, absent + left)
                return BernoulliState(time_s, existence, states, weights, mean, covariance)

        n = self.particles
        states = self._predicted(state, matrices, interval_s, rng)
        births = self.birth.draw(self.newborns, measurement, self.sensor, self.state_names, rng)
        _fill(states[n:], births.states, "birth")
        log_prior = np.empty(n + self.newborns)
        log_prior[:n] = _log(alive / n)
        log_prior[n:] = births.log_ratio + _log(born / self.newborns)
        if self._known.views:
            stay = allowed_by(self._known.views, states[:n])
            if stay.any():
                log_prior[:n] += stay
                absent += alive * (1 - float(np.exp(stay).sum()) / n)
        if self._known.maps:
            log_prior += allowed_by(self._known.maps, states)
        return self._posterior(time_s, states, log_prior, measurement, absent)

    def _predicted(
        self, state: BernoulliState, matrices: tuple[Array, Array] | None, interval_s: float, rng: Generator
    ) -> Array:
        """Survivors moved on, in front of room for the newborns."""
        n, side = self.particles, self._side
        states, weights, starts = state.particles, state.weights, np.array([0, len(state.weights)])
        if side:
            states, weights, starts = by_cell(states, weights, side)
        survivors = resample(weights, n, rng, self.resampling)
        linear = matrices is not None
        if not linear and not side:
            moved = _kernels.gather(states, survivors, n + self.newborns)
        else:
            d = states.shape[1]
            F, root = matrices or (np.eye(d), np.zeros((d, d)))
            draw = rng.random()
            moved = predict(states, weights, starts, survivors, side > 0, F, root, draw, n + self.newborns)
        if not linear:
            _fill(moved[:n], self.motion.propagate(moved[:n], interval_s, rng), "motion")
        return moved

    def _posterior(
        self, time_s: float, states: Array, log_prior: Array, measurement: Any | None, absent: float
    ) -> BernoulliState:
        log_likelihood = (
            np.zeros(len(states)) if measurement is None else self.sensor.log_likelihood(states, measurement)
        )
        weights, log_present = _kernels.weigh(log_likelihood + log_prior)
        mean, covariance = _kernels.moments(states, weights)
        return BernoulliState(time_s, _existence(log_present, absent), states, weights, mean, covariance)


def _existence(log_present: float, absent: float) -> float:
    log_odds = log_present - _log(absent) if log_present > -math.inf else -math.inf
    return 1 / (1 + math.exp(-log_odds)) if log_odds > LEAST_LOG_ODDS else 0.0


def _fill(rows: Array, states: Array, part: str) -> None:
    if states.shape != rows.shape:
        raise DataError(
            f"{part}: gave states of shape {states.shape}, the filter needs {rows.shape}, one row a particle."
        )
    rows[:] = states


def _log(mass: float) -> float:
    return math.log(mass) if mass > 0 else -math.inf
