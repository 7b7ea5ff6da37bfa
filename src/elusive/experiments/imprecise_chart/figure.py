"""The table as curves, and the run on which the hard map lost the ship most: both charts, the truth, three tracks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from elusive.charts.coast import rings_of
from elusive.contracts import Array, X, Y
from elusive.experiments.imprecise_chart.charts import Case, charts
from elusive.experiments.imprecise_chart.table import REGION_999, WINDOW_S, Row
from elusive.experiments.imprecise_chart.trial import ImpreciseChartTrial, follow, simulate
from elusive.report import plots

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AROUND_M = 40.0  # of the route, on the map
STEADY = 0.03  # standard error of a share; a point less sure may lie beyond the axes
ELLIPSES_S = 33  # between two regions on the map


class Drawn(NamedTuple):
    """How a filter is drawn."""

    label: str
    colour: str
    open_marker: bool = False


CURVES = {
    Case("none"): Drawn("no map", plots.MUTED),
    Case("hard"): Drawn("hard map", plots.SERIES[1]),
    Case("field", 7.0): Drawn("imprecise, new error each second, 7 m", plots.SERIES[0]),
    Case("field", 20.0): Drawn("imprecise, new error each second, 20 m", plots.SERIES[0], True),
    Case("field", 7.0, "persistent"): Drawn("imprecise, error that persists, 7 m", plots.SERIES[2]),
    Case("field", 20.0, "persistent"): Drawn("imprecise, error that persists, 20 m", plots.SERIES[2], True),
}
ON_MAP = (Case("none"), Case("hard"), Case("field", 7.0, "persistent"))


def draw(path: Path, rows: list[Row], parameters: ImpreciseChartTrial, seed: int, worst: int) -> None:
    """Draw the table, and run ``worst`` of a campaign's."""
    ranges = list(dict.fromkeys(row.range_m for row in rows))
    with plots.figure(path, 10.5, 8.6, 2, 2) as (drawn, grid):
        for axes, distance in zip(grid[0], ranges, strict=False):
            _errors(axes, [row for row in rows if row.range_m == distance])
            axes.set_title(f"Radar {distance} away")
        _lost(grid[1, 0], [row for row in rows if row.range_m == ranges[0]])
        _map(grid[1, 1], parameters, seed, worst)
        plots.headline(
            drawn,
            f"A ship along the coast of {Path(parameters.fine).stem}, tracked with {Path(parameters.coarse).stem}: "
            f"{rows[0].runs} runs a point, ± 1 standard error",
        )
        handles, labels = grid[0, 0].get_legend_handles_labels()
        for handle, label in zip(*grid[1, 1].get_legend_handles_labels(), strict=True):
            if label not in labels:
                handles.append(handle)
                labels.append(label)
        drawn.legend(handles, labels, loc="outside lower center", ncols=3)


def rows_of(rows: list[Row], case: Case) -> list[Row]:
    """Rows of one filter."""
    sigma = "" if case.sigma_m is None else f"{case.sigma_m:g}"
    return [
        row
        for row in rows
        if (row.knowledge, row.sigma) == (case.knowledge, sigma) and row.coast_error in ("", case.coast_error)
    ]


def _errors(axes: Axes, rows: list[Row]) -> None:
    without = rows_of(rows, Case("none"))
    steady = [row for case in CURVES for row in rows_of(rows, case) if row.above_none_error < STEADY]
    ends = [100 * (row.above_none + sign * row.above_none_error) for row in steady for sign in (-1.0, 1.0)]
    low, high = min(ends) - 1.5, max(ends) + 1.0
    shown = [case for case in CURVES if case.knowledge != "none"]
    for number, case in enumerate(shown):
        label, colour, open_marker = CURVES[case]
        here = rows_of(rows, case)
        places = np.arange(len(here)) + 0.14 * (number - 0.5 * (len(shown) - 1))
        above = np.array([100 * row.above_none for row in here])
        errors = np.array([100 * row.above_none_error for row in here])
        face = "white" if open_marker else colour
        axes.errorbar(places, above, errors, label=label, color=colour, fmt="o", markersize=5, markerfacecolor=face)
        for place, value in zip(places, above, strict=True):
            if value > high:
                at, to_axes = (place + 0.04, 0.95), axes.get_xaxis_transform()
                axes.annotate(f"{value:+.0f} %", at, xycoords=to_axes, size=7, color=colour)
    axes.axhline(0.0, color=plots.MUTED, linewidth=1.2, label="no map")
    ticks = [f"{row.offset_m:g}\n(no map: {row.rmse_m:.1f} m)" for row in without]
    axes.set_xticks(range(len(without)), ticks)
    axes.set(ylim=(low, high), xlabel="distance of the ship from the coast [m]")
    axes.set_ylabel("RMSE above that without a map [%]")
    axes.grid(visible=False, axis="x")


def _lost(axes: Axes, rows: list[Row]) -> None:
    shown = [case for case in CURVES if case.knowledge != "none"]
    offsets = [row.offset_m for row in rows_of(rows, Case("hard"))]
    width = 0.8 / len(shown)
    for number, case in enumerate(shown):
        _, colour, pale = CURVES[case]
        counts = [row.lost for row in rows_of(rows, case)]
        places = np.arange(len(offsets)) + (number - (len(shown) - 1) / 2) * width
        bars = axes.bar(places, counts, 0.9 * width, color=colour, alpha=0.5 if pale else 1.0)
        axes.bar_label(bars, fontsize=7)
    axes.set_xticks(range(len(offsets)), [f"{offset:g}" for offset in offsets])
    axes.set(xlabel="distance of the ship from the coast [m]", ylabel="runs that lost the ship", ylim=(0, None))
    axes.set_title(f"Ship outside the 99.9 % region for {WINDOW_S} s, radar {rows[0].range_m} away")


def _map(axes: Axes, parameters: ImpreciseChartTrial, seed: int, number: int) -> None:
    both = charts(parameters.fine, parameters.coarse)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    run = simulate(parameters, rng)
    filter_seed = int(rng.integers(2**63))
    truth = run.route.states[:, [X, Y]]
    middle, half = 0.5 * (truth.min(axis=0) + truth.max(axis=0)), 0.5 * np.ptp(truth, axis=0).max() + AROUND_M
    low, high = middle - half, middle + half
    plots.land(axes, _outlines(both.fine_land, low, high))
    for ring in _outlines(both.coarse_land, low, high):
        axes.plot(*ring.T, color="#b91c1c", linewidth=1.2, zorder=2)
    axes.plot([], [], color="#b91c1c", label="coast of the coarse chart")
    axes.plot(*truth.T, color="black", linewidth=1.0, label="truth")
    for case in ON_MAP:
        _, colour, _ = CURVES[case]
        states = follow(parameters, case, run, np.random.default_rng(filter_seed))
        axes.plot(*np.array([state.mean[[X, Y]] for state in states]).T, color=colour, linewidth=1.2)
        for state in states[-1::-ELLIPSES_S]:
            plots.ellipse(axes, state.mean[[X, Y]], state.covariance[np.ix_([X, Y], [X, Y])], REGION_999**0.5, colour)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="east [m]", ylabel="north [m]")
    axes.set_title(f"Run {number}, and 99.9 % regions")
    axes.grid(visible=False)


def _outlines(land: Any, low: Array, high: Array) -> list[Array]:
    """Rings of the land about a rectangle, cut beyond its view."""
    import shapely

    return rings_of(shapely.intersection(land, shapely.box(*(low - AROUND_M), *(high + AROUND_M)))).each
