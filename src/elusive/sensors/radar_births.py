"""Where a target appears to a radar: uniformly in its view, or where a plot of the scan says.

Births drawn from measurements: Ristic, Clark, Vo and Vo (2012), IEEE Trans. Aerosp. Electron. Syst. 48(2), 1656-1668.
The birth density p_b is uniform over the area in view, its velocity Gaussian; what is drawn about plots carries
``p_b / q_b``, q_b the mixture, over the plots and the uniform share, that it was drawn from.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field
from scipy.special import ndtr

from elusive.contracts import VX, VY, Array, Births, X, Y
from elusive.errors import DataError, ParameterError
from elusive.model import Model, NonNegative, Positive
from elusive.sensors.radar_scans import AT_REST, TURN_RAD, RadarScan
from elusive.sensors.radar_view import RadarView, wrapped


def drawn_about(radar: RadarView, scan: RadarScan, n: int, rng: Generator, speed_sd_mps: float) -> Array:
    """Draw ``n`` states, each of a plot in view taken at random: see :meth:`RadarView.draw_from_plots`."""
    return radar.draw_from_plots(scan, rng.integers(scan.detections, size=n), rng, speed_sd_mps)


class ScanPrior(NamedTuple):
    """The belief before a filter's first measurement, drawn from an earlier scan: a particle filter's prior."""

    radar: RadarView
    scan: RadarScan
    speed_sd_mps: float = 5.0

    def sample(self, n: int, rng: Generator) -> Array:
        """Draw ``n`` states at the scan's time, ``(n, 4)``: see :func:`drawn_about`.

        Raises
        ------
        DataError
            If a plot is no measurement, or none lies in the field of view.
        """
        scan = self.radar.detections_in_view(self.scan)
        if not scan.detections:
            raise DataError(f"scan at {scan.time_s:g} s: has no plot in the field of view; draw from one that has.")
        return drawn_about(self.radar, scan, n, rng, self.speed_sd_mps)


class RadarBirth(Model):
    """Newborn targets near a scan's plots, mixed with uniform ones; the weight is corrected for the proposal."""

    kind: Literal["plots"] = "plots"
    speed_sd_mps: Positive = Field(5.0, description="Deviation of a newborn's velocity on each axis [m/s]")
    uniform_share: float = Field(0.1, gt=0, le=1, description="Share of newborns drawn uniformly over the view")
    acceleration_sd: NonNegative = Field(
        0.01, description="Deviation of a newborn's acceleration, if it has one [m/s^2]"
    )
    turn_rate_sd_deg: NonNegative = Field(
        6.0, description="Deviation of a newborn's turn rate, if it has one [deg / s]"
    )

    def draw(
        self, n: int, measurement: RadarScan | None, sensor: RadarView, state_names: tuple[str, ...], rng: Generator
    ) -> Births:
        """Draw ``n`` newborn states and the logarithm of ``p_b / q_b``; without a plot in view, uniformly.

        Raises
        ------
        ParameterError
            If the sensor has no greatest range, or the state a component that is not known here.
        DataError
            If a plot is no measurement.
        """
        if sensor.max_range_m is None:
            raise ParameterError("max_range_m: is not given; newborns are drawn over the area in view, so give it.")
        places = [state_names.index(name) for name in ("x", "vx", "y", "vy")]
        own = AT_REST if measurement is None else measurement.own
        scan = None if measurement is None else sensor.detections_in_view(measurement)._replace(own=AT_REST)
        plots = 0 if scan is None else scan.detections
        uniform = int(rng.binomial(n, self.uniform_share)) if plots else n
        drawn = self._uniform(uniform, sensor, rng)
        log_ratio = np.zeros(n)
        if scan is not None and plots and self.uniform_share < 1:
            drawn = np.concatenate([drawn, drawn_about(sensor, scan, n - uniform, rng, self.speed_sd_mps)])
            log_birth = self._log_birth(drawn, sensor)
            # what was drawn in view stays there, though its place is rounded
            log_birth[uniform:][~sensor.in_view(drawn[uniform:])] = -np.inf
            about_plots = math.log1p(-self.uniform_share) + self._log_proposal(drawn, scan, sensor)
            log_ratio = log_birth - np.logaddexp(math.log(self.uniform_share) + log_birth, about_plots)
        states = np.empty((n, len(state_names)))
        states[:, places] = drawn + np.array(own)
        for k, name in enumerate(state_names):
            if k not in places:
                states[:, k] = rng.normal(0.0, self._deviation(name), n)
        return Births(states, log_ratio)

    def _deviation(self, name: str) -> float:
        """Deviation of a component other than position and velocity."""
        if name == "turn_rate":
            return math.radians(self.turn_rate_sd_deg)
        if name in ("ax", "ay"):
            return self.acceleration_sd
        raise ParameterError(f"birth: does not know how to draw {name!r}; give the filter a birth that does.")

    def _uniform(self, n: int, sensor: RadarView, rng: Generator) -> Array:
        """States ``(n, 4)`` of the birth density."""
        low, high, half = sensor.limits
        distance = np.sqrt(rng.uniform(low**2, high**2, n))
        bearing = sensor.middle_rad + rng.uniform(-half, half, n)
        vx, vy = rng.normal(0.0, self.speed_sd_mps, (2, n))
        return np.column_stack(
            [sensor.x_m + distance * np.sin(bearing), vx, sensor.y_m + distance * np.cos(bearing), vy]
        )

    def _log_birth(self, states: Array, sensor: RadarView) -> Array:
        """Log of the birth density at states in view."""
        low, high, half = sensor.limits
        area = half * (high**2 - low**2)
        speed = states[:, [VX, VY]] / self.speed_sd_mps
        log_density: Array = -0.5 * (speed**2).sum(axis=1) - math.log(TURN_RAD * self.speed_sd_mps**2 * area)
        return log_density

    def _log_proposal(self, states: Array, scan: RadarScan, sensor: RadarView) -> Array:
        """Log density that :func:`drawn_about` draws states with."""
        low, high, half = sensor.limits
        range_sd, angle_sd, speed_sd = sensor.range_sd_m, sensor.bearing_sd_rad, self.speed_sd_mps
        total = np.full(len(states), -np.inf)
        for time_s, range_m, bearing_rad, doppler_mps in zip(*scan.plots, strict=True):
            then = states.copy()
            then[:, X] += (time_s - scan.time_s) * states[:, VX]
            then[:, Y] += (time_s - scan.time_s) * states[:, VY]
            distance, bearing, along = sensor.measured(then)
            across = then[:, VX] * np.cos(bearing) - then[:, VY] * np.sin(bearing)
            measured = math.isfinite(doppler_mps)
            middle, along_sd = (doppler_mps, sensor.doppler_sd_mps) if measured else (0.0, speed_sd)
            off = float(wrapped(np.asarray(bearing_rad - sensor.middle_rad), TURN_RAD))
            edges = np.array([[-half], [half]]) + TURN_RAD * np.arange(-1, 2)
            in_view = np.diff(ndtr((np.array([low, high]) - range_m) / range_sd)).item()
            in_view *= np.diff(ndtr((edges - off) / angle_sd), axis=0).sum()
            scale = range_sd * angle_sd * along_sd * speed_sd * TURN_RAD**2 * in_view
            squares = ((distance - range_m) / range_sd) ** 2 + ((along - middle) / along_sd) ** 2
            squares += (wrapped(bearing - bearing_rad, TURN_RAD) / angle_sd) ** 2 + (across / speed_sd) ** 2
            density = -0.5 * squares - np.log(scale * len(scan.range_m) * distance)
            total = np.logaddexp(total, np.where(sensor.sees(distance, bearing), density, -np.inf))
        return total
