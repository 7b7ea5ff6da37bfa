"""Directions of arrival at any number of places: azimuth, and elevation where it is measured.

Jiang, Keerativoranan, Matsumoto and Takada (2024), eq. 1, with the noise on the angle and not on its tangent; circular
mean of several samples: Mardia and Jupp (2000), Directional statistics, section 2.2. Azimuths are clockwise from north:
x east, y north. An azimuth at elevation e has the deviation sigma / cos e: the error of a direction is as large across
as upwards.
"""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field, model_validator

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.model import NonNegative, Positive, Probability
from elusive.sensors.bearing_sets import BearingSet, averaged, checked, in_turn
from elusive.sensors.placed import LEAST_RANGE_M, PlacedSensors, Z


class BearingSensors(PlacedSensors):
    """Azimuths, and elevations in three dimensions, of one emitter at several places."""

    kind: Literal["bearings"] = "bearings"
    sigma_deg: Positive = Field(1.0, le=180, description="Deviation of a sample's angle, sigma_phi of table I [deg]")
    sensor_sigma_deg: tuple[Positive, ...] | None = Field(
        None, description="The same, sensor by sensor; none: sigma_deg for each [deg]"
    )
    outlier_probability: Probability = Field(
        0.0, lt=1, description="Probability that a bearing is of something else, in any direction"
    )
    bias_sd_deg: NonNegative = Field(0.0, description="Simulation: deviation of each sensor's constant bias [deg]")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        given = self.sensor_sigma_deg
        if given is not None and len(given) != len(self.positions_m):
            raise ValueError(f"sensor_sigma_deg: has {len(given)} numbers for {len(self.positions_m)} sensors")
        return self

    @property
    def sigmas_rad(self) -> Array:
        """Deviation of each sensor's sample, ``(n,)`` [rad]."""
        return np.deg2rad(self.sensor_sigma_deg or (self.sigma_deg,) * len(self.positions_m))

    def measured(self, states: Array) -> tuple[Array, Array]:
        """Azimuth and elevation [rad] at each sensor without noise, each ``(N, n)``; elevation 0 in two dimensions."""
        east, north, up = self.offsets(states)
        return np.arctan2(east, north), np.arctan2(up, np.hypot(east, north))

    def nothing(self, time_s: float) -> BearingSet:
        """Return a time without a bearing."""
        return BearingSet(time_s, np.empty(0, np.intp), np.empty(0), np.empty(0))

    def standing(self, measurement: BearingSet) -> BearingSensors:
        """Return the sensors where they stood as they took a measurement: themselves, unless they move.

        Raises
        ------
        DataError
            If the places do not fit the bearings.
        """
        if measurement.places_m is None:
            return self
        if measurement.places_m.shape != (len(measurement.sensor), 3) or not np.isfinite(measurement.places_m).all():
            raise DataError(f"bearings at {measurement.time_s:g} s: give each a place of three finite numbers.")
        places = self.places
        places[measurement.sensor] = measurement.places_m
        # of places alone, and thousands of times
        return self.model_copy(update={"positions_m": tuple(map(tuple, places.tolist()))})

    def simulate(self, states: Array, times_s: Array, rng: Generator) -> list[BearingSet]:
        """Draw what the sensors report of a path, a time after another.

        Parameters
        ----------
        states
            ``(T, d)``.
        times_s
            ``(T,)`` [s].
        rng
            Source of noise, misses, outliers and biases.

        Returns
        -------
        list of BearingSet
            ``T`` of them, empty where no sensor reports; a sensor stands in one ``samples`` times.

        Raises
        ------
        DataError
            If the arrays do not fit each other.
        """
        states, times = self.path(states, times_s)
        bias = rng.standard_normal((2, len(self.positions_m))) * np.deg2rad(self.bias_sd_deg)
        azimuths, elevations = self.measured(states)
        sets = []
        for time_s, azimuth, elevation in zip(times.tolist(), azimuths, elevations, strict=True):
            sensor = self.reporting(rng)
            noise = rng.standard_normal((2, len(sensor))) * self.sigmas_rad[sensor] + bias[:, sensor]
            up = elevation[sensor] + noise[1]
            round_ = azimuth[sensor] + noise[0] / np.cos(elevation[sensor])
            stray = rng.random(len(sensor)) < self.outlier_probability
            round_ = np.where(stray, rng.uniform(-np.pi, np.pi, len(sensor)), round_)
            up = np.where(stray, np.arcsin(rng.uniform(-1, 1, len(sensor))), up)
            # past the zenith a direction comes down on the other side
            over = np.cos(up) < 0
            round_, up = np.where(over, round_ + np.pi, round_), np.arcsin(np.sin(up))
            up = up if self.dimensions == 3 else np.full(len(sensor), np.nan)
            sets.append(BearingSet(time_s, sensor, np.mod(round_, 2 * np.pi), up))
        return sets

    def log_likelihood(self, states: Array, measurement: BearingSet) -> Array:
        """Log density of the bearings of one time at each state: of directions on the circle or on the sphere.

        Parameters
        ----------
        states
            ``(N, d)``.
        measurement
            Bearings; an elevation may be NaN, and then says nothing.

        Returns
        -------
        ndarray
            ``(N,)``, of a wrapped Gaussian and, with ``outlier_probability``, a uniform share of strays.

        Raises
        ------
        DataError
            If a bearing is not finite or its sensor unknown.
        """
        sensor, azimuth, elevation = checked(measurement, len(self.positions_m))
        east, north, up = (part[:, sensor] for part in self.standing(measurement).offsets(states))
        level = np.hypot(east, north)
        sigma = self.sigmas_rad[sensor]
        seen = np.isfinite(elevation) & (self.dimensions == 3)
        slant = np.where(seen, np.cos(np.where(seen, elevation, 0.0)), 1.0)
        across = wrapped(azimuth - np.arctan2(east, north)) * slant / sigma
        upwards = np.where(seen, (np.where(seen, elevation, 0.0) - np.arctan2(up, level)) / sigma, 0.0)
        log_norm = -np.log(sigma * math.sqrt(2 * np.pi)) * np.where(seen, 2, 1)
        log_density = log_norm - 0.5 * (across**2 + upwards**2)
        if self.outlier_probability:
            stray = np.log(self.outlier_probability) - np.log(np.where(seen, 4 * np.pi, 2 * np.pi))
            log_density = np.logaddexp(math.log1p(-self.outlier_probability) + log_density, stray)
        return np.asarray(log_density.sum(axis=1))

    def averaged(self, measurement: BearingSet) -> tuple[NDArray[np.intp], Array, Array, Array]:
        """Sensor, azimuth, elevation [rad] and variance [rad^2] of one time, each sensor once.

        Raises
        ------
        DataError
            If a bearing cannot be used.
        """
        sensor, azimuth, elevation, count = averaged(measurement, len(self.positions_m))
        if self.dimensions == 2:
            elevation = np.full(len(sensor), np.nan)
        return sensor, azimuth, elevation, self.sigmas_rad[sensor] ** 2 / count

    def residual(self, state: Array, measurement: BearingSet) -> Array:
        """Angles between measured and expected directions, across and upwards of each sensor in turn, ``(m,)`` [rad].

        Raises
        ------
        DataError
            If a bearing cannot be used.
        """
        sensor, azimuth, elevation, _ = self.averaged(measurement)
        east, north, up = (part[0, sensor] for part in self.standing(measurement).offsets(state[None]))
        slant = np.where(np.isfinite(elevation), np.cos(elevation), 1.0)
        across = wrapped(azimuth - np.arctan2(east, north)) * slant
        return in_turn(across, elevation - np.arctan2(up, np.hypot(east, north)), elevation)

    def jacobian(self, state: Array, measurement: BearingSet) -> Array:
        """Return the derivative of the expected angles, ``(m, d)``."""
        sensor, _, elevation, _ = self.averaged(measurement)
        across, upwards = (slope[0, sensor] for slope in self.standing(measurement)._slopes(state[None]))
        slant = np.where(np.isfinite(elevation), np.cos(elevation), 1.0)
        return in_turn(across * slant[:, None], upwards, elevation)

    def noise(self, measurement: BearingSet) -> Array:
        """Covariance of the angles, ``(m, m)`` [rad^2]."""
        _, _, elevation, variance = self.averaged(measurement)
        return np.diag(in_turn(variance, variance, elevation))

    def parts(self, measurement: BearingSet) -> NDArray[np.intp]:
        """Sensor of each angle: an azimuth and an elevation stray together."""
        sensor, _, elevation, _ = self.averaged(measurement)
        return in_turn(sensor, sensor, elevation)

    def bend(self, state: Array, covariance: Array, measurement: BearingSet) -> Array:
        """How far each angle bends within a belief, half the variance of the place over the range squared, ``(m,)``."""
        sensor, _, elevation, _ = self.averaged(measurement)
        places = self.place_columns
        squared = (
            sum(offset[0, sensor] ** 2 for offset in self.standing(measurement).offsets(state[None])) + LEAST_RANGE_M**2
        )
        bend = np.asarray(0.5 * np.trace(covariance[np.ix_(places, places)]) / squared)
        return in_turn(bend, bend, elevation)

    def information(self, states: Array) -> Array:
        """Fisher information of one time's bearings, all sensors reporting ``samples`` each: ``(N, d, d)``.

        For :func:`elusive.metrics.posterior_bound`; outliers and biases are left out.
        """
        across, upwards = self._slopes(states)
        weight = self.samples / self.sigmas_rad**2
        if self.dimensions == 2:
            return np.asarray(np.einsum("n,kni,knj->kij", weight, across, across))
        across = across * np.cos(self.measured(states)[1])[:, :, None]
        return np.asarray(sum(np.einsum("n,kni,knj->kij", weight, slope, slope) for slope in (across, upwards)))

    def _slopes(self, states: Array) -> tuple[Array, Array]:
        """Slopes of azimuth and elevation at each sensor, ``(N, n, d)`` each; of elevation 0 in the plane."""
        east, north, up = self.offsets(states)
        azimuth, elevation = (np.zeros((*east.shape, states.shape[1])) for _ in range(2))
        level2 = np.maximum(east**2 + north**2, LEAST_RANGE_M**2)
        azimuth[:, :, X], azimuth[:, :, Y] = north / level2, -east / level2
        if self.dimensions == 3:
            level, range2 = np.sqrt(level2), level2 + up**2
            elevation[:, :, X], elevation[:, :, Y] = -up * east / (level * range2), -up * north / (level * range2)
            elevation[:, :, Z] = level / range2
        return azimuth, elevation


def wrapped(angle_rad: Array) -> Array:
    """Angles from -pi to below pi."""
    return np.asarray((angle_rad + np.pi) % (2 * np.pi) - np.pi)
