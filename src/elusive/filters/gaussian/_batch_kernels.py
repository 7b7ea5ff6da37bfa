"""Compiled kernel of many independent tracks: each is started, filtered and smoothed as one alone would be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian._extended_kernels import filtered, smoothed, smoothed_start
from elusive.filters.gaussian._map_kernels import Anchor, Loss
from elusive.filters.gaussian._start_kernels import Start, along_lines, started
from elusive.filters.gaussian.transitions import Transitions
from elusive.sensors.bearing_table import BearingTable


@njit(cache=True, nogil=True)
def tracked(
    shared: BearingTable,
    azimuth_rad: Array,
    elevation_rad: Array,
    T: Transitions,
    anchor: Anchor,
    loss: Loss,
    start: Start,
    iterations: int,
    smooth: bool,
    means: Array,
    covariances: Array,
    since: NDArray[np.intp],
) -> None:
    """Filter tracks ``(N, M)`` of bearings, the rows of a table that all share; NaN where there is none."""
    K = len(shared.times_s)
    for track in range(len(azimuth_rad)):
        table = _first(shared, azimuth_rad[track], elevation_rad[track], K)
        for k in range(K):
            first = _first(shared, azimuth_rad[track], elevation_rad[track], k + 1)
            path = along_lines(first, T, anchor, loss, start)
            found, placed = started(path, first, T, anchor, loss, start)
            means[track, k], covariances[track, k] = found.path[-1], marginals(found.L, found.Y)[-1]
            since[track] = k
            if placed:
                break
        k = since[track]
        filtered(table, T, loss, iterations, k, means[track], covariances[track], np.empty(K))
        if smooth:
            smoothed(T, k, means[track], covariances[track])
            smoothed_start(found.path, found.L, found.Y, means[track, : k + 1], covariances[track, : k + 1])


@njit(cache=True, nogil=True)
def _first(shared: BearingTable, azimuth_rad: Array, elevation_rad: Array, times: int) -> BearingTable:
    rows = shared.first[times]
    return BearingTable(
        shared.times_s[:times],
        shared.first[: times + 1],
        shared.sensor[:rows],
        shared.places[:rows],
        azimuth_rad[:rows],
        elevation_rad[:rows],
        shared.variance[:rows],
        shared.range_m[:rows],
        shared.weights[:rows],
        shared.stations,
    )
