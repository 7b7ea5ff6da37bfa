"""Bearings of several emitters that nobody tells apart, some of them false: what a tracker of detections asks of them.

Sensors that hear at one time are scans one after the other. A bearing is a ray: a newborn emitter may be anywhere along
it, and is drawn where the bearings that are still to be taken in at that time agree with it, the weights corrected:
the auxiliary particle filter's look ahead (Pitt and Shephard, 1999, J. Am. Stat. Assoc. 94(446), section 3).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import VX, VY, Array, DetectionBirths, X, Y
from elusive.model import Model, Positive
from elusive.sensors.bearing_sets import BearingSet, checked
from elusive.sensors.bearings import BearingSensors, wrapped

NEAREST, FARTHEST = 1e-3, 30.0  # distances along a ray, of the reach
CELL = 0.5  # of a ray, to its distance, in a bearing's deviations
CELLS_MOST = 4000
BLIND = 0.1  # share of the newborn's states that are drawn anywhere along the ray


class BearingScan(NamedTuple):
    """What one sensor hears at one time, and what the sensors hear then whose scans come later."""

    time_s: float
    sensor: int
    azimuth_rad: Array  # (m,)
    later: BearingSet


class _Ray(NamedTuple):
    """Cells along the rays of k bearings of a sensor."""

    log_range: Array  # (G,) logarithms of the distances of their middles
    width: float  # of a cell
    places: Array  # (k, G, 2)
    mass: Array  # (k, G) of the place prior, to a radian


class CrowdedBearings(Model):
    """Azimuths of any number of emitters at several places, each heard or missed, among false ones in any direction.

    Emitters are, before they are heard, anywhere: a bivariate Student distribution of two degrees of freedom about the
    middle of the sensors, half of it within ``sqrt(2) reach_m``. A sensor listens where it reports anything.
    """

    kind: Literal["crowded"] = "crowded"
    bearings: BearingSensors = Field(description="Where the sensors stand, how precise they are, and what they miss")
    false_bearings: Positive = Field(1.0, description="Mean number of false bearings of a sensor at a time")
    reach_m: Positive | None = Field(
        None,
        description="Half of the emitters are within 1.4 times this of the sensors' middle; none: as those are [m]",
    )

    @property
    def scale_m(self) -> float:
        """The reach or, where none is given, the root mean square distance of the sensors from their middle [m]."""
        places = self.bearings.places[:, :2]
        return self.reach_m or float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean())) or 1000.0

    def scans(self, measurement: BearingSet) -> Iterator[BearingScan]:
        """Yield what each sensor that hears anything at a time hears: at most one bearing of an emitter.

        Raises
        ------
        DataError
            If a bearing is not finite or its sensor unknown.
        """
        sensor, azimuth, _ = checked(measurement, len(self.bearings.positions_m))
        for number in np.unique(sensor).tolist():
            later = sensor > number
            rest = BearingSet(measurement.time_s, sensor[later], azimuth[later], np.full(int(later.sum()), np.nan))
            yield BearingScan(measurement.time_s, number, azimuth[sensor == number], rest)

    def detection_probabilities(self, states: Array, measurement: BearingScan) -> Array:
        """Probability that an emitter at each state is heard, ``(N, d) -> (N,)``: the same everywhere."""
        return np.full(len(states), float(self.bearings.detection_probability))

    def log_densities(self, states: Array, measurement: BearingScan, which: NDArray[np.int64]) -> Array:
        """Log density of some bearings, each of an emitter at each state, ``(N, d) -> (N, k)``."""
        x, y, _ = self.bearings.positions_m[measurement.sensor]
        angle = np.arctan2(states[:, X] - x, states[:, Y] - y)
        sigma = self.bearings.sigmas_rad[measurement.sensor]
        off = wrapped(measurement.azimuth_rad[which][:, None] - angle) / sigma
        return np.asarray((-0.5 * off**2 - math.log(sigma * math.sqrt(2 * math.pi))).T)

    def log_clutter(self, measurement: BearingScan) -> Array:
        """Log intensity of false bearings at each, ``(m,)``: as many in any direction."""
        return np.full(len(measurement.azimuth_rad), math.log(self.false_bearings / (2 * math.pi)))

    def draw_births(
        self, measurement: BearingScan, which: NDArray[np.int64], n: int, speed_sd_mps: float, rng: Generator
    ) -> DetectionBirths:
        """Draw new emitters along the rays of some bearings, most where the sensors of later scans agree.

        See :meth:`~elusive.contracts.DetectionSensor.draw_births`.
        """
        k, sigma = len(which), self.bearings.sigmas_rad[measurement.sensor]
        angle, here = measurement.azimuth_rad[which], self.bearings.places[measurement.sensor, :2]
        states, weights = np.empty((k, n, 4)), np.full((k, n), 1 / n)
        ray = self._ray(here, angle, float(sigma))
        total = ray.mass.sum(axis=1)
        agreed = ray.mass * self._agreement(ray, here, measurement.later)
        wanted = BLIND * ray.mass / total[:, None] + (1 - BLIND) * agreed / agreed.sum(axis=1, keepdims=True)
        for row in range(k):
            drawn = np.cumsum(wanted[row])
            cell = np.searchsorted(drawn / drawn[-1], (rng.random() + np.arange(n)) / n)
            cell = cell.clip(max=len(drawn) - 1)
            distance = np.exp(ray.log_range[cell] + ray.width * (rng.random(n) - 0.5))
            towards = angle[row] + sigma * rng.standard_normal(n)
            states[row, :, X] = here[0] + distance * np.sin(towards)
            states[row, :, Y] = here[1] + distance * np.cos(towards)
            share = ray.mass[row, cell] / wanted[row, cell]
            weights[row] = share / share.sum()
        states[:, :, [VX, VY]] = speed_sd_mps * rng.standard_normal((k, n, 2))
        return DetectionBirths(states, np.log(total), weights)

    def _ray(self, here: Array, angle: Array, sigma: float) -> _Ray:
        """Cells along the rays from a place, ``(2,)``, at angles ``(k,)``."""
        scale, middle = self.scale_m, self.bearings.places[:, :2].mean(axis=0)
        low, high = math.log(NEAREST * scale), math.log(FARTHEST * scale)
        width = max(CELL * sigma, (high - low) / CELLS_MOST)
        log_range = np.arange(low, high, width)
        unit = np.stack([np.sin(angle), np.cos(angle)], axis=-1)
        places = here + np.exp(log_range)[:, None] * unit[:, None]
        squared = ((places - middle) ** 2).sum(axis=-1) / scale**2
        area = np.exp(2 * log_range) * width
        return _Ray(log_range, width, places, area / (2 * math.pi * scale**2) * (1 + 0.5 * squared) ** -2)

    def _agreement(self, ray: _Ray, here: Array, later: BearingSet) -> Array:
        """Likelihood of other sensors' bearings in each cell, ``(k, G)``, to that of false ones alone."""
        ratio, heard = np.ones(ray.mass.shape), float(self.bearings.detection_probability)
        across = ray.places - here
        for number in np.unique(later.sensor).tolist():
            off = ray.places - self.bearings.places[number, :2]
            squared = np.maximum((off**2).sum(axis=-1), 1e-12)
            sigma = self.bearings.sigmas_rad[number]
            # how wide a cell looks from there: across, as the ray is; along, as the cell
            wide = (across * off).sum(axis=-1) / squared * sigma
            long = (across[..., 0] * off[..., 1] - across[..., 1] * off[..., 0]) / squared * ray.width
            variance = (sigma**2 + wide**2 + long**2)[..., None]
            angle = np.arctan2(off[..., 0], off[..., 1])[..., None]
            away = wrapped(later.azimuth_rad[later.sensor == number] - angle)
            density = (np.exp(-0.5 * away**2 / variance) / np.sqrt(2 * math.pi * variance)).sum(axis=-1)
            ratio *= 1 - heard + heard * density * 2 * math.pi / self.false_bearings
        return ratio


def crowded(
    heard: Iterable[Iterable[BearingSet]], sensors: int, false_bearings: float, rng: Generator
) -> list[BearingSet]:
    """Put the bearings of several emitters together, with false ones in any direction, so that none is told apart.

    Parameters
    ----------
    heard
        Of each emitter, time by time.
    sensors
        How many there are.
    false_bearings
        Mean number of a sensor at a time.
    rng
        Source of false bearings and of the order.
    """
    at: dict[float, list[BearingSet]] = {}
    for emitter in heard:
        for measurement in emitter:
            at.setdefault(measurement.time_s, []).append(measurement)
    sets = []
    for time_s, parts in sorted(at.items()):
        false = np.repeat(np.arange(sensors), rng.poisson(false_bearings, sensors))
        sensor = np.concatenate([false, *(part.sensor for part in parts)])
        azimuth = np.concatenate([rng.uniform(0, 2 * np.pi, len(false)), *(part.azimuth_rad for part in parts)])
        order = np.lexsort((rng.random(len(sensor)), sensor))
        sets.append(BearingSet(time_s, sensor[order], azimuth[order], np.full(len(order), np.nan)))
    return sets
