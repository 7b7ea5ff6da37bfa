"""A radar that sees ships by several echoes along their hulls.

Echoes lie uniformly along a hull, which points where the ship goes, and Gaussian across it; a ship that is detected
makes one plot and a Poisson number of further ones in proportion to its length (Gilholm and Salmond, 2005, IEE Proc.
Radar Sonar Navig. 152(5), 364-371, for a stick of Poisson plots). A ship's breadth is taken from its length: Watson and
Gilfillan (1976), Some ship design methods, Trans. RINA 119, have length over breadth 4 up to 30 m, 6.5 from 130 m on.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.special import ndtr

from elusive.contracts import VX, VY, Array, DetectionBirths, X, Y
from elusive.sensors.radar import FAINTEST, RadarSensor
from elusive.sensors.radar_scans import TURN_RAD, RadarPlot, RadarScan
from elusive.sensors.radar_view import check_finite, wrapped

LENGTH, ECHOES = 4, 5  # components of a state: logarithms of a length [m], and of further plots each 100 m of it
LENGTHS, RATES = (math.log(40.0), 1.0), (0.0, 0.7)  # mean and deviation of the logarithms of a new ship's
PLACE = np.array([X, Y])
PER_M = 0.01
UNIFORM_SD = 1 / math.sqrt(12)
ABOUT_SD_RAD, ABOUT_SHARE = 0.1, 0.5  # courses of new ships that are drawn along pairs of plots
LONGEST_M = 400.0
SAME, AHEAD = 2.0, 1.0  # deviations within which two are one, and the gap between them in lengths
FEWEST_M = 1.0  # of a hull in numbers


def breadth_m(length_m: Array) -> Array:
    """Breadth of ships of a length: Watson and Gilfillan (1976)."""
    return length_m / np.clip(4.0 + 0.025 * (length_m - 30.0), 4.0, 6.5)


class HullRadar(RadarSensor):
    """Plots along the hulls of ships; states are x, vx, y, vy, log length, log of the rate of echoes."""

    def further_detections(self, states: Array) -> Array:
        """Mean number of plots that a detected ship makes beside the first, ``(N, d) -> (N,)``."""
        return np.asarray(PER_M * np.exp(states[:, LENGTH] + states[:, ECHOES]))

    def room(self, means: Array) -> Array:
        """Covariance of place about the middle of each ship's hull, ``(T, d) -> (T, 2, 2)``."""
        length, along = np.exp(means[:, LENGTH]), _courses(means)
        across = np.stack([along[:, 1], -along[:, 0]], axis=1)
        axes = np.stack([length[:, None] * along, breadth_m(length)[:, None] * across], axis=-1) * UNIFORM_SD
        return np.asarray(axes @ axes.transpose(0, 2, 1))

    def extent(self, states: Array, weights: Array) -> dict[str, float]:
        """Length of a ship with its deviation, and breadth [m], of weighted states."""
        length = np.exp(states[:, LENGTH])
        mean = float(weights @ length)
        sd = math.sqrt(float(weights @ (length - mean) ** 2))
        return {"length_m": mean, "sd_length_m": sd, "breadth_m": float(weights @ breadth_m(length))}

    def along_hull(self, mean: Array, places: Array) -> Array:
        """Where places ``(m, 2)`` lie along a ship's hull, ``(m,)``: from -.5 at the stern to .5 at the bow."""
        return np.asarray((places - mean[[X, Y]]) @ _courses(mean[None])[0] / math.exp(float(mean[LENGTH])))

    def one_body(self, means: Array, covariances: Array) -> bool:
        """Whether two targets, ``(2, d), (2, d, d)``, are parts of one hull: no ship is that close ahead of another.

        In line with their course, at one velocity, and nearer than half of the longer's length: far within a ship's
        domain (Fujii and Tanaka, 1971, J. Navigation 24(4), 543-552: four lengths ahead and astern).
        """
        off, total = means[1] - means[0], covariances.sum(axis=0)
        speeds = [VX, VY]
        if off[speeds] @ np.linalg.solve(total[np.ix_(speeds, speeds)], off[speeds]) > SAME**2:
            return False
        lengths = np.exp(means[:, LENGTH])
        along = _courses(means[:1] + means[1:])[0]
        across = np.array([along[1], -along[0]])
        aside_sd = math.sqrt(float(across @ total[np.ix_([X, Y], [X, Y])] @ across))
        aside = abs(float(across @ off[[X, Y]])) - 0.5 * float(breadth_m(lengths).sum())
        surely = lengths * np.maximum(1 - SAME * np.sqrt(covariances[:, LENGTH, LENGTH]), 0.0)
        ahead = abs(float(along @ off[[X, Y]])) - 0.5 * float(surely.sum())
        told = surely.max() > 2 * SAME * aside_sd  # what is hardly longer than its error is no hull
        return bool(told and aside < SAME * aside_sd and ahead < AHEAD * surely.max())

    def extended(self, states: Array, rng: Generator) -> Array:
        """Append lengths and rates of echoes of new ships, ``(N, 4) -> (N, 6)``."""
        n = len(states)
        return np.column_stack([states, rng.normal(*LENGTHS, n), rng.normal(*RATES, n)])

    def union(self, first: Array, second: Array) -> Array:
        """Join hulls, ``(N, d), (N, d) -> (N, d)``: as long as both reach, on the course of the first."""
        along, joined = _courses(first), first.copy(order="K")
        off = ((second - first)[:, [X, Y]] * along).sum(axis=1)
        one, other = 0.5 * np.exp(first[:, LENGTH]), 0.5 * np.exp(second[:, LENGTH])
        bow, stern = np.maximum(one, off + other), np.minimum(-one, off - other)
        joined[:, [X, Y]] += 0.5 * (bow + stern)[:, None] * along
        joined[:, LENGTH] = np.log(bow - stern)
        plots = self.further_detections(first) + self.further_detections(second) + 1
        joined[:, ECHOES] = np.log(plots / (PER_M * (bow - stern)))
        return joined

    def gate(
        self, means: Array, covariances: Array, measurement: RadarScan | RadarPlot, deviations: float
    ) -> NDArray[np.bool_]:
        """Whether plots lie within so many deviations of hulls, as :meth:`RadarView.gate`."""
        wide = np.array(covariances)
        longer = np.array(means)
        longer[:, LENGTH] += np.sqrt(covariances[:, LENGTH, LENGTH])
        wide[:, PLACE[:, None], PLACE] += self.room(longer)
        return super().gate(means, wide, measurement, deviations)

    def log_densities(
        self, states: Array, measurement: RadarScan | RadarPlot, which: NDArray[np.int64] | None = None
    ) -> Array:
        """Log density of plots, if each is one of a ship at each state, ``(N, d) -> (N, k)``."""
        scan, inside = self.judged(measurement)
        chosen = np.arange(len(inside)) if which is None else which
        row = np.cumsum(inside) - 1
        check_finite(states)
        found = np.full((len(states), len(chosen)), -np.inf)
        for column, plot in enumerate(chosen):
            if inside[plot]:
                found[:, column] = self._along(states, scan.select_detections(row[plot : plot + 1]))
        return found

    def _along(self, states: Array, plot: RadarScan) -> Array:
        """Log density of a plot in range, bearing and Doppler, uniform along each hull."""
        (place,), (error,) = self.places(plot)
        later = float(plot.times_s[0]) - plot.time_s
        east = place[0] - states[:, X] - later * states[:, VX]
        north = place[1] - states[:, Y] - later * states[:, VY]
        along, length = _courses(states), np.maximum(np.exp(states[:, LENGTH]), FEWEST_M)
        u, v = along[:, 0] * east + along[:, 1] * north, along[:, 1] * east - along[:, 0] * north
        xx, yy, xy = error[0, 0], error[1, 1], error[0, 1]
        cos, sin = along[:, 0], along[:, 1]
        uu = xx * cos**2 + 2 * xy * cos * sin + yy * sin**2
        vv = xx * sin**2 - 2 * xy * cos * sin + yy * cos**2 + (UNIFORM_SD * breadth_m(length)) ** 2
        uv = (xx - yy) * cos * sin + xy * (sin**2 - cos**2)
        left, sd = u - uv / vv * v, np.sqrt(uu - uv**2 / vv)
        ends = ndtr((left + 0.5 * length) / sd) - ndtr((left - 0.5 * length) / sd)
        with np.errstate(divide="ignore"):
            log_density = np.log(ends / length) - 0.5 * (v**2 / vv + np.log(TURN_RAD * vv))
        doppler = float(plot.doppler_mps[0])
        if math.isfinite(doppler):
            own = np.array(plot.own)
            seen = states[:, :4] - own
            rate = doppler - self.measured(seen)[2]
            if self.max_doppler_mps is not None:
                rate = wrapped(rate, 2 * self.max_doppler_mps)
            log_density -= 0.5 * (rate / self.doppler_sd_mps) ** 2
            log_density -= math.log(self.doppler_sd_mps * math.sqrt(TURN_RAD))
        # from an area to range times bearing
        return np.asarray(log_density + math.log(max(float(plot.range_m[0]), 1.0)))

    def draw_births(
        self, measurement: RadarScan | RadarPlot, which: NDArray[np.int64], n: int, speed_sd_mps: float, rng: Generator
    ) -> DetectionBirths:
        """Draw new ships that made some plots: of any length and course, half of them along pairs of plots.

        Courses are drawn from a mixture, and the weights carry their density, uniform, over that.
        """
        born = super().draw_births(measurement, which, n, speed_sd_mps, rng)
        k = len(which)
        if not k:
            return born._replace(states=np.zeros((0, n, 6)))
        states, weights = np.zeros((k, n, 6)), np.array(born.weights)
        states[..., :4] = born.states
        states[..., LENGTH] = rng.normal(*LENGTHS, (k, n))
        states[..., ECHOES] = rng.normal(*RATES, (k, n))
        scan = self.judged(measurement)[0]
        places = self.places(scan)[0]
        for row in range(k):
            if born.log_density[row] <= FAINTEST and not math.isfinite(born.log_density[row]):
                continue
            one = states[row]
            weights[row] = self._turned(one, places, rng)
            length = np.exp(one[:, LENGTH])
            along = _courses(one)
            across = np.column_stack([along[:, 1], -along[:, 0]])
            off = (length * rng.uniform(-0.5, 0.5, n))[:, None] * along
            off += (UNIFORM_SD * breadth_m(length) * rng.standard_normal(n))[:, None] * across
            one[:, [X, Y]] += off
        return DetectionBirths(states, born.log_density, weights)

    def _turned(self, states: Array, places: Array, rng: Generator) -> Array:
        """Turn half of the courses along pairs of plots, and return the weights ``(N,)``."""
        n = len(states)
        middle = states[:, [X, Y]].mean(axis=0)
        off = places - middle
        far = np.hypot(*off.T)
        near = off[(far > 0.02 * LONGEST_M) & (far < LONGEST_M)]
        if not len(near):
            return np.full(n, 1 / n)
        angles = np.arctan2(near[:, 1], near[:, 0])
        course = np.arctan2(states[:, VY], states[:, VX])
        turned = rng.random(n) < ABOUT_SHARE
        picked = angles[rng.integers(len(angles), size=n)] + math.pi * rng.integers(2, size=n)
        new = np.where(turned, picked + ABOUT_SD_RAD * rng.standard_normal(n), course)
        speed = np.hypot(states[:, VX], states[:, VY])
        states[:, VX], states[:, VY] = speed * np.cos(new), speed * np.sin(new)
        gap = wrapped(new[:, None] - angles, math.pi) / ABOUT_SD_RAD
        about = np.exp(-0.5 * gap**2).mean(axis=1) / (2 * ABOUT_SD_RAD * math.sqrt(TURN_RAD))
        weights = 1 / ((1 - ABOUT_SHARE) + ABOUT_SHARE * TURN_RAD * about)
        return np.asarray(weights / weights.sum())


def _courses(states: Array) -> Array:
    """Return unit vectors along hulls, ``(N, 2)``: where ships go."""
    speed = np.hypot(states[:, VX], states[:, VY])
    course = states[:, [VX, VY]] / np.maximum(speed, 1e-9)[:, None]
    course[speed < 1e-9] = 0.0, 1.0
    return np.asarray(course)
