"""What a radar sees: its place, its errors, its field of view, and states drawn from a plot.

Measurements of Bootsveld (2012), section 5.1.1, whose Doppler has the other sign. Range and Doppler are Gaussian about
their exact values and the bearing is wrapped, so that the banana-shaped error of a place is right at any range; what
falls outside the field of view, a negative range for one, is cut off.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Self

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from elusive.contracts import VX, VY, Array, X, Y
from elusive.errors import DataError, ParameterError
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive
from elusive.sensors.radar_scans import AT_REST, TURN_RAD, RadarPlot, RadarScan


class RadarView(Model):
    """Range, bearing (clockwise from north; x east, y north) and range rate, with their errors and limits."""

    x_m: float = Field(0.0, description="East of the origin, the radar's place [m]", json_schema_extra=FROM_RECORDING)
    y_m: float = Field(0.0, description="North of the origin, the radar's place [m]", json_schema_extra=FROM_RECORDING)
    range_sd_m: Positive = Field(10.0, description="Deviation of a range, sigma_r [m]")
    bearing_sd_mrad: Positive = Field(1.0, le=500, description="Deviation of a bearing, sigma_b [mrad]")
    doppler_sd_mps: Positive = Field(3.0, description="Deviation of a range rate, sigma_d [m/s]")
    min_range_m: NonNegative = Field(0.0, description="Least range in view [m]")
    max_range_m: Positive | None = Field(
        None, description="Greatest range in view; none: no limit. Needed with false alarms [m]"
    )
    from_bearing_deg: float = Field(0.0, ge=0, lt=360, description="Sector in view, clockwise from this bearing [deg]")
    to_bearing_deg: float = Field(360.0, gt=0, le=360, description="Sector in view, clockwise to this bearing [deg]")

    @model_validator(mode="after")
    def _wide_enough(self) -> Self:
        self._check_view()
        return self

    def _check_view(self) -> None:
        low, high, half = self.limits
        if not high - low >= self.range_sd_m:
            raise ParameterError(
                f"max_range_m: the view from {low:g} to {high:g} m is narrower than range_sd_m={self.range_sd_m:g}; "
                "give a greater range."
            )
        if not 2 * half >= self.bearing_sd_rad:
            raise ParameterError(
                f"to_bearing_deg: the sector from {self.from_bearing_deg:g} to {self.to_bearing_deg:g} degrees is "
                "narrower than the bearing's deviation; give a wider one (0 to 360 is all round)."
            )

    def measured(self, states: Array) -> tuple[Array, Array, Array]:
        """Range [m], bearing [rad] and range rate [m/s] of each state without noise, each ``(N,)``."""
        east, north = states[:, X] - self.x_m, states[:, Y] - self.y_m
        distance, bearing = np.hypot(east, north), np.arctan2(east, north)
        return distance, bearing, np.sin(bearing) * states[:, VX] + np.cos(bearing) * states[:, VY]

    def residual(self, state: Array, measurement: RadarScan | RadarPlot) -> Array:
        """Range, bearing and Doppler, measured less expected, of a plot known to be the target's; without one, nothing.

        Raises
        ------
        DataError
            If it is no measurement, or a scan of several plots: which is the target's is for a tracker to say.
        """
        z, _ = self._plot(measurement)
        error = z - np.array(self.measured(seen_from(measurement, state[None])))[: len(z), 0]
        error[1:2] = wrapped(error[1:2], TURN_RAD)
        return np.asarray(error)

    def jacobian(self, state: Array, measurement: RadarScan | RadarPlot) -> Array:
        """Return the derivative of what is expected, ``(m, d)``."""
        z, _ = self._plot(measurement)
        state = seen_from(measurement, state[None])[0]
        distance, bearing, _ = (float(part[0]) for part in self.measured(state[None]))
        distance, sin, cos = max(distance, 1e-9), math.sin(bearing), math.cos(bearing)
        turning = (cos * state[VX] - sin * state[VY]) / distance
        H = np.zeros((3, len(state)))
        H[0, [X, Y]], H[1, [X, Y]] = (sin, cos), (cos / distance, -sin / distance)
        H[2, [X, Y]], H[2, [VX, VY]] = (cos * turning, -sin * turning), (sin, cos)
        return H[: len(z)]

    def noise(self, measurement: RadarScan | RadarPlot) -> Array:
        """Covariance of range, bearing and Doppler, ``(m, m)``."""
        return np.diag(self._plot(measurement)[1] ** 2)

    def _plot(self, measurement: RadarScan | RadarPlot) -> tuple[Array, Array]:
        scan = self.detections_in_view(measurement)
        if len(scan.range_m) > 1:
            raise DataError(
                f"scan at {scan.time_s:g} s: has {len(scan.range_m)} plots; give a Gaussian filter the target's alone, "
                "or take a tracker."
            )
        z = np.array([*scan.range_m, *scan.bearing_rad, *scan.doppler_mps[np.isfinite(scan.doppler_mps)]])
        return z, np.array([self.range_sd_m, self.bearing_sd_rad, self.doppler_sd_mps])[: len(z)]

    def scattered(self, range_m: Array, bearing_rad: Array, rng: Generator) -> tuple[Array, Array]:
        """Draw ranges [m] and bearings [rad] about places in view, with the radar's errors but within its view."""

        def drawn(centre: Array, sd: float, seen: Callable[[Array], NDArray[np.bool_]]) -> Array:
            values = rng.normal(centre, sd)
            while (out := ~seen(values)).any():
                values[out] = rng.normal(centre[out], sd)
            return values

        distance = drawn(range_m, self.range_sd_m, lambda v: self.sees(v, self.middle_rad))
        return distance, drawn(bearing_rad, self.bearing_sd_rad, lambda v: self.sees(distance, v))

    def detections_in_view(self, measurement: RadarScan | RadarPlot) -> RadarScan:
        """Check a scan, or a plot alone, and leave out the plots that lie out of the field of view.

        Raises
        ------
        DataError
            As :meth:`judged`.
        """
        return self.judged(measurement)[0]

    def judged(self, measurement: RadarScan | RadarPlot) -> tuple[RadarScan, NDArray[np.bool_]]:
        """Return a scan's plots in view, and which of all they are, ``(m,)``.

        Raises
        ------
        DataError
            If the arrays differ in length, a number is not finite (a Doppler may be NaN), a range is below zero or a
            bearing not from 0 to below 2 pi.
        """
        from elusive.sensors._radar_kernels import judge

        scan = measurement
        if isinstance(measurement, RadarPlot):
            scan = RadarScan(measurement.time_s, *np.array(measurement[:4], dtype=np.float64)[:, None])
        if not isinstance(scan, RadarScan):
            raise DataError(f"radar: measurement is {type(scan).__name__}; give a RadarScan or a RadarPlot.")
        table = [np.ascontiguousarray(part, dtype=np.float64) for part in scan.plots]
        finite = math.isfinite(scan.time_s + sum(scan.own))
        if not (finite and all(part.shape == (table[0].size,) for part in table)):
            raise DataError(
                f"scan at {scan.time_s:g} s: needs a finite time and place of its radar, and arrays that hold a number "
                "for each plot."
            )
        low, high, half = self.limits
        bad, count, inside = judge(tuple(table), scan.time_s, low, high, self.middle_rad, half)
        if bad >= 0:
            times_s, range_m, bearing_rad, doppler_mps = (part[bad] for part in table)
            raise DataError(
                f"scan at {scan.time_s:g} s, plot {bad}: time {times_s:g} s, range {range_m:g} m, bearing "
                f"{bearing_rad:g} rad, Doppler {doppler_mps:g} m/s; give a finite time, a range from 0, a "
                "bearing from 0 to below 2 pi, and a Doppler or NaN."
            )
        kept = table if count == inside.size else [part[inside] for part in table]
        return RadarScan(float(scan.time_s), *kept)._replace(own=scan.own), inside

    def places(self, scan: RadarScan) -> tuple[Array, Array]:
        """Where plots lie, ``(m, 2)`` x and y [m], and the covariances of their errors, ``(m, 2, 2)``."""
        sin, cos = np.sin(scan.bearing_rad), np.cos(scan.bearing_rad)
        along, across = np.stack([sin, cos], axis=-1), np.stack([cos, -sin], axis=-1)
        axes = np.stack([self.range_sd_m * along, (self.bearing_sd_rad * scan.range_m)[:, None] * across], axis=-1)
        x, vx, y, vy = scan.own
        later = (scan.times_s - scan.time_s)[:, None]
        radar = np.array([self.x_m + x, self.y_m + y]) + later * np.array([vx, vy])
        return radar + scan.range_m[:, None] * along, axes @ axes.transpose(0, 2, 1)

    def gate(
        self, means: Array, covariances: Array, measurement: RadarScan | RadarPlot, deviations: float
    ) -> NDArray[np.bool_]:
        """Whether plots lie within so many deviations of targets, ``(T, d), (T, d, d) -> (T, m)``.

        A target of unknown velocity may be anywhere by the time of a plot that comes later in its scan.
        """
        scan = measurement if isinstance(measurement, RadarScan) else self.judged(measurement)[0]
        places, errors = self.places(scan)
        later = scan.times_s - scan.time_s
        off = places - means[:, None, [X, Y]] - later[:, None] * means[:, None, [VX, VY]]
        drift = covariances[:, [VX, VY], [VX, VY]].max(axis=1)[:, None] * later**2
        xx = covariances[:, None, X, X] + errors[:, 0, 0] + drift
        yy = covariances[:, None, Y, Y] + errors[:, 1, 1] + drift
        xy = covariances[:, None, X, Y] + errors[:, 0, 1]
        squared = yy * off[..., 0] ** 2 - 2 * xy * off[..., 0] * off[..., 1] + xx * off[..., 1] ** 2
        return np.asarray(squared <= deviations**2 * (xx * yy - xy**2))

    def draw_from_plots(
        self, scan: RadarScan, of: NDArray[np.int64], rng: Generator, speed_sd_mps: float = 5.0
    ) -> Array:
        """Draw states that explain plots in view, ``(n,)`` their numbers, within the radar's errors and its view.

        The velocity along the line of sight is the Doppler's; across, and where there is none, Gaussian about zero.

        Returns
        -------
        ndarray
            ``(n, 4)`` x, vx, y, vy at the scan's time.
        """
        from elusive.sensors._radar_kernels import states_of_plots

        low, high, half = self.limits
        field = low, high, self.middle_rad, half
        sd = self.range_sd_m, self.bearing_sd_rad, self.doppler_sd_mps, speed_sd_mps
        origin = float(self.x_m), float(self.y_m)
        states = states_of_plots(scan.plots, np.asarray(of), scan.time_s, origin, sd, field, rng)
        return states if scan.own == AT_REST else states + np.array(scan.own)

    @cached_property
    def bearing_sd_rad(self) -> float:
        """Deviation of a bearing [rad]."""
        return self.bearing_sd_mrad / 1000

    @cached_property
    def middle_rad(self) -> float:
        """Bearing of the middle of the sector in view [rad]."""
        return math.radians(self.from_bearing_deg) + self.limits[2]

    @cached_property
    def limits(self) -> tuple[float, float, float]:
        """Least and greatest range, and half the width of the sector [rad]; pi is all round."""
        width = self.to_bearing_deg - self.from_bearing_deg
        half = math.pi if width == 360 else math.radians(width % 360 / 2)
        return float(self.min_range_m), math.inf if self.max_range_m is None else self.max_range_m, half

    def in_view(self, states: Array) -> NDArray[np.bool_]:
        """Whether states lie in the field of view, ``(N,)``."""
        return self.sees(*self.measured(states)[:2])

    def log_in_view(self, states: Array) -> Array:
        """0 of a state in the field of view, minus infinity of any other, ``(N, d) -> (N,)``."""
        return np.where(self.in_view(states), 0.0, -np.inf)

    def sees(self, range_m: ArrayLike, bearing_rad: ArrayLike) -> NDArray[np.bool_]:
        """Whether places lie in the field of view, ``(N,)``."""
        low, high, half = self.limits
        distance = np.asarray(range_m)
        off = np.abs(wrapped(np.asarray(bearing_rad) - self.middle_rad, TURN_RAD))
        return (distance >= low) & (distance <= high) & ((off <= half) | (half == math.pi))


def wrapped(values: Array, period: float) -> Array:
    """Bring values to within half a period of zero."""
    return values - period * np.floor(values / period + 0.5)


def seen_from(measurement: RadarScan | RadarPlot, states: Array) -> Array:
    """Return states as a radar that moves sees them: place and velocity less its own, ``(N, d) -> (N, d)``."""
    if isinstance(measurement, RadarPlot) or measurement.own == AT_REST:
        return states
    moved = np.array(states, dtype=np.float64, order="F")
    moved[:, :4] -= np.array(measurement.own)
    return moved


def check_finite(states: Array) -> None:
    """Refuse states that lack a component or have one that is no finite number."""
    if states.ndim != 2 or states.shape[1] < 4:
        raise DataError(f"states: have shape {states.shape}; give one row a state, beginning x, vx, y, vy.")
    if not math.isfinite(float(states[:, :4].sum())):
        raise DataError("states: a component is not finite; leave out the rows of targets that are absent.")
