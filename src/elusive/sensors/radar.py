"""A radar's scans of plots, with missed detections and false alarms, or a plot alone.

A plot alone: Bootsveld (2012), section 5.1.1. A scan: Mahler (2007), Statistical multisource-multitarget information
fusion, chapter 12: one target at most among Poisson false alarms. With g the density of the plot of a detected target
at x, and lambda the density of false alarms, a scan Z has the ratio

    l(Z | x) = 1 - P_D(x) + P_D(x) sum over z in Z of g(z | x) / lambda(z)

of target against none; P_D(x) is P_D in the field of view and zero outside of it. g integrates to one over the field.
Of a plot that other targets claim, c times the density of false alarms, lambda becomes lambda (1 + c): Musicki and La
Scala (2008), IEEE Trans. Aerosp. Electron. Syst. 44(3), 877-896.
"""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.model import NonNegative, Positive, Probability
from elusive.sensors.radar_scans import TURN_RAD, RadarPlot, RadarScan
from elusive.sensors.radar_view import RadarView, check_finite, wrapped


class RadarSensor(RadarView):
    """Plots of one target, if it is detected, among false alarms.

    A plot has its own time: the target is taken to move straight between the scan's time and that. The states, and
    the field of view for them, are at the scan's time.
    """

    kind: Literal["radar"] = "radar"
    detection_probability: Probability = Field(1.0, description="Probability that a scan sees the target, P_D")
    false_alarms: NonNegative = Field(
        0.0, description="Mean number of false alarms a scan, uniform over range, bearing and Doppler in view"
    )
    doppler_probability: Probability = Field(1.0, description="Simulation: probability that a plot has a Doppler")
    max_doppler_mps: Positive | None = Field(
        None,
        description="Greatest range rate told apart, either sign: beyond it Doppler folds; none: it does not. "
        "Needed where false alarms have Doppler [m/s]",
    )

    @model_validator(mode="after")
    def _told(self) -> Self:
        if self.false_alarms and self.max_range_m is None:
            raise ParameterError(
                "max_range_m: is not given; false alarms are uniform up to it, so give it or false_alarms=0."
            )
        if self.max_doppler_mps is not None and self.max_doppler_mps < 2 * math.pi * self.doppler_sd_mps:
            raise ParameterError(
                f"max_doppler_mps: {self.max_doppler_mps:g} m/s is less than 2 pi doppler_sd_mps, too narrow to tell a "
                "range rate from a folded one; give a greater one, or none."
            )
        return self

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
            If a plot has a Doppler, and that of false alarms is not told.
        """
        from elusive.sensors._radar_kernels import scan_log_ratio

        scan = self.in_view(measurement)
        check_finite(states)
        low, high, half = self.limits
        field = low, high, math.sin(self.middle_rad), math.cos(self.middle_rad), half
        sd = self.range_sd_m, self.bearing_sd_rad
        fold = 2 * self.max_doppler_mps if self.max_doppler_mps is not None else 0.0
        log_missed = _log(1 - self.detection_probability)
        place, clutter = (float(self.x_m), float(self.y_m)), self.false_alarms > 0
        return scan_log_ratio(states, place, self._table(scan), sd, fold, field, log_missed, clutter)

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
            If false alarms have Doppler, and their greatest is not told.
        """
        check_finite(states)
        low, high, half = self.limits
        distance, bearing, doppler = self.measured(states)
        seen = self.sees(distance, bearing) & (rng.random(len(states)) < self.detection_probability)
        distance, bearing = self.scattered(distance[seen], bearing[seen], rng)
        plots = np.stack([distance, bearing, rng.normal(doppler[seen], self.doppler_sd_mps)])
        if self.false_alarms:
            fold = self._told_folds("simulation") if self.doppler_probability else 0.0
            edges = np.array([[low, high], [self.middle_rad - half, self.middle_rad + half], [-fold, fold]])[:, :, None]
            false = rng.uniform(edges[:, 0], edges[:, 1], (3, rng.poisson(self.false_alarms)))
            plots = np.concatenate([plots, false], axis=1)
        distance, bearing, doppler = plots[:, np.argsort(plots[1] % TURN_RAD)]
        if self.max_doppler_mps is not None:
            doppler = wrapped(doppler, 2 * self.max_doppler_mps)
        doppler = np.where(rng.random(len(doppler)) < self.doppler_probability, doppler, np.nan)
        bearing %= TURN_RAD
        bearing[bearing == TURN_RAD] = 0.0  # just below zero it is rounded to a whole turn
        return RadarScan(time_s, np.full(len(bearing), time_s), distance, bearing, doppler)

    def _table(self, scan: RadarScan) -> Array:
        """Rows of plots as the kernel takes them, each with the logarithm of its constant factor."""
        from elusive.sensors._radar_kernels import tabulate

        n = len(scan.range_m)
        if n > 1 and not self.false_alarms:
            raise DataError(
                f"scan at {scan.time_s:g} s: holds {n} plots, and without false alarms one target makes one at most; "
                "give false_alarms."
            )
        log_scale = _log(self.detection_probability) - math.log(TURN_RAD * self.range_sd_m * self.bearing_sd_rad)
        log_doppler = -math.log(self.doppler_sd_mps) - 0.5 * math.log(TURN_RAD)
        if self.false_alarms:
            low, high, half = self.limits
            log_scale += math.log(2 * half * (high - low) / self.false_alarms)
            if np.isfinite(scan.doppler_mps).any():
                log_doppler += math.log(2 * self._told_folds(f"scan at {scan.time_s:g} s"))
        claimed = np.zeros(n) if scan.claimed is None else scan.claimed
        plots = scan.times_s, scan.range_m, scan.bearing_rad, scan.doppler_mps, claimed
        return tabulate(plots, scan.time_s, self.doppler_sd_mps, log_scale, log_doppler)

    def _told_folds(self, where: str) -> float:
        if self.max_doppler_mps is None:
            raise ParameterError(
                f"{where}: false alarms have Doppler, uniform up to max_doppler_mps; give it, or leave Doppler out."
            )
        return self.max_doppler_mps


def _log(probability: float) -> float:
    return math.log(probability) if probability > 0 else -math.inf
