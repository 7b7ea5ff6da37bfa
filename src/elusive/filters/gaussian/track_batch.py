"""Many independent tracks from bearings in one call: the extended or iterated Kalman filter and its smoother on each.

The same filter as :class:`~elusive.filters.gaussian.extended_kalman.ExtendedKalmanFilter`, started and run in compiled
code; tracks share the times and the sensors, and nothing else.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.gaussian._batch_kernels import tracked
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.sensors.bearing_table import BearingTable
from elusive.sensors.bearings import BearingSensors


class FilteredTracks(NamedTuple):
    """A belief of each track at each time."""

    times_s: Array  # (K,)
    states: Array  # (N, K, d)
    covariances: Array  # (N, K, d, d)
    started: NDArray[np.intp]  # (N,) rows of the times from which on the filters ran


def filter_tracks(
    filter: ExtendedKalmanFilter,
    times_s: Any,
    azimuth_rad: Any,
    elevation_rad: Any = None,
    *,
    variance: Any = None,
    smooth: bool = False,
) -> FilteredTracks:
    """Filter any number of independent tracks.

    Parameters
    ----------
    filter
        Motion, sensors and losses, the same for all.
    times_s
        ``(K,)``, increasing [s].
    azimuth_rad
        ``(N, K, n)`` at each sensor, clockwise from north; NaN where there is none.
    elevation_rad
        The same above the horizon, in three dimensions.
    variance
        Of each direction, one that broadcasts to ``(K, n)`` [rad^2]; None: the sensors' own, of a single sample.
    smooth
        Whether each belief is to be given all bearings of its track, later ones too.

    Raises
    ------
    DataError
        If the arrays do not fit the sensors, times do not increase, a number is infinite, or a track has no bearing.
    """
    sensor = filter.sensor
    if not (filter.compiled and isinstance(sensor, BearingSensors) and filter.prior is None):
        raise DataError(
            "filter: a batch is of bearings alone, with a linear motion or ctrv and without a prior, and this has "
            f"{type(sensor).__name__}, {type(filter.motion).__name__} and {'no' if filter.prior is None else 'a'} "
            "prior; filter its tracks one by one."
        )
    times, azimuth = np.asarray(times_s, np.float64), np.asarray(azimuth_rad, np.float64)
    elevation = np.full(azimuth.shape, np.nan) if elevation_rad is None else np.asarray(elevation_rad, np.float64)
    K, n = len(times) if times.ndim == 1 else 0, len(sensor.positions_m)
    if azimuth.ndim != 3 or azimuth.shape[1:] != (K, n) or elevation.shape != azimuth.shape or not K:
        raise DataError(
            f"azimuth_rad, elevation_rad: have shapes {azimuth.shape} and {elevation.shape}; give ({K} times, {n} "
            "sensors) a track."
        )
    if not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
        raise DataError("times_s: must be finite and increase; sort them.")
    if np.isinf(azimuth).any() or np.isinf(elevation).any():
        raise DataError("azimuth_rad, elevation_rad: one is infinite; write NaN where there is none.")
    silent = np.flatnonzero(np.isnan(azimuth).all(axis=(1, 2)))
    if len(silent):
        raise DataError(f"azimuth_rad: track {silent[0]} has no bearing; leave it out.")
    spread = np.broadcast_to(sensor.sigmas_rad**2 if variance is None else np.asarray(variance, np.float64), (K, n))
    sensors = np.tile(np.arange(n), K)
    shared = BearingTable(
        times,
        n * np.arange(K + 1),
        sensors,
        sensor.places[sensors],
        azimuth[0].ravel(),
        elevation[0].ravel(),
        spread.ravel(),
        np.full(K * n, np.nan),
        np.zeros((K * n, n)),
        sensor.places,
    )
    N, d = len(azimuth), len(filter.state_names)
    means, covariances, started = np.empty((N, K, d)), np.empty((N, K, d, d)), np.empty(N, np.intp)
    around, up = (np.ascontiguousarray(part.reshape(N, -1)) for part in (azimuth, elevation))
    transitions, anchor, steps = filter.transitions(times), filter.anchor(), filter.iterations
    tracked(
        shared, around, up, transitions, anchor, filter.robust, filter.start, steps, smooth, means, covariances, started
    )
    return FilteredTracks(times, means, covariances, started)
