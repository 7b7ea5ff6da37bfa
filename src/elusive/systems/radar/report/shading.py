"""The chart under a report: land cut to what is shown, and P(water) finer along the tracks than elsewhere.

Rings are cut by Sutherland and Hodgman (1974), one side of the window after the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.report.extents import Extent
from elusive.systems.radar.report.contents import ChartMap, RadarTracked, WaterRaster

SIDE = 448  # cells a side of the rasters of all that is shown
TILE = 64  # cells a side of a tile along the tracks
TILES_AT_MOST = 120
TRIED_AT_MOST = 5000
COARSELY = 8  # places a side at which a tile is tried
VARIES = 0.002  # of P(water) within a tile that is worth drawing
VERTICES_AT_MOST = 50_000
FINEST_M = 0.1  # distance of vertices, to begin with

Probability = Callable[[Array], Array]


def chart_map(land: Iterable[Array], water: Probability | None, tracked: RadarTracked, cell_m: float) -> ChartMap:
    """Prepare the chart for a report.

    Parameters
    ----------
    land
        Rings ``(V, 2)`` [m], as many as there are; holes turn the other way than outer ones.
    water
        Gives P(water) of places ``(N, 2)`` [m], ``(N,)``, NaN where nothing is known; None: no chart was used.
    tracked
        The report without a chart: what the map is to show.
    cell_m
        Width of a cell where the tracks are [m]; a third of the coast's deviation shows it well.

    Raises
    ------
    ParameterError
        If the width of a cell is not positive and finite.
    """
    if not 0 < cell_m < math.inf:
        raise ParameterError(f"cell_m: must be positive and finite, not {cell_m}.")
    near = _square(tracked.extent, 1.3)
    window = _square(near, 4.0)
    rings = _thinned([cut for ring in land if len(cut := _cut(ring, window))])
    if water is None:
        return ChartMap(rings, [], window)
    rasters = [_raster(water, extent, SIDE) for extent in (window, near)]
    width = (near[1] - near[0]) / SIDE
    if width > cell_m:
        rasters += _tiles(water, tracked, cell_m, width)
    return ChartMap(rings, rasters, window)


def _square(extent: Extent, times: float) -> Extent:
    west, east, south, north = extent
    x, y, half = 0.5 * (west + east), 0.5 * (south + north), 0.5 * times * max(east - west, north - south)
    return x - half, x + half, y - half, y + half


def _raster(water: Probability, extent: Extent, side: int) -> WaterRaster:
    west, east, south, north = extent
    steps = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(west + steps * (east - west), south + steps * (north - south))
    return WaterRaster(extent, water(np.column_stack([x.ravel(), y.ravel()])).reshape(side, side))


def _tiles(water: Probability, tracked: RadarTracked, cell_m: float, coarse_m: float) -> list[WaterRaster]:
    """Return fine rasters where a track is near the coast; coarser ones where there would be too many."""
    places = [*(path.places for path in tracked.paths), *(ship[:, 1:3] for ship in tracked.ships)]
    if not places:
        return []
    along = np.concatenate(places)
    while cell_m < coarse_m:
        side = TILE * cell_m
        around = [along + side / 3 * np.array([i, j]) for i in (-1, 1) for j in (-1, 1)]
        corners = np.unique(np.floor(np.concatenate(around) / side), axis=0) * side
        if len(corners) > TRIED_AT_MOST:
            cell_m *= 2
            continue
        steps = (np.arange(COARSELY) + 0.5) / COARSELY * side
        inside = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        tried = water((corners[:, None] + inside).reshape(-1, 2)).reshape(len(corners), -1)
        varied = np.isfinite(tried).any(axis=1) & ~(np.ptp(tried, axis=1) <= VARIES)
        if varied.sum() <= TILES_AT_MOST:
            # a cell more on each side, so that neighbours join without a seam
            edges = [
                (x - cell_m, x + side + cell_m, y - cell_m, y + side + cell_m) for x, y in corners[varied].tolist()
            ]
            return [_raster(water, extent, TILE + 2) for extent in edges]
        cell_m *= 2
    return []


def _cut(ring: Array, window: Extent) -> Array:
    """Return what of a ring lies in a window, closed along the window's sides."""
    west, east, south, north = window
    if len(ring) < 3 or (ring.max(axis=0) <= [west, south]).any() or (ring.min(axis=0) >= [east, north]).any():
        return np.zeros((0, 2))
    for axis, sign, bound in ((0, 1, west), (0, -1, east), (1, 1, south), (1, -1, north)):
        depth = sign * (ring[:, axis] - bound)
        after, following = np.roll(depth, -1), np.roll(ring, -1, axis=0)
        crosses = (depth >= 0) != (after >= 0)
        share = np.divide(depth, depth - after, out=np.zeros(len(ring)), where=crosses)
        crossing = ring + share[:, None] * (following - ring)
        crossing[crosses, axis] = bound
        both = np.stack([ring, crossing], axis=1).reshape(-1, 2)
        ring = both[np.column_stack([depth >= 0, crosses]).ravel()]
    return ring


def _thinned(rings: list[Array]) -> list[Array]:
    """Leave out vertices that follow closely on others, as few as keep their number bounded."""
    apart = FINEST_M
    while True:
        kept = [ring[_apart(ring, apart)] for ring in rings]
        kept = [ring for ring in kept if len(ring) >= 3]
        if sum(map(len, kept)) <= VERTICES_AT_MOST:
            return kept
        apart *= 2


def _apart(ring: Array, apart: float) -> NDArray[np.bool_]:
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ring, axis=0).T))])
    step = np.floor(along / apart)
    return np.concatenate([np.ones(1, bool), step[1:] != step[:-1]])
