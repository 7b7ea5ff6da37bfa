"""Bearings and times of arrival of one emitter, taken together."""

from __future__ import annotations

from typing import Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field, model_validator
from scipy.linalg import block_diag

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model
from elusive.sensors.arrival_times import ArrivalSet, ArrivalTimeSensors
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearings import BearingSensors


class HybridSet(NamedTuple):
    """Bearings and arrivals of one emitter at one time."""

    time_s: float
    bearings: BearingSet
    arrivals: ArrivalSet


class HybridSensors(Model):
    """Bearings and times of arrival together, at the same places or at others."""

    kind: Literal["hybrid"] = "hybrid"
    bearings: BearingSensors = Field(description="Where and how well directions are measured")
    arrivals: ArrivalTimeSensors = Field(description="Where and how well times of arrival are measured")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.bearings.dimensions != self.arrivals.dimensions:
            raise ValueError("bearings, arrivals: give both 2 or both 3 dimensions")
        return self

    @property
    def dimensions(self) -> Literal[2, 3]:
        """2 in the plane, 3 with heights."""
        return self.bearings.dimensions

    @property
    def positions_m(self) -> tuple[tuple[float, float, float], ...]:
        """Places of those that measure directions, then of the others [m]."""
        return self.bearings.positions_m + self.arrivals.positions_m

    @property
    def places(self) -> Array:
        """The same, ``(n, 3)``."""
        return np.array(self.positions_m)

    def nothing(self, time_s: float) -> HybridSet:
        """Return a time without a measurement."""
        return HybridSet(time_s, self.bearings.nothing(time_s), self.arrivals.nothing(time_s))

    def simulate(self, states: Array, times_s: Array, rng: Generator) -> list[HybridSet]:
        """Draw what both report of a path ``(T, d)`` at times ``(T,)`` [s].

        Raises
        ------
        DataError
            If the arrays do not fit each other.
        """
        both = (self.bearings.simulate(states, times_s, rng), self.arrivals.simulate(states, times_s, rng))
        return [HybridSet(angles.time_s, angles, times) for angles, times in zip(*both, strict=True)]

    def log_likelihood(self, states: Array, measurement: HybridSet) -> Array:
        """Log density of both at each state ``(N, d)``: ``(N,)``.

        Raises
        ------
        DataError
            If one of them cannot be used.
        """
        angles = self.bearings.log_likelihood(states, measurement.bearings)
        return angles + self.arrivals.log_likelihood(states, measurement.arrivals)

    def residual(self, state: Array, measurement: HybridSet) -> Array:
        """Angles [rad], then distances or their contrasts [m], measured less expected, ``(m,)``."""
        return np.concatenate(self._both("residual", measurement, state))

    def jacobian(self, state: Array, measurement: HybridSet) -> Array:
        """Return the derivative of what is expected, ``(m, d)``."""
        return np.concatenate(self._both("jacobian", measurement, state))

    def noise(self, measurement: HybridSet) -> Array:
        """Covariance of both, ``(m, m)``."""
        return np.asarray(block_diag(*self._both("noise", measurement)))

    def parts(self, measurement: HybridSet) -> NDArray[np.intp]:
        """Return the number of the bearing or arrival that each component belongs to."""
        angles, times = self._both("parts", measurement)
        return np.concatenate([angles, len(self.bearings.positions_m) + times])

    def bend(self, state: Array, covariance: Array, measurement: HybridSet) -> Array:
        """How far each bends within a belief, ``(m,)``."""
        return np.concatenate(self._both("bend", measurement, state, covariance))

    def _both(self, name: str, measurement: HybridSet, *before: Array) -> list[Array]:
        if not isinstance(measurement, HybridSet):
            raise DataError(f"measurement: is {type(measurement).__name__}; give a HybridSet to hybrid sensors.")
        pairs = (self.bearings, measurement.bearings), (self.arrivals, measurement.arrivals)
        return [getattr(sensor, name)(*before, part) for sensor, part in pairs]

    def information(self, states: Array) -> Array:
        """Fisher information of both, ``(N, d, d)``."""
        return self.bearings.information(states) + self.arrivals.information(states)
