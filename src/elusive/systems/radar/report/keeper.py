"""Keeps plots and particle clouds for the report of a recording of unknown length, in bounded memory.

Evenly over time, and in each stretch also the cloud where water is least likely: the one at the coast.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array, X, Y
from elusive.systems.radar.report.contents import AT_COAST, Cloud

PLOTS_AT_MOST = 20_000
CLOUDS_AT_MOST = 480  # kept evenly; as many again at the coast
PARTICLES_SHOWN = 200  # of a cloud

Draw = Callable[[], tuple[Array, Array, Array, Array | None]]


class _Stretch(NamedTuple):
    """What is kept of a track over some scans."""

    first: Cloud
    lowest: Cloud  # at which water is least likely


class RadarKeeper:
    """Keeps what the report draws.

    Each scan is given by :meth:`scan`, then each living track by :meth:`offer`. When there are too many plots, those of
    every second scan kept are dropped; when too many clouds, pairs of stretches are merged.

    Parameters
    ----------
    plots, clouds
        How many are kept at most; of clouds, twice as many: as many again at the coast.
    """

    def __init__(self, *, plots: int = PLOTS_AT_MOST, clouds: int = CLOUDS_AT_MOST) -> None:
        self._most_plots, self._most_clouds = plots, clouds
        self._time, self._scan = math.nan, -1
        self._seen = np.zeros((0, 2))
        self._plots: list[tuple[int, Array]] = []  # number of the scan, (n, 3)
        self._kept = 0  # plots in these
        self._every = 1  # scans whose plots are kept
        self._stretches: dict[tuple[int, int], _Stretch] = {}  # by stretch and track
        self._long = 1  # scans a stretch
        self._taken = 0  # stretches that the scan began

    def scan(self, time_s: float, plots: Array) -> None:
        """Take a scan's plots ``(n, 2)`` [m]."""
        self._time, self._seen, self._taken = time_s, np.array(plots, dtype=np.float64).reshape(-1, 2), 0
        self._scan += 1
        if self._scan % self._every or not len(self._seen):
            return
        self._plots.append((self._scan, np.insert(self._seen[: self._most_plots], 0, time_s, axis=1)))
        self._kept += len(self._plots[-1][1])
        while self._kept > self._most_plots:
            self._every *= 2
            self._plots = [one for one in self._plots if one[0] % self._every == 0]
            self._kept = sum(len(part) for _, part in self._plots)

    def offer(self, track: int, water: float, draw: Draw) -> None:
        """Take a track's cloud after the scan, if it is worth keeping.

        Parameters
        ----------
        track
            Its number.
        water
            P(water) where it is; NaN without a chart.
        draw
            Gives states ``(N, d)`` x, vx, y, vy, ... or places ``(N, 2)``, weights ``(N,)``, the mean and the mode (or
            None); called only for a cloud that is kept.
        """
        key = (self._scan // self._long, track)
        kept = self._stretches.get(key)
        if kept is None:
            # a scan of very many tracks must not fill the memory by itself
            if self._taken < max(1, self._most_clouds // 4):
                self._taken += 1
                cloud = self._cloud(track, water, draw)
                self._stretches[key] = _Stretch(cloud, cloud)
        elif water < kept.lowest.water:
            self._stretches[key] = kept._replace(lowest=self._cloud(track, water, draw))
        while len(self._stretches) > self._most_clouds:
            if self._long > self._scan:  # nothing is left to merge: more tracks than clouds may be kept
                nearest = sorted(self._stretches.items(), key=lambda item: item[1].lowest.water)
                self._stretches = dict(nearest[: self._most_clouds // 2])
            else:
                self._merge()

    def _cloud(self, track: int, water: float, draw: Draw) -> Cloud:
        states, weights, mean, mode = draw()
        at = [X, Y] if states.shape[1] >= 4 else [0, 1]
        chosen = _evenly(weights, PARTICLES_SHOWN)
        place = np.array(mean[at if len(mean) >= 4 else [0, 1]])
        top = None if mode is None else np.array(mode[at if len(mode) >= 4 else [0, 1]])
        return Cloud(self._time, track, states[chosen][:, at], place, top, self._seen, water)

    def _merge(self) -> None:
        self._long *= 2
        merged: dict[tuple[int, int], _Stretch] = {}
        for (number, track), late in sorted(self._stretches.items()):
            early = merged.get((number // 2, track), late)
            lowest = late.lowest if late.lowest.water < early.lowest.water else early.lowest
            merged[number // 2, track] = _Stretch(early.first, lowest)
        self._stretches = merged

    @property
    def plots(self) -> Array:
        """Time [s], x and y [m] of the plots kept, ``(P, 3)``."""
        return np.concatenate([np.zeros((0, 3)), *(part for _, part in self._plots)])

    @property
    def clouds(self) -> list[Cloud]:
        """The clouds kept, in order of time."""
        kept = {id(cloud): cloud for stretch in self._stretches.values() for cloud in _worth(stretch)}
        return sorted(kept.values(), key=lambda cloud: (cloud.time_s, cloud.track))


def _worth(stretch: _Stretch) -> list[Cloud]:
    return [stretch.first, *([stretch.lowest] if stretch.lowest.water < AT_COAST else [])]


def _evenly(weights: Array, most: int) -> NDArray[np.int64]:
    """Choose particles in proportion to their weights, without a draw: the reported numbers stay as they are."""
    count = min(most, len(weights))
    total = np.cumsum(weights)
    steps = (np.arange(count) + 0.5) / count * total[-1]
    chosen: NDArray[np.int64] = np.minimum(np.searchsorted(total, steps), len(weights) - 1)
    return chosen
