"""Figures 3 to 8 of Mazurek (2013): mean distance error over the background's deviation, a curve for each window.

Each figure has one object size and one smoothing coefficient. The paper draws the dot product alone; beside it stand
the other statistics, on the same frames.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from elusive.contracts import Array
from elusive.experiments.mazurek2013.scenario import HIGHEST_SIGMA, LOWEST_SIGMA, NoiseObjectCase
from elusive.experiments.mazurek2013.trial import METHODS, STATISTICS, WINDOWS, StatisticName
from elusive.experiments.means import mean_and_error
from elusive.report import plots

# 20 bins of .145: with 1000 cases 50 in each, the standard error of a mean at half the chance level is 26 samples
BIN_EDGES = np.linspace(LOWEST_SIGMA, HIGHEST_SIGMA, 21)
CHANCE_LEVEL = NoiseObjectCase().samples / 4  # 300: the mean distance of two places on a ring taken at random


class Setting(NamedTuple):
    """What a figure of the paper was made with."""

    object_size: int
    smoothing: float


class Point(NamedTuple):
    """One row of ``figN.csv``: the cases of one bin of the background's deviation."""

    object_size: int
    window: int
    smoothing: float
    statistic: str
    background_sigma: float  # middle of the bin
    mean_error: float  # [samples]
    standard_error: float  # NaN where the bin holds one case


FIGURES = {
    "fig3": Setting(3, 0.95),
    "fig4": Setting(3, 0.98),
    "fig5": Setting(5, 0.95),
    "fig6": Setting(5, 0.98),
    "fig7": Setting(7, 0.95),
    "fig8": Setting(7, 0.98),
}


def curves(results: xr.Dataset, figure: Setting) -> list[Point]:
    """Mean error in each bin that holds a case, for every statistic and window.

    Parameters
    ----------
    results
        ``error (object_size, trial, smoothing, method)`` and ``background_sigma (object_size, trial)``, with the
        coordinate ``smoothing`` and the methods in the order of :data:`METHODS`.
    """
    at = results.sel(object_size=figure.object_size)
    errors = at["error"].sel(smoothing=figure.smoothing).transpose("trial", "method").values
    bins = np.clip(np.digitize(at["background_sigma"].values, BIN_EDGES) - 1, 0, len(BIN_EDGES) - 2)
    points = []
    for (name, window), of_method in zip(METHODS, errors.T, strict=True):
        for number, centre in enumerate((BIN_EDGES[1:] + BIN_EDGES[:-1]) / 2):
            inside = of_method[bins == number]
            if len(inside):
                found = mean_and_error(inside)
                points.append(Point(figure.object_size, window, figure.smoothing, name, float(centre), *found))
    return points


def draw(path: Path, points: list[Point], figure: Setting, cases: int) -> None:
    """Draw the curves of one figure, a panel for each statistic, with the chance level."""
    import matplotlib as mpl

    colours = mpl.colormaps["viridis"](np.linspace(0.0, 0.9, len(WINDOWS)))
    with plots.figure(path, 9.0, 6.4, 2, 2) as (drawn, grid):
        for axes, (name, label) in zip(grid.ravel(), STATISTICS.items(), strict=True):
            for window, colour in zip(WINDOWS, colours, strict=True):
                sigmas, means, errors = curve(points, name, window)
                axes.fill_between(sigmas, means - errors, means + errors, color=colour, alpha=0.1, linewidth=0)
                axes.plot(sigmas, means, color=colour, linewidth=1.4, label=f"window {window}")
            axes.axhline(CHANCE_LEVEL, color=plots.MUTED, linewidth=1.0, linestyle=(0, (4, 3)), label="chance")
            axes.set(xlim=(LOWEST_SIGMA, HIGHEST_SIGMA), ylim=(-5, 1.25 * CHANCE_LEVEL))
            axes.set_title(label[:1].upper() + label[1:], fontsize=9)
        for axes in grid[-1]:
            axes.set_xlabel("background deviation (the object's own: 1)")
        for axes in grid[:, 0]:
            axes.set_ylabel("mean distance error [samples]")
        title = f"Object of {figure.object_size} samples, α = {figure.smoothing:g}: {cases} cases, ± 1 standard error"
        plots.headline(drawn, title)
        drawn.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(WINDOWS) + 1)


def curve(points: list[Point], statistic: StatisticName, window: int) -> tuple[Array, Array, Array]:
    """Background deviations, mean errors and standard errors of one curve, ``(n,)`` each."""
    here = [point for point in points if point.statistic == statistic and point.window == window]
    rows = [(point.background_sigma, point.mean_error, point.standard_error) for point in here]
    sigmas, means, errors = np.array(rows).T
    return sigmas, means, errors
