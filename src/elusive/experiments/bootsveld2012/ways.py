"""Figures 5.1, 6.1, A.1 to A.3, B.1 and B.2 of Bootsveld (2012): the two scenes, and the ship's ways through them.

Beside each way its distance to the charted coast, which the thesis tells in words.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from elusive.charts.index import index_edges
from elusive.charts.nearest import signed_distances
from elusive.contracts import Array, X, Y
from elusive.experiments.bootsveld2012.case import HALF_WIDTH_M, MARGIN_M, OFF_COAST_M, ShipCase, Way, scenery
from elusive.experiments.bootsveld2012.clouds import LAND, draw_land
from elusive.experiments.bootsveld2012.shore import shoreline
from elusive.io.csv_files import write_results
from elusive.report import plots

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FIGURES: dict[str, tuple[Way, ...]] = {
    "a1": ("canal-middle",),
    "a2": ("canal-coast",),
    "a3": ("canal-imprecise",),
    "b1": ("port-perfect",),
    "b2": ("port-imprecise",),
    "fig5_1": ("canal-middle", "canal-coast", "canal-imprecise"),
    "fig6_1": ("port-perfect", "port-imprecise"),
}
NAMES: dict[Way, str] = {
    "canal-middle": "along the middle",
    "canal-coast": "along the coast of a perfect chart",
    "canal-imprecise": "along the true coast, an imprecise chart",
    "port-perfect": "a perfect chart",
    "port-imprecise": "an imprecise chart",
}
MARK_S = 10  # between marks on a way
KM = 1e-3


class WayRow(NamedTuple):
    """One row of ``a1.csv`` to ``a3.csv``, ``b1.csv`` and ``b2.csv``."""

    time_s: int
    x_m: float
    y_m: float
    off_coast_m: float  # distance to the charted coast, negative on charted land


def off_coast(case: ShipCase) -> Array:
    """Distance ``(T,)`` of the ship from the charted coast [m], negative on charted land."""
    scene = scenery(case)
    x, y = scene.truth[:, [X, Y]].T.copy()
    near = index_edges(scene.coast.land, MARGIN_M)  # the chart is cut farther off
    return signed_distances(near, scene.coast.on_border, x, y, np.ones(len(x), dtype=bool))


def draw_ways(folder: Path, name: str, cases: Sequence[ShipCase]) -> None:
    """Write one figure: a scene with its ways; a way alone with its distance to the coast, and as CSV."""
    if len(cases) > 1:
        with plots.figure(folder / f"{name}.png", 6.8, 5.8) as (drawn, grid):
            _draw_scene(grid[0, 0], cases)
            drawn.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
        return
    (case,) = cases
    truth, away = scenery(case).truth[:, [X, Y]], off_coast(case)
    rows = [WayRow(t, float(x), float(y), float(d)) for t, ((x, y), d) in enumerate(zip(truth, away, strict=True))]
    write_results(folder / f"{name}.csv", WayRow._fields, rows)
    low = min(1.2 * float(away.min()), -0.2 * float(away.max()))
    with plots.figure(folder / f"{name}.png", 9.6, 4.4, 1, 2) as (drawn, grid):
        left, right = grid[0]
        _draw_way(left, case)
        right.axhspan(low, 0.0, color=LAND, label="charted land")
        right.plot(away, color=plots.ESTIMATE)
        right.set(xlabel="t [s]", ylabel="from the charted coast [m]", xlim=(0, len(away) - 1))
        right.set_ylim(bottom=low)
        right.set_title("Distance to the charted coast")
        handles, labels = left.get_legend_handles_labels()
        land, named = right.get_legend_handles_labels()
        drawn.legend(handles + land, labels + named, loc="outside lower center", ncols=5)


def _draw_way(axes: Axes, case: ShipCase) -> None:
    scene = scenery(case)
    truth = scene.truth[:, [X, Y]]
    axes.grid(visible=False)
    draw_land(axes, scene.land)
    if case.in_canal:
        axes.set(xlim=(-2.4 * HALF_WIDTH_M, 2.4 * HALF_WIDTH_M), ylim=(truth[0, 1] - 30, truth[-1, 1] + 30))
        axes.set_title("The ship's way; x is stretched")
        if case.way == "canal-imprecise":
            axes.plot(truth[:, 0] - OFF_COAST_M, truth[:, 1], "--", color=plots.TRUTH, lw=1.2, label="true coast")
    else:
        middle = 0.5 * (truth.min(axis=0) + truth.max(axis=0))
        half = 0.55 * float(np.ptp(truth, axis=0).max())
        axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half), aspect="equal")
        axes.set_title("The ship's way")
    axes.plot(*truth.T, color=plots.ESTIMATE, lw=1.4, zorder=3, label=NAMES[case.way])
    axes.plot(*truth[::MARK_S].T, "o", color=plots.ESTIMATE, ms=3.5, zorder=3, label=f"each {MARK_S} s")
    axes.plot(*truth[0], "D", mfc="white", mec=plots.ESTIMATE, ms=6, zorder=4, label="start")
    axes.set(xlabel="x, east [m]", ylabel="y, north [m]")


def _draw_scene(axes: Axes, cases: Sequence[ShipCase]) -> None:
    """All ways of a scene on its map; the port's in the map's own frame, since each way has its own radar."""
    axes.grid(visible=False)
    first = cases[0]
    if first.in_canal:
        truth = scenery(first).truth[:, [X, Y]]
        draw_land(axes, scenery(first).land)
        axes.set(xlim=(-3 * HALF_WIDTH_M, 3 * HALF_WIDTH_M), ylim=(truth[0, 1] - 60, truth[-1, 1] + 60))
        axes.set(xlabel="x, east [m]", ylabel="y, north [m]", title="A canal 50 m wide; the radar is at (0, 0)")
        unit = 1.0
    else:
        import shapely

        land = shoreline(first.shoreline, first.delta_seed)
        unit = KM
        draw_land(axes, list(shapely.transform(np.array(land, dtype=object), lambda at: at * KM)), width=0.5)
        west, south, east, north = (KM * edge for edge in shapely.total_bounds(np.array(land, dtype=object)))
        axes.set(xlim=(west, east), ylim=(south, north), aspect="equal")
        axes.set(xlabel="x, east [km]", ylabel="y, north [km]", title="The map, and the ship's ways")
    for case, colour in zip(cases, plots.TRACKS, strict=False):
        scene = scenery(case)
        way = unit * (scene.truth[:, [X, Y]] - scene.moved)
        axes.plot(*way.T, color=colour, lw=2.2, zorder=3, label=NAMES[case.way])
        axes.plot(*way[0], "D", mfc="white", mec=colour, ms=6, zorder=4)
