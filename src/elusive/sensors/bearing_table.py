"""Bearings and arrivals of many times as flat arrays, a sensor's samples averaged: what compiled filters read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.sensors.arrival_times import ArrivalSet, ArrivalTimeSensors
from elusive.sensors.bearing_sets import BearingSet, means_of
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.hybrid import HybridSensors, HybridSet

PlaceSensor = Annotated[BearingSensors | ArrivalTimeSensors | HybridSensors, Field(discriminator="kind")]
PlaceSet = BearingSet | ArrivalSet | HybridSet


class BearingTable(NamedTuple):
    """Measurements in the order of time; those of time k are rows ``first[k]`` to ``first[k + 1]``.

    A row is a bearing or, where ``range_m`` is a number, a weighted sum of the distances to the sensors.
    """

    times_s: Array  # (K,)
    first: NDArray[np.intp]  # (K + 1,)
    sensor: NDArray[np.intp]  # (M,)
    places: Array  # (M, 3) of the sensor [m]
    azimuth_rad: Array  # (M,) clockwise from north; NaN: no bearing
    elevation_rad: Array  # (M,) NaN where it is not measured
    variance: Array  # (M,) of the angle between measured and true direction, each component [rad^2]; of a sum [m^2]
    range_m: Array  # (M,) weighted sum of distances; NaN: no arrival
    weights: Array  # (M, n) of the distances
    stations: Array  # (n, 3) places of all sensors [m]

    def between(self, start: int, stop: int) -> BearingTable:
        """Return the times from one to before another."""
        low, high = self.first[start], self.first[stop]
        rows = {name: getattr(self, name)[low:high] for name in ROW_COLUMNS}
        return self._replace(times_s=self.times_s[start:stop], first=self.first[start : stop + 1] - low, **rows)

    def joined(self, later: BearingTable) -> BearingTable:
        """Return the times of this table, then those of a later one, whose first may be this one's last."""
        rows = {name: np.concatenate([getattr(self, name), getattr(later, name)]) for name in ROW_COLUMNS}
        same = int(self.times_s[-1] == later.times_s[0])
        first = np.concatenate([self.first[: len(self.first) - same], self.first[-1] + later.first[1:]])
        return self._replace(times_s=np.concatenate([self.times_s, later.times_s[same:]]), first=first, **rows)


ROW_COLUMNS = ("sensor", "places", "azimuth_rad", "elevation_rad", "variance", "range_m", "weights")


def tabulated(
    sets: Iterable[PlaceSet | None], sensors: PlaceSensor, times_s: Sequence[float] | None = None
) -> BearingTable:
    """Check measurements and write them one after another, a sensor's samples at a time averaged.

    Parameters
    ----------
    sets
        In the order of time, None where one is missing; those of equal times are taken as of one.
    sensors
        Their places and deviations. In two dimensions elevations are passed over.
    times_s
        Their times; None: their own.

    Raises
    ------
    DataError
        If a bearing or an arrival cannot be used, or times run backwards.
    """
    times, known = list[float](), list[PlaceSet]()
    for number, measurement in enumerate(sets):
        if times_s is not None:
            time_s = float(times_s[number])
        elif measurement is not None:
            time_s = float(measurement.time_s)
        else:
            raise DataError(f"measurement {number}: is missing, and so is its time; give times_s.")
        if times and time_s < times[-1]:
            raise DataError(f"bearings at {time_s:g} s: come after {times[-1]:g} s; sort them by time.")
        times.append(time_s)
        known.append(sensors.nothing(time_s) if measurement is None else measurement)
    counts, rows = _of_all(known or [sensors.nothing(0.0)], sensors)
    ends, row_times = np.cumsum(counts), np.array(times)
    last = np.append(np.diff(row_times) > 0, [True] * (len(times) > 0)).astype(np.bool_)  # of each time
    return BearingTable(row_times[last], np.append(0, ends[: len(times)][last]).astype(np.intp), *rows, sensors.places)


