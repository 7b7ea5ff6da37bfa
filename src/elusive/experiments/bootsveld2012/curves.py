"""Figures A.4 to A.7, A.12, A.13, B.3, B.4, B.7 to B.10 and B.15 to B.18 of Bootsveld (2012): bias and deviation.

The thesis's std is a variance by its formula; here it is the deviation of the estimates over the runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import xarray as xr

from elusive.contracts import Array
from elusive.experiments.bootsveld2012.case import CANAL_METHODS, PORT_METHODS, Method, Way
from elusive.experiments.bootsveld2012.trial import Estimate
from elusive.experiments.means import standard_error
from elusive.report import plots

INSIDE_99 = 9.2103  # squared Mahalanobis distance within which a plane Gaussian has 99 % of its mass
Measure = Literal["bias", "std", "error"]


class Curve(NamedTuple):
    """What a figure of the thesis shows."""

    way: Way
    axis: Literal["x", "y"]
    measure: Measure  # over the runs, or the error of the first run
    thesis: tuple[Method, ...]  # the filters that it shows


class Point(NamedTuple):
    """One row of a figure's CSV."""

    time_s: int
    method: str
    value_m: float
    standard_error_m: float  # NaN for a single run


class Summary(NamedTuple):
    """One row of ``summary.csv``: a filter over all runs and seconds from the tenth on."""

    way: str
    method: str
    estimate: str
    runs: int
    rmse_m: float  # of the position
    standard_error_m: float
    inside: float  # share of seconds in which the filter's own 99 % ellipse holds the ship
    left_out: float  # share of seconds in which the map forbade what was measured


FIGURES: dict[str, Curve] = {
    "a4": Curve("canal-middle", "x", "bias", ("none", "hard")),
    "a5": Curve("canal-middle", "x", "std", ("none", "hard")),
    "a6": Curve("canal-coast", "x", "bias", ("none", "hard")),
    "a7": Curve("canal-coast", "x", "std", ("none", "hard")),
    "a12": Curve("canal-imprecise", "x", "bias", ("none", "hard", "interval")),
    "a13": Curve("canal-imprecise", "x", "std", ("none", "hard", "interval")),
    "b3": Curve("port-imprecise", "x", "error", ("nearest", "grid")),
    "b4": Curve("port-imprecise", "y", "error", ("nearest", "grid")),
    "b7": Curve("port-perfect", "x", "bias", ("none", "hard")),
    "b8": Curve("port-perfect", "x", "std", ("none", "hard")),
    "b9": Curve("port-perfect", "y", "bias", ("none", "hard")),
    "b10": Curve("port-perfect", "y", "std", ("none", "hard")),
    "b15": Curve("port-imprecise", "x", "bias", ("none", "hard", "grid")),
    "b16": Curve("port-imprecise", "x", "std", ("none", "hard", "grid")),
    "b17": Curve("port-imprecise", "y", "bias", ("none", "hard", "grid")),
    "b18": Curve("port-imprecise", "y", "std", ("none", "hard", "grid")),
}
TITLES: dict[Way, str] = {
    "canal-middle": "Canal, perfect chart, along the middle",
    "canal-coast": "Canal, perfect chart, along the coast",
    "canal-imprecise": "Canal, imprecise chart, along the true coast",
    "port-perfect": "Port, perfect chart",
    "port-imprecise": "Port, imprecise chart, over charted land",
}
NAMES: dict[Method, str] = {
    "none": "PF1: no chart",
    "hard": "PF2: hard",
    "interval": "PF3: eq. 4.8",
    "nearest": "nearest edge",
    "grid": "PF4: grid",
    "exact": "exact",
    "field": "field",
}
COLOURS: dict[Method, str] = {
    "none": "#dc2626",
    "hard": "#1d4ed8",
    "interval": "#65a30d",
    "nearest": "#0f766e",
    "grid": "#ca8a04",
    "exact": "#111827",
    "field": "#7c3aed",
}
FIRST_S = 10  # of the summary: the filters have found their feet


def methods_of(way: Way) -> tuple[Method, ...]:
    """All filters that are run along a way."""
    return CANAL_METHODS if way.startswith("canal") else PORT_METHODS


def name_of(method: Method, way: Way) -> str:
    """Name a filter as the thesis does: its PF3 is the interval in the canal, the nearest edge at the port."""
    if way.startswith("port"):
        return "PF3: nearest edge" if method == "nearest" else NAMES[method]
    return "grid" if method == "grid" else NAMES[method]


