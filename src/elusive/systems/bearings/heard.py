"""What sensors report of an emitter at each time: bearings, times of arrival, or both."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.sensors.hybrid import HybridSet


class Bearings(NamedTuple):
    """The bearings of several times, one after another."""

    counts: NDArray[np.intp]  # (K,) of each time
    sensor: NDArray[np.intp]  # (M,)
    azimuth_rad: Array  # (M,)


def part_of(times: BearingSet, rows: NDArray[Any]) -> BearingSet:
    """Return some of the bearings of a time."""
    places = None if times.places_m is None else times.places_m[rows]
    return BearingSet(times.time_s, times.sensor[rows], times.azimuth_rad[rows], times.elevation_rad[rows], places)


def angles_of(measurement: PlaceSet) -> BearingSet:
    """Return the bearings of a measurement, none of times of arrival alone."""
    if isinstance(measurement, BearingSet):
        return measurement
    if isinstance(measurement, HybridSet):
        return measurement.bearings
    return BearingSet(measurement.time_s, np.empty(0, np.intp), np.empty(0), np.empty(0))


def bearings_of(heard: Sequence[PlaceSet]) -> Bearings:
    """Return the bearings of a recording."""
    angles = [angles_of(measurement) for measurement in heard]
    counts = np.array([len(part.sensor) for part in angles], np.intp)
    sensor, azimuth = (np.concatenate([part[k] for part in angles]) for k in (1, 2))
    return Bearings(counts, sensor.astype(np.intp), azimuth)


def starts_of(heard: Sequence[PlaceSet], sites: SensorSites) -> Array:
    """Return where each bearing of a recording was taken, ``(M, 2)`` [m]."""
    angles = [angles_of(measurement) for measurement in heard]
    places = [sites.positions_m[part.sensor] if part.places_m is None else part.places_m for part in angles]
    return np.concatenate([np.empty((0, 3)), *places])[:, :2]


def moving(heard: Iterable[PlaceSet]) -> bool:
    """Say whether bearings tell where their sensors were."""
    return any(angles_of(measurement).places_m is not None for measurement in heard)


def sensors_of(measurement: PlaceSet) -> NDArray[np.intp]:
    """Return the sensors that report a measurement, a sensor as often as it does."""
    if isinstance(measurement, HybridSet):
        return np.concatenate([measurement.bearings.sensor, measurement.arrivals.sensor])
    return measurement.sensor


def have_elevations(heard: Iterable[PlaceSet]) -> bool:
    """Say whether any bearing has an elevation."""
    return any(np.isfinite(angles_of(measurement).elevation_rad).any() for measurement in heard)