class Rows(NamedTuple):
    """Rows of one time, as in the table."""

    sensor: NDArray[np.intp]
    places: Array
    azimuth_rad: Array
    elevation_rad: Array
    variance: Array
    range_m: Array
    weights: Array


def _of_all(sets: Sequence[PlaceSet], sensors: PlaceSensor) -> tuple[list[int], Rows]:
    """Return how many rows each time has, and these: at once where all is sound and no sensor moves."""
    if isinstance(sensors, BearingSensors) and all(map(_plain, sets)):
        sensor, azimuth, elevation = (np.concatenate([one[k] for one in sets]) for k in (1, 2, 3))
        counts, n = [len(one[1]) for one in sets], len(sensors.positions_m)
        within = len(sensor) == 0 or 0 <= sensor.min() <= sensor.max() < n
        if within and np.isfinite(azimuth).all() and not np.isinf(elevation).any():
            time = np.repeat(np.arange(len(sets)), counts)
            group, azimuth, elevation, samples = means_of(time * n + sensor, azimuth, elevation)
            counts, sensor = np.bincount(group // n, minlength=len(sets)).tolist(), group % n
            unknown, none = np.full(len(sensor), np.nan), np.zeros((len(sensor), n))
            elevation = unknown if sensors.dimensions == 2 else elevation
            variance = sensors.sigmas_rad[sensor] ** 2 / samples
            return counts, Rows(sensor, sensors.places[sensor], azimuth, elevation, variance, unknown, none)
    parts = [_rows(one, sensors) for one in sets]
    return [len(part.sensor) for part in parts], _stacked(parts)


def _plain(measurement: PlaceSet) -> bool:
    """Say whether bearings are of sensors that stand, as arrays that fit each other."""
    if not isinstance(measurement, BearingSet) or measurement.places_m is not None:
        return False
    shape, *others = (np.shape(part) for part in measurement[1:4])
    return math.isfinite(measurement.time_s) and len(shape) == 1 and others == [shape, shape]


def _rows(measurement: PlaceSet, sensors: PlaceSensor) -> Rows:
    if isinstance(sensors, BearingSensors):
        sensor, *angles = sensors.averaged(measurement)  # type: ignore[arg-type]  # it refuses any other itself
        m, here = len(sensor), sensors.standing(measurement).places  # type: ignore[arg-type]
        return Rows(
            sensor,
            here[sensor],
            angles[0],
            angles[1],
            angles[2],
            np.full(m, np.nan),
            np.zeros((m, len(sensors.positions_m))),
        )
    if isinstance(sensors, ArrivalTimeSensors):
        weights, reach, variance = sensors.contrasted(measurement)
        # a contrast stands under the sensor that weighs most in it
        sensor = np.abs(weights).argmax(axis=1) if len(weights) else np.empty(0, np.intp)
        unknown = np.full(len(reach), np.nan)
        return Rows(sensor, sensors.places[sensor], unknown, unknown, variance, reach, weights)
    if not isinstance(measurement, HybridSet):
        raise DataError(f"measurement: is {type(measurement).__name__}; give a HybridSet to hybrid sensors.")
    if not measurement.time_s == measurement.bearings.time_s == measurement.arrivals.time_s:
        raise DataError(f"measurement at {measurement.time_s:g} s: its bearings and arrivals are of other times.")
    directions, times = _rows(measurement.bearings, sensors.bearings), _rows(measurement.arrivals, sensors.arrivals)
    before, after = len(sensors.bearings.positions_m), len(sensors.arrivals.positions_m)
    return _stacked(
        [
            directions._replace(weights=np.pad(directions.weights, ((0, 0), (0, after)))),
            times._replace(sensor=times.sensor + before, weights=np.pad(times.weights, ((0, 0), (before, 0)))),
        ]
    )


def _stacked(parts: list[Rows]) -> Rows:
    return parts[0] if len(parts) == 1 else Rows(*(np.concatenate(part) for part in zip(*parts, strict=True)))
