"""What sensors report of an emitter at each time: bearings, times of arrival, or both."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearing_table import PlaceSet
from elusive.sensors.hybrid import HybridSet


class Bearings(NamedTuple):
    """The bearings of several times, one after another."""

    counts: NDArray[np.intp]  # (K,) of each time
    sensor: NDArray[np.intp]  # (M,)
    azimuth_rad: Array  # (M,)


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


def sensors_of(measurement: PlaceSet) -> NDArray[np.intp]:
    """Return the sensors that report a measurement, a sensor as often as it does."""
    if isinstance(measurement, HybridSet):
        return np.concatenate([measurement.bearings.sensor, measurement.arrivals.sensor])
    return measurement.sensor


def have_elevations(heard: Iterable[PlaceSet]) -> bool:
    """Say whether any bearing has an elevation."""
    return any(np.isfinite(angles_of(measurement).elevation_rad).any() for measurement in heard)