def points(results: xr.Dataset, figure: Curve) -> list[Point]:
    """Reduce the runs of a way, their first estimate, to a figure's curves: every filter's."""
    errors = results["error"].transpose("trial", "method", "estimate", "time", "axis").values
    found = []
    for number, method in enumerate(methods_of(figure.way)):
        of_runs = errors[:, number, 0, :, "xy".index(figure.axis)]
        value, spread = _MEASURES[figure.measure](of_runs)
        found += [
            Point(second, method, float(v), float(s))
            for second, v, s in zip(range(1, len(value) + 1), value, spread, strict=True)
        ]
    return found


def bias(of_runs: Array) -> tuple[Array, Array]:
    """Mean error over runs ``(runs, time)`` and its standard error; NaN for a single run."""
    runs = len(of_runs)
    spread = of_runs.std(axis=0, ddof=1) / np.sqrt(runs) if runs > 1 else np.full(of_runs.shape[1], np.nan)
    return of_runs.mean(axis=0), spread


def deviation(of_runs: Array) -> tuple[Array, Array]:
    """Deviation of estimates over runs ``(runs, time)`` and its standard error, whatever their distribution."""
    runs = len(of_runs)
    if runs < 2:
        return np.full(of_runs.shape[1], np.nan), np.full(of_runs.shape[1], np.nan)
    squares = (of_runs - of_runs.mean(axis=0)) ** 2
    variance = squares.sum(axis=0) / (runs - 1)
    with np.errstate(invalid="ignore"):
        spread = squares.std(axis=0, ddof=1) / np.sqrt(runs) / (2 * np.sqrt(variance))
    return np.sqrt(variance), spread


def first_error(of_runs: Array) -> tuple[Array, Array]:
    """Error of the first run."""
    return of_runs[0], np.full(of_runs.shape[1], np.nan)


_MEASURES = {"bias": bias, "std": deviation, "error": first_error}


def summarise(way: Way, results: xr.Dataset, estimate: Estimate) -> list[Summary]:
    """Reduce the runs of a way to a row for each filter."""
    late = results.isel(time=slice(FIRST_S - 1, None))
    rows = []
    for number, method in enumerate(methods_of(way)):
        at = late.isel(method=number)
        of_runs = at["error"].isel(estimate=0).transpose("trial", "time", "axis").values
        squares = (of_runs**2).sum(axis=2).mean(axis=1)
        rmse, runs = float(np.sqrt(squares.mean())), len(squares)
        spread = standard_error(squares) / (2 * rmse)
        inside = float((at["apart"].values <= INSIDE_99).mean())
        rows.append(Summary(way, method, estimate, runs, rmse, spread, inside, float(at["forbidden"].values.mean())))
    return rows


def draw(path: Path, rows: Sequence[Point], figure: Curve, note: str) -> None:
    """Draw one figure: the thesis's filters thick, the others thin, with bands of a standard error."""
    with plots.figure(path, 7.0, 3.9) as (drawn, grid):
        axes = grid[0, 0]
        for method in methods_of(figure.way):
            table = [(p.time_s, p.value_m, p.standard_error_m) for p in rows if p.method == method]
            seconds, value, spread = np.array(table, dtype=np.float64).T
            own = method in figure.thesis
            style = (
                {"linewidth": 1.8, "zorder": 3} if own else {"linewidth": 1.0, "linestyle": (0, (4, 2)), "zorder": 2}
            )
            axes.plot(seconds, value, color=COLOURS[method], label=name_of(method, figure.way), **style)
            if own:
                low, high = value - spread, value + spread
                axes.fill_between(seconds, low, high, color=COLOURS[method], alpha=0.15, linewidth=0)
        if figure.measure != "std":
            axes.axhline(0.0, color=plots.MUTED, linewidth=0.8, zorder=1)
        what = {"bias": "mean bias", "std": "standard deviation", "error": "error of the first run"}[figure.measure]
        axes.set(xlabel="time [s]", ylabel=f"{what} of {figure.axis} [m]", xlim=(0, None))
        axes.set_title(TITLES[figure.way])
        axes.text(1.0, 1.02, note, transform=axes.transAxes, ha="right", va="bottom", fontsize=8, color=plots.MUTED)
        drawn.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
