"""What a report of radar tracks is made from: plain arrays in metres, x east and y north of the radar."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.io.truth import Truth
from elusive.report.extents import Extent
from elusive.results import Scored

AT_COAST = 0.95  # P(water) below which a cloud counts as being at the coast
NARROWEST_M = 40.0  # of what is shown


class WaterRaster(NamedTuple):
    """P(water) over a rectangle."""

    extent: Extent  # outer edges of the cells
    probability: Array  # (rows, columns) at the cells' centres, the first row in the south; NaN where nothing is known


class ChartMap(NamedTuple):
    """Charted land and, where a chart was used as knowledge, how likely water is."""

    land: Sequence[Array]  # rings (V, 2) [m]; holes turn the other way than outer ones
    rasters: Sequence[WaterRaster]  # coarse first
    window: Extent | None = None  # what the land is cut to


class RadarPath(NamedTuple):
    """A track over time."""

    track: int
    times_s: Array  # (k,) of the scans, ascending
    places: Array  # (k, 2) [m]
    velocity: Array  # (k, 2) [m/s]
    deviation: Array  # (k, 2) of x and y [m]
    confirmed: NDArray[np.bool_]  # (k,)
    forbidden: NDArray[np.bool_]  # (k,) whether the map forbade every particle and was left out
    covariance: Array | None = None  # (k,) of x and y [m^2]; None: taken as zero
    allowed: Array | None = None  # (k,) P(the map allows the target | measurements); None: no map was used
    existence: Array | None = None  # (k,) posterior probability that it is a ship
    length: Array | None = None  # (k, 2) of its hull and deviation [m]; None: a point
    moves: Array | None = None  # (k,) posterior probability that it moves over ground; None: not asked

    @property
    def rests(self) -> bool:
        """Whether it never moved, more likely than not, while it was confirmed."""
        return self.moves is not None and bool((self.moves[self.confirmed] < 0.5).all())

    @property
    def spread(self) -> Array:
        """Standard deviation of the place, both axes together, ``(k,)`` [m]."""
        return np.asarray(np.hypot(*self.deviation.T))


class Cloud(NamedTuple):
    """The particles of a track at one time."""

    time_s: float
    track: int
    particles: Array  # (M, 2) of equal weight [m]
    mean: Array  # (2,) [m]
    mode: Array | None  # (2,) the maximum a posteriori estimate [m]
    plots: Array  # (n, 2) of the scan [m]
    water: float  # P(water) at the estimate; NaN without a chart


class RadarTracked(NamedTuple):
    """A tracked recording."""

    title: str
    verdict: str
    times_s: Array  # (T,) of the scans
    plots: Array  # (P, 3) time [s], x and y [m]
    paths: Sequence[RadarPath]
    clouds: Sequence[Cloud]
    truth: Truth | None  # None where it is not known
    rows: Sequence[tuple[str, str]]  # what the table about the run says
    header: Sequence[str]  # of the table of tracks
    tracks: Sequence[Sequence[str]]  # its lines; the first cell is the number of the track
    chart: ChartMap | None = None
    lonlat: Callable[[Array], Array] | None = None  # (N, 2) [m] to longitude and latitude (N, 2) [deg]
    estimate: str = "mean"  # what the places are
    scored: Scored | None = None  # None without a truth
    way: Array = np.zeros((1, 3))  # (S, 3) times and places of the radar itself [s, m]; one row where it rests

    @property
    def ships(self) -> Sequence[Array]:
        """Where each ship truly is, ``(K, 3)`` time [s], x and y [m], ascending in time; none where it is not known."""
        return () if self.truth is None else self.truth.paths

    def error(self, path: RadarPath) -> Array | None:
        """Distance of a track to the nearest ship, ``(k,)`` [m], NaN where none is known; None without a truth."""
        return None if self.truth is None else self.truth.distance(path.times_s, path.places)

    @property
    def nearest_error(self) -> tuple[Array, Array] | None:
        """Times at which there is a track and a truth, and the distance of the nearest track to it [m]; None: never."""
        found = [error for path in self.paths if (error := self.error(path)) is not None]
        if not found or not np.isfinite(np.concatenate(found)).any():
            return None
        times, errors = np.concatenate([path.times_s for path in self.paths]), np.concatenate(found)
        order = np.lexsort((errors, times))  # NaN last
        times, errors = times[order], errors[order]
        first = np.concatenate([[True], times[1:] != times[:-1]]) & np.isfinite(errors)
        return times[first], errors[first]

    @property
    def extent(self) -> Extent:
        """What of the plane the tracks and the truth take up, with a margin; without either, the plots."""
        parts = [
            *(path.places for path in self.paths),
            *(ship[:, 1:3] for ship in self.ships),
        ]
        if not sum(map(len, parts)):
            parts = [self.plots[:, 1:]] if len(self.plots) else [np.array([[-1000.0, -1000.0], [1000.0, 1000.0]])]
        low, high = np.concatenate(parts).min(axis=0), np.concatenate(parts).max(axis=0)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        half = np.maximum(half + 0.1 * half.max(), 0.5 * NARROWEST_M)
        (west, south), (east, north) = middle - half, middle + half
        return float(west), float(east), float(south), float(north)

    def drawn_clouds(self) -> list[Cloud]:
        """Return the clouds of the tracks that are drawn, in order of time."""
        drawn = {path.track for path in self.paths}
        return sorted((cloud for cloud in self.clouds if cloud.track in drawn), key=lambda cloud: cloud.time_s)

    def telling_clouds(self, most: int) -> list[Cloud]:
        """Choose clouds at the coast, where water is least likely; if none is there, evenly; in order of time."""
        clouds = self.drawn_clouds()
        if not clouds:
            return []
        apart = (self.times_s[-1] - self.times_s[0]) / (3 * most)
        near = sorted((cloud for cloud in clouds if cloud.water < AT_COAST), key=lambda cloud: cloud.water)
        even = [clouds[(2 * k + 1) * len(clouds) // (2 * most)] for k in range(most)]
        chosen: list[Cloud] = []
        for cloud in near or even:
            if len(chosen) < most and all(abs(cloud.time_s - other.time_s) > apart for other in chosen):
                chosen.append(cloud)
        return sorted(chosen, key=lambda cloud: cloud.time_s)
