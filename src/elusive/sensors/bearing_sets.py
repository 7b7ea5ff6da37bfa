"""Bearings of one time, several samples of a sensor averaged, and where the sensors that took them stand.

Circular mean of N samples, of variance sigma^2 / N: Mardia and Jupp (2000), Directional statistics, section 2.2; a
stray is none of them (Huber and Ronchetti, 2009, Robust statistics, section 1.4: rejection by the median deviation).
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame

FAR = 10.0  # median deviations of samples, by chance 2e-11
Number = TypeVar("Number", np.float64, np.intp)


class BearingSet(NamedTuple):
    """Directions to one emitter at one time; a sensor that took several samples stands there several times."""

    time_s: float
    sensor: NDArray[np.intp]  # (m,) rows of the table of sensors
    azimuth_rad: Array  # (m,) clockwise from north: x east, y north
    elevation_rad: Array  # (m,) above the horizon; NaN where it is not measured
    places_m: Array | None = None  # (m, 3) where each was taken, of sensors that move; None: where the sensors stand


class SensorSites(NamedTuple):
    """Where the sensors stand."""

    names: tuple[str, ...]
    positions_m: Array  # (n, 3) east, north, up; up is 0 where the table has none; of a sensor that moves, its mean
    frame: LocalFrame | None = None  # of the metres, where places were given in longitude and latitude


def checked_rows(
    what: str, time_s: float, sensor: object, values: object, sensors: int
) -> tuple[NDArray[np.intp], Array]:
    """Sensors and what each reports at a time.

    Raises
    ------
    DataError
        If the arrays differ in length, a number is not finite, or a sensor unknown.
    """
    rows, numbers = np.asarray(sensor, np.intp), np.asarray(values, np.float64)
    if rows.ndim != 1 or numbers.shape != rows.shape:
        raise DataError(f"{what}s at {time_s:g} s: give each {what} a sensor.")
    if not (math.isfinite(time_s) and np.isfinite(numbers).all()):
        raise DataError(f"{what}s at {time_s:g} s: a number is not finite; leave that {what} out.")
    if len(rows) and not 0 <= rows.min() <= rows.max() < sensors:
        raise DataError(f"{what}s at {time_s:g} s: sensors are numbered 0 to {sensors - 1} (got {rows!s:.60}).")
    return rows, numbers


def checked(measurement: object, sensors: int) -> tuple[NDArray[np.intp], Array, Array]:
    """Sensors, azimuths and elevations of a time.

    Raises
    ------
    DataError
        If the arrays differ in length, an azimuth is not finite, an elevation infinite, or a sensor unknown.
    """
    if not isinstance(measurement, BearingSet):
        raise DataError(f"bearings: measurement is {type(measurement).__name__}; give a BearingSet.")
    sensor, azimuth = checked_rows("bearing", *measurement[:3], sensors)
    elevation = np.asarray(measurement.elevation_rad, np.float64)
    if elevation.shape != azimuth.shape or np.isinf(elevation).any():
        raise DataError(
            f"bearings at {measurement.time_s:g} s: an elevation lacks, or a number is not finite; give each or NaN."
        )
    return sensor, azimuth, elevation


def averaged(measurement: object, sensors: int) -> tuple[NDArray[np.intp], Array, Array, NDArray[np.intp]]:
    """Sensors, mean azimuths and elevations of a time, each sensor once, and how many samples it took.

    Samples that lie far from most of their sensor's are left out.

    Raises
    ------
    DataError
        As :func:`checked`.
    """
    return means_of(*checked(measurement, sensors))


def means_of(
    group: NDArray[np.intp], azimuth: Array, elevation: Array
) -> tuple[NDArray[np.intp], Array, Array, NDArray[np.intp]]:
    """Return groups of samples, each once, their mean azimuths and elevations, and how many samples these are of."""
    if len(set(group.tolist())) == len(group):
        return group, azimuth, elevation, np.ones(len(group), np.intp)
    kept = ~_strays(group, azimuth)
    found, place, count = np.unique(group[kept], return_inverse=True, return_counts=True)
    mean = [_circular_mean(part[kept], place, len(found)) for part in (azimuth, elevation)]
    return found, mean[0], mean[1], count


def _strays(group: NDArray[np.intp], azimuth: Array) -> NDArray[np.bool_]:
    """Say which samples lie far from the median of their group, of three and more.

    By the median deviation of a group's samples or of most groups', whichever is larger: few are close by chance.
    """
    _, place, count = np.unique(group, return_inverse=True, return_counts=True)
    turned = np.exp(1j * azimuth)
    mean = np.bincount(place, turned.real) + 1j * np.bincount(place, turned.imag)
    about = np.angle(turned * mean[place].conj())
    apart = np.abs(about - _medians(about, place, count)[place])
    half = _medians(apart, place, count)
    shared = np.median(half[count > 2]) if (count > 2).any() else np.inf
    return np.asarray((count[place] > 2) & (apart > FAR * np.maximum(half, shared)[place]))


def _medians(values: Array, place: NDArray[np.intp], count: NDArray[np.intp]) -> Array:
    """Median of the values of each place."""
    return np.asarray(values[np.lexsort((values, place))][np.cumsum(count) - count + count // 2])


def _circular_mean(angle: Array, place: NDArray[np.intp], n: int) -> Array:
    """Circular mean of the angles of each place; of those that are NaN none is counted."""
    known = np.isfinite(angle)
    sine = np.bincount(place[known], np.sin(angle[known]), n)
    cosine = np.bincount(place[known], np.cos(angle[known]), n)
    return np.where(np.bincount(place[known], minlength=n) > 0, np.arctan2(sine, cosine), np.nan)


def in_turn(across: NDArray[Number], upwards: NDArray[Number], elevation: Array) -> NDArray[Number]:
    """Rows of what is across and upwards, each sensor's next to each other; upwards only where it is measured."""
    rows: NDArray[Number] = np.stack([across, upwards], axis=1)
    found: NDArray[Number] = rows[np.column_stack([np.ones(len(elevation), np.bool_), np.isfinite(elevation)])]
    return found
