"""What the player of the charts shows: for each use of the chart P(water), the particle cloud, plots, track, truth."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.charts import ExactWater, GridWater, HardWater, Water, WaterModel
from elusive.contracts import Array
from elusive.systems.radar.page.maps import raster_of
from elusive.systems.radar.page.state import Extent
from elusive.systems.radar.scene_run import Sailed, Used
from elusive.workbench.blocks import Panel, player_spec

SIDE = 220  # pixels along the longer side
FINE_SIDE = 900  # of what close views are cut from
CLOSE_SIDE = 90
DARKEST, BRIGHTEST, UNKNOWN = 35, 175, 90  # of land, water and the unknown, beneath marks
CLOUD = "#ffb000"
SPREADS = 6.0  # deviations of a track that a close view reaches
NARROWEST_M = 25.0
RING = 0.02  # radius of a plot's ring, to the width
LEGEND = (
    "light: water, dark: land, as this use of the chart has it", "amber: particles", "ring: plot", "+ true place",
    "green: estimate; line: the last 25 of it",
)  # fmt: skip


def watch_spec(sailed: Sailed, *, close: bool = False) -> dict[str, Any]:
    """Return a player; ``close``: from above the ship, moving along, places told from its true one."""
    shown = [one for one in sailed.each if one.outcome is not None]
    half = _reach(shown)
    low, high = sailed.truth.min(axis=0), sailed.truth.max(axis=0)
    room = max(half, 0.08 * float((high - low).max()))
    whole = (float(low[0] - room), float(high[0] + room), float(low[1] - room), float(high[1] + room))
    extent = (-half, half, -half, half) if close else whole
    centres = sailed.truth if close else np.zeros_like(sailed.truth)
    panels, marks = [], []
    for one in shown:
        water = _water(one, sailed)
        if close:
            images = _cut(raster_of(water, whole, FINE_SIDE)[0], whole, sailed.truth, half)
        else:
            still = raster_of(water, whole, SIDE)[0]
            images = np.broadcast_to(still, (len(sailed.truth), *still.shape))
        panels.append(Panel(one.name, _grey(images), colours="grey"))
        marks.append(_marks(one, sailed, centres, RING * (extent[1] - extent[0]), close=close))
    interval_s = float(np.median(np.diff(sailed.times_s)))
    return player_spec(
        "The ship at the coast, by each use of the chart", panels, extent, marks=marks, interval_s=interval_s,
        legend=list(LEGEND),
    )  # fmt: skip


def _water(one: Used, sailed: Sailed) -> Water:
    """P(water) as this use of the chart has it; without any, land as it is charted, for the eye alone."""
    knowledge = one.parameters.knowledge
    model = knowledge if isinstance(knowledge, WaterModel) else HardWater()
    if isinstance(model, GridWater):
        model = ExactWater()  # its cells are finer than what is drawn, and take long to fill
    return model.bind(sailed.surroundings.coast)


def _grey(water: Array) -> NDArray[np.uint8]:
    bright = DARKEST + (BRIGHTEST - DARKEST) * np.nan_to_num(water)
    return np.where(np.isnan(water), UNKNOWN, bright).astype(np.uint8)


def _reach(shown: list[Used]) -> float:
    """Half the side of a close view [m]."""
    spreads = [np.median(path.spread) for one in shown if one.outcome for path in one.outcome.tracked.paths]
    return max(NARROWEST_M, SPREADS * float(np.median(spreads)) if spreads else NARROWEST_M)


def _cut(fine: Array, extent: Extent, places: Array, half: float) -> Array:
    """Cut a square about each place from a fine raster, ``(T, side, side)``; NaN beyond it."""
    rows, columns = fine.shape
    off = half * (2 * np.arange(CLOSE_SIDE) + 1 - CLOSE_SIDE) / CLOSE_SIDE
    column = np.floor((places[:, :1] + off - extent[0]) / (extent[1] - extent[0]) * columns).astype(int)
    row = np.floor((places[:, 1:] + off - extent[2]) / (extent[3] - extent[2]) * rows).astype(int)
    cut = fine[np.clip(row, 0, rows - 1)[:, :, None], np.clip(column, 0, columns - 1)[:, None, :]]
    inside = ((row >= 0) & (row < rows))[:, :, None] & ((column >= 0) & (column < columns))[:, None, :]
    return np.where(inside, cut, np.nan)


def _marks(one: Used, sailed: Sailed, centres: Array, ring_m: float, *, close: bool) -> list[list[Any]]:
    assert one.outcome is not None
    tracked = one.outcome.tracked
    marks: list[list[Any]] = [[] for _ in sailed.times_s]
    drawn = {path.track for path in tracked.paths}

    def scan_of(times_s: Any) -> Any:
        return np.clip(np.searchsorted(sailed.times_s, np.asarray(times_s) - 1e-6), 0, len(marks) - 1)

    for cloud in tracked.clouds:
        if cloud.track in drawn:
            scan = int(scan_of(cloud.time_s))
            dots = np.round(cloud.particles - centres[scan], 1).tolist()
            marks[scan] += [["points", x, y, CLOUD, "", 0] for x, y in dots]
    plots = tracked.plots
    for scan, place in zip(scan_of(plots[:, 0]).tolist(), plots[:, 1:], strict=True):
        x, y = np.round(place - centres[scan], 1).tolist()
        marks[scan].append(["ring", x, y, "", "", round(ring_m, 1)])
    for scan, place in enumerate(np.round(sailed.truth - centres, 1).tolist()):
        marks[scan].append(["truth", *place, "", "", 0])
    for path in tracked.paths:
        for scan, place, sure in zip(scan_of(path.times_s).tolist(), path.places, path.confirmed, strict=True):
            x, y = np.round(place - centres[scan], 1).tolist()
            # a line of places that are told from a moving one would be none of a way
            kind, colour = "head" if close else "track", "CONFIRMED" if sure else "CANDIDATE"
            marks[scan].append([kind, x, y, colour, str(path.track) if len(drawn) > 1 else "", 0])
    return marks
