"""A radar's scans of plots, with missed detections and false alarms, or a plot alone.

A plot alone: Bootsveld (2012), section 5.1.1. A scan: Mahler (2007), Statistical multisource-multitarget information
fusion, chapter 12: one target at most among Poisson false alarms. With g the density of the plot of a detected target
at x, and lambda the density of false alarms, a scan Z has the ratio

    l(Z | x) = 1 - P_D(x) + P_D(x) sum over z in Z of g(z | x) / lambda(z)

of target against none; P_D(x) is P_D in the field of view and zero outside of it. g integrates to one over the field.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Literal, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field, model_validator

from elusive.contracts import Array, DetectionBirths
from elusive.errors import DataError, ParameterError
from elusive.model import FROM_RECORDING, NonNegative, Positive, Probability
from elusive.sensors.alarm_patches import Patch
from elusive.sensors.false_alarms import FalseAlarms
from elusive.sensors.radar_scans import TURN_RAD, RadarPlot, RadarScan, scan_of
from elusive.sensors.radar_view import RadarView, check_finite, seen_from, wrapped

FAINTEST = -600.0  # log density of a plot that may lie anywhere, without bounds


class RadarSensor(RadarView):
    """Plots of one target, if it is detected, among false alarms.

    A plot has its own time: the target is taken to move straight between the scan's time and that. The states, and
    the field of view for them, are at the scan's time.
    """

    kind: Literal["radar"] = "radar"
    detection_probability: Probability = Field(1.0, description="Probability that a scan sees the target, P_D")
    false_alarms: NonNegative = Field(0.0, description="Mean number of false alarms a scan, uniform over Doppler")
    false_alarm_shares: tuple[Positive, ...] = Field(
        (1.0,),
        min_length=1,
        max_length=12,
        description="Their shares in bands of range, each twice as wide as the one nearer; one: uniform over range",
    )
    false_alarm_sectors: tuple[Positive, ...] = Field(
        (1.0,),
        min_length=1,
        max_length=36,
        description="Their shares in equal sectors of the view, clockwise from its beginning; one: uniform",
    )
    false_alarm_patches: tuple[Patch, ...] = Field(
        (),
        description="Patches of more of them, beside that number: nearest and furthest range [m], first and last "
        "bearing clockwise [deg], and how many a scan has",
        json_schema_extra=FROM_RECORDING,
    )
    doppler_probability: Probability = Field(1.0, description="Simulation: probability that a plot has a Doppler")
    max_doppler_mps: Positive | None = Field(
        None,
        description="Greatest range rate told apart, either sign: beyond it Doppler folds; none: it does not. "
        "Needed where false alarms have Doppler [m/s]",
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self._check_range()
        for place, (near, far, *_, number) in enumerate(self.false_alarm_patches or ()):
            if not (0 <= near < far and number > 0 and self.false_alarms != 0):
                raise ParameterError(
                    f"false_alarm_patches.{place}: a patch is a nearest range, a greater furthest one, two bearings "
                    "and a number above zero, beside false_alarms above zero."
                )
        if self.max_doppler_mps is not None and self.max_doppler_mps < 2 * math.pi * self.doppler_sd_mps:
            raise ParameterError(
                f"max_doppler_mps: {self.max_doppler_mps:g} m/s is less than 2 pi doppler_sd_mps, too narrow to tell a "
                "range rate from a folded one; give a greater one, or none."
            )
        return self

    def _check_range(self) -> None:
        if self.false_alarms and self.max_range_m is None:
            raise ParameterError(
                "max_range_m: is not given; false alarms are uniform up to it, so give it or false_alarms=0."
            )

    def log_likelihood(self, states: Array, measurement: RadarScan | RadarPlot) -> Array:
        """Log likelihood ratio of one target at each state against none; without false alarms, the log likelihood.

        Without false alarms a scan has one plot at most, with density ``P_D g(z | x)``, or none, ``1 - P_D(x)``.
        Plots out of the field of view are left out. A NaN Doppler says nothing.

        Parameters
        ----------
        states
            ``(N, d)`` at the scan's time; x, vx, y, vy first [m, m/s].
        measurement
            A scan, or a plot alone [m, rad, m/s].

        Returns
        -------
        ndarray
            ``(N,)``.

        Raises
        ------
        DataError
            If a plot is no measurement, a state not finite, or several plots come without false alarms.
        ParameterError
            If a plot has a Doppler, and that of false alarms is not known.
        """
        scan = self.detections_in_view(measurement)
        if scan.detections > 1 and not self.false_alarms:
            raise DataError(
                f"scan at {scan.time_s:g} s: holds {scan.detections} plots, and without false alarms one target makes "
                "one at most; give false_alarms."
            )
        check_finite(states)
        log_scale = log_doppler = 0.0
        if self.false_alarms:
            log_scale, log_doppler = self._log_volumes(scan)
            log_scale -= math.log(self.false_alarms)
        table = self._table(scan, log_scale + _log(self.detection_probability), log_doppler)
        if self.false_alarms:
            from elusive.sensors._radar_kernels import LOG_SCALE

            table[:, LOG_SCALE] -= self._alarms.log_relative(scan.range_m, scan.bearing_rad)
        return self._log_ratio(
            seen_from(scan, states), table, _log(1 - self.detection_probability), clutter=self.false_alarms > 0
        )

    def detection_probabilities(self, states: Array, measurement: RadarScan | RadarPlot) -> Array:
        """Probability that a scan sees a target at each state, ``(N, d) -> (N,)``: P_D in view, else 0."""
        from elusive.sensors._radar_kernels import seen_with

        states = seen_from(measurement, states)
        return seen_with(states, (float(self.x_m), float(self.y_m)), self._field, float(self.detection_probability))

    def log_densities(
        self, states: Array, measurement: RadarScan | RadarPlot, which: NDArray[np.int64] | None = None
    ) -> Array:
        """Log density of plots, all or some, if each is that of a target at each state, ``(N, d) -> (N, k)``.

        Minus infinity for states and plots out of the field of view. Raises as :meth:`log_likelihood`.
        """
        scan, inside = self.judged(measurement if which is None else _selected(measurement, which))
        check_finite(states)
        table, states = self._table(scan, 0.0, 0.0), seen_from(scan, states)
        found = np.full((len(inside), len(states)), -np.inf)
        for row, column in enumerate(np.flatnonzero(inside)):
            found[column] = self._log_ratio(states, table[row : row + 1], -math.inf, clutter=False)
        return found.T

    def draw_births(
        self,
        measurement: RadarScan | RadarPlot,
        which: NDArray[np.int64],
        n: int,
        speed_sd_mps: float,
        rng: Generator,
    ) -> DetectionBirths:
        """Draw new targets that made some plots, as uniform in view as false alarms; none out of view.

        See :meth:`~elusive.contracts.DetectionSensor.draw_births` and :meth:`RadarView.draw_from_plots`.
        """
        scan, inside = self.judged(_selected(measurement, which))
        states = self.draw_from_plots(scan, np.repeat(np.arange(scan.detections), n), rng, speed_sd_mps)
        states = states.reshape(-1, n, 4)  # as they lie in memory, column by column
        if not inside.all():
            states, drawn = np.zeros((4, len(which), n)).transpose(1, 2, 0), states
            states[inside] = drawn
        log_density = np.full(len(inside), -np.inf)
        # a view without bounds has plots of new targets too, however thinly they are spread
        log_density[inside] = self.log_uniform(scan).clip(FAINTEST)
        return DetectionBirths(states, log_density, np.full((len(which), n), 1 / n))

    def log_uniform(self, measurement: RadarScan | RadarPlot) -> Array:
        """Log density of a plot that lies anywhere in view, with any Doppler, at each plot, ``(m,)``.

        Minus infinity out of view, and everywhere where the view has no bounds.

        Raises
        ------
        ParameterError
            If a plot has a Doppler, there are false alarms, and their greatest is not known.
        """
        scan, inside = self.judged(measurement)
        volume, doppler_volume = self._log_volumes(scan)
        found = np.full(len(inside), -np.inf)
        found[inside] = -volume - np.where(np.isfinite(scan.doppler_mps), doppler_volume, 0.0)
        return found

    def log_clutter(self, measurement: RadarScan | RadarPlot) -> Array:
        """Log density of false alarms at each plot, ``(m,)``; minus infinity where there are none."""
        if not self.false_alarms:
            return np.full(len(self.judged(measurement)[1]), -np.inf)
        relative = self._alarms.log_relative(np.atleast_1d(measurement.range_m), np.atleast_1d(measurement.bearing_rad))
        return math.log(self.false_alarms) + self.log_uniform(measurement) + relative

    def simulate(self, states: Array, rng: Generator, time_s: float = 0.0) -> RadarScan:
        """Draw a scan, its plots in the order of bearing and all at one time; targets out of view are not seen.

        Parameters
        ----------
        states
            ``(N, d)``, a row a target; ``(0, d)``: false alarms alone.
        rng
            Source of the noise.
        time_s
            Time of the scan.

        Raises
        ------
        DataError
            If a state is not finite.
        ParameterError
            If false alarms have Doppler, and their greatest is not known.
        """
        check_finite(states)
        distance, bearing, doppler = self.measured(states)
        seen = self.sees(distance, bearing) & (rng.random(len(states)) < self.detection_probability)
        distance, bearing = self.scattered(distance[seen], bearing[seen], rng)
        plots = np.stack([distance, bearing, rng.normal(doppler[seen], self.doppler_sd_mps)])
        if self.false_alarms:
            fold = self._greatest_doppler("simulation") if self.doppler_probability else 0.0
            false = self._alarms.draw(rng, fold)
            plots = np.concatenate([plots, false[:, self.sees(*false[:2])]], axis=1)
        distance, bearing, doppler = plots[:, np.argsort(plots[1] % TURN_RAD)]
        if self.max_doppler_mps is not None:
            doppler = wrapped(doppler, 2 * self.max_doppler_mps)
        doppler = np.where(rng.random(len(doppler)) < self.doppler_probability, doppler, np.nan)
        bearing %= TURN_RAD
        bearing[bearing == TURN_RAD] = 0.0  # just below zero it is rounded to a whole turn
        return RadarScan(time_s, np.full(len(bearing), time_s), distance, bearing, doppler)

    def _log_ratio(self, states: Array, table: Array, log_missed: float, *, clutter: bool) -> Array:
        from elusive.sensors._radar_kernels import scan_log_ratio

        sd = self.range_sd_m, self.bearing_sd_rad
        fold = 2 * self.max_doppler_mps if self.max_doppler_mps is not None else 0.0
        return scan_log_ratio(
            states, (float(self.x_m), float(self.y_m)), table, sd, fold, self._field, log_missed, clutter
        )

    @cached_property
    def _field(self) -> tuple[float, float, float, float, float]:
        """The field of view as kernels take it."""
        low, high, half = self.limits
        return low, high, math.sin(self.middle_rad), math.cos(self.middle_rad), half

    @cached_property
    def _alarms(self) -> FalseAlarms:
        """Where false alarms lie."""
        low, high, half = self.limits
        where = self.false_alarm_shares, self.false_alarm_sectors, self.false_alarm_patches
        return FalseAlarms(low, high, self.middle_rad, half, self.false_alarms, *where)

    def _table(self, scan: RadarScan, log_scale: float, log_doppler: float) -> Array:
        """Rows of plots as the kernel takes them, each with the logarithm of its constant factor."""
        from elusive.sensors._radar_kernels import tabulate

        log_scale -= math.log(TURN_RAD * self.range_sd_m * self.bearing_sd_rad)
        log_doppler -= math.log(self.doppler_sd_mps) + 0.5 * math.log(TURN_RAD)
        return tabulate(scan.plots, scan.time_s, self.doppler_sd_mps, log_scale, log_doppler)

    def _log_volumes(self, scan: RadarScan) -> tuple[float, float]:
        """Logarithms of what a plot in view can be: range times bearing, and Doppler where the scan has any."""
        doppler = np.isfinite(scan.doppler_mps).any()
        widest = 1.0
        if doppler and self.false_alarms:
            widest = 2 * self._greatest_doppler(f"scan at {scan.time_s:g} s")
        elif doppler:
            widest = 2 * (self.max_doppler_mps or math.inf)
        return self._alarms.log_volume, math.log(widest)

    def _greatest_doppler(self, where: str) -> float:
        if self.max_doppler_mps is None:
            raise ParameterError(
                f"{where}: false alarms have Doppler, uniform up to max_doppler_mps; give it, or leave Doppler out."
            )
        return self.max_doppler_mps


def _selected(measurement: RadarScan | RadarPlot, which: NDArray[np.int64]) -> RadarScan:
    """Return a scan with some of its plots."""
    if isinstance(measurement, RadarPlot):
        measurement = scan_of(measurement.time_s, [measurement])
    return measurement.select_detections(which)


def _log(probability: float) -> float:
    return math.log(probability) if probability > 0 else -math.inf
