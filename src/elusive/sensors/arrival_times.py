"""Times of arrival and their differences at several places.

Chan and Ho (1994), IEEE Trans. Signal Process. 42(8), section II: without the time of emission only differences count,
and their noises are correlated. Here that time is summed out: contrasts of the arrivals with independent noises are
as good as all differences together, whichever sensor they are taken to (Shin and Sung, 2002, IEEE Trans. Signal
Process. 50(12), on the equality of the bounds).
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Positive
from elusive.sensors.bearing_sets import checked_rows
from elusive.sensors.placed import LEAST_RANGE_M, PlacedSensors

LIGHT_MPS = 299_792_458.0


class ArrivalSet(NamedTuple):
    """When a signal came in at the sensors; a sensor that took several samples stands there several times."""

    time_s: float
    sensor: NDArray[np.intp]  # (m,) rows of the table of sensors
    arrival_s: Array  # (m,) since the emission or, where that is unknown, since any common instant


class ArrivalTimeSensors(PlacedSensors):
    """Times of arrival at several places; without the time of emission, their differences."""

    kind: Literal["arrivals"] = "arrivals"
    sigma_s: Positive = Field(1e-8, description="Deviation of a sample's time of arrival [s]")
    speed_mps: Positive = Field(LIGHT_MPS, description="Speed of the signal [m/s]")
    emission_known: bool = Field(
        True, description="Whether times count from the emission (TOA); if not, only their differences do (TDOA)"
    )

    def measured(self, states: Array) -> Array:
        """Time from the emission to each sensor without noise, ``(N, n)`` [s]."""
        return self._ranges(states)[0] / self.speed_mps

    def nothing(self, time_s: float) -> ArrivalSet:
        """Return a time without an arrival."""
        return ArrivalSet(time_s, np.empty(0, np.intp), np.empty(0))

    def simulate(self, states: Array, times_s: Array, rng: Generator) -> list[ArrivalSet]:
        """Draw what the sensors report of a path ``(T, d)`` at times ``(T,)`` [s].

        Where the emission is unknown, times count from an instant of each time's own.

        Raises
        ------
        DataError
            If the arrays do not fit each other.
        """
        states, times = self.path(states, times_s)
        sets = []
        for time_s, delay in zip(times.tolist(), self.measured(states), strict=True):
            sensor = self.reporting(rng)
            arrival = delay[sensor] + self.sigma_s * rng.standard_normal(len(sensor))
            emitted = 0.0 if self.emission_known else delay.mean() * rng.uniform(-10, 10)
            sets.append(ArrivalSet(time_s, sensor, arrival + emitted))
        return sets

    def contrasted(self, measurement: object) -> tuple[Array, Array, Array]:
        """Distances, or contrasts of distances, of independent noise.

        Parameters
        ----------
        measurement
            Arrivals of one time, a sensor's samples averaged here.

        Returns
        -------
        tuple
            Weights of the sensors ``(r, n)``, the weighted sum of distances ``(r,)`` [m], and its variance
            ``(r,)`` [m^2]: a row for each sensor or, where the emission is unknown, one fewer.

        Raises
        ------
        DataError
            If an arrival is not finite or its sensor unknown.
        """
        if not isinstance(measurement, ArrivalSet):
            raise DataError(f"arrivals: measurement is {type(measurement).__name__}; give an ArrivalSet.")
        sensor, arrival = checked_rows("arrival", *measurement, len(self.positions_m))
        each, place, count = np.unique(sensor, return_inverse=True, return_counts=True)
        reach = self.speed_mps * np.bincount(place, arrival, len(each)) / count
        variance = (self.speed_mps * self.sigma_s) ** 2 / count
        basis = np.eye(len(each))
        if not self.emission_known and len(each):
            size = float(variance.mean())
            basis = _contrasts(np.sqrt(size / variance))
            # what is common to all is dropped before it drowns the digits of what is not
            reach, variance = basis @ (reach - reach[0]), np.full(len(basis), size)
        weights = np.zeros((len(basis), len(self.positions_m)))
        weights[:, each] = basis
        return weights, reach, variance

    def residual(self, state: Array, measurement: ArrivalSet) -> Array:
        """Distances or their contrasts, measured less expected, ``(m,)`` [m].

        Raises
        ------
        DataError
            If an arrival is not finite or its sensor unknown.
        """
        weights, reach, _ = self.contrasted(measurement)
        return np.asarray(reach - weights @ self._ranges(state[None])[0][0])

    def jacobian(self, state: Array, measurement: ArrivalSet) -> Array:
        """Return the derivative of the expected distances or contrasts, ``(m, d)``."""
        weights, _, _ = self.contrasted(measurement)
        slope = np.zeros((len(weights), len(state)))
        for column, unit in zip(self.place_columns, self._ranges(state[None])[1], strict=True):
            slope[:, column] = weights @ unit[0]
        return slope

    def noise(self, measurement: ArrivalSet) -> Array:
        """Covariance of the distances or contrasts, ``(m, m)`` [m^2]."""
        return np.diag(self.contrasted(measurement)[2])

    def parts(self, measurement: ArrivalSet) -> NDArray[np.intp]:
        """Each distance or contrast strays alone."""
        return np.arange(len(self.contrasted(measurement)[1]))

    def bend(self, state: Array, covariance: Array, measurement: ArrivalSet) -> Array:
        """How far each bends within a belief: half the variance of the place over the range, ``(m,)`` [m]."""
        weights, _, _ = self.contrasted(measurement)
        spread = 0.5 * np.trace(covariance[np.ix_(self.place_columns, self.place_columns)])
        return np.asarray(np.abs(weights) @ (spread / self._ranges(state[None])[0][0]))

    def log_likelihood(self, states: Array, measurement: ArrivalSet) -> Array:
        """Log density of one time's arrivals at each state ``(N, d)``: ``(N,)``, of distances or their contrasts.

        Raises
        ------
        DataError
            If an arrival is not finite or its sensor unknown.
        """
        weights, reach, variance = self.contrasted(measurement)
        error = reach - self._ranges(states)[0] @ weights.T
        return np.asarray(-0.5 * (error**2 / variance + np.log(2 * np.pi * variance)).sum(axis=1))

    def information(self, states: Array) -> Array:
        """Fisher information of one time's arrivals, all sensors reporting ``samples`` each: ``(N, d, d)``."""
        units = self._ranges(states)[1]
        n, d = len(self.positions_m), states.shape[1]
        slope = np.zeros((len(states), n, d))
        for axis, column in enumerate(self.place_columns):
            slope[:, :, column] = units[axis]
        if not self.emission_known:
            slope -= slope.mean(axis=1, keepdims=True)
        weight = self.samples / (self.speed_mps * self.sigma_s) ** 2
        return np.asarray(weight * np.einsum("kni,knj->kij", slope, slope))

    def _ranges(self, states: Array) -> tuple[Array, list[Array]]:
        """Distance from each sensor to each state ``(N, n)``, and its gradient's components."""
        offsets = self.offsets(states)[: self.dimensions]
        ranges = np.maximum(np.sqrt(np.sum(np.square(offsets), axis=0)), LEAST_RANGE_M)
        return ranges, [offset / ranges for offset in offsets]


def _contrasts(scale: Array) -> Array:
    """Rows ``(m - 1, m)`` that are blind to what is common to all; ``scale`` is each noise's inverse deviation."""
    unit = scale / np.linalg.norm(scale)
    mirror = unit.copy()
    # Householder's reflection of the first axis onto the common direction: its other rows are at right angles to that
    mirror[0] += 1.0
    rows = np.eye(len(unit)) - np.outer(mirror, mirror) * (2 / (mirror @ mirror))
    return np.asarray(rows[1:] * scale)
