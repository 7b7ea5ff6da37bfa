"""Particle clouds of Bootsveld (2012), figures A.8 to A.11, A.14 to A.19, B.5, B.6, B.11 to B.14 and B.19 to B.24.

As there: the cloud in cyan, the MAP estimates until then as blue circles, the plot as a black cross. Beside them the
ship, and the probability of water that the filter goes by. The run is the campaign's first.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.random import SeedSequence, default_rng

from elusive.contracts import Array, X, Y
from elusive.experiments.bootsveld2012.case import Method, Way, knowledge, scenery
from elusive.experiments.bootsveld2012.curves import name_of
from elusive.experiments.bootsveld2012.trial import ShipTrial, draw, estimate, filter_of, follow
from elusive.report import plots

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from shapely.geometry.base import BaseGeometry

SHARP: tuple[Method, ...] = ("none", "hard")  # no lines of equal probability
TRAIL_S = 8  # MAP estimates shown before the last
LAND, SHORE, CLOUD, MAP = "#cddaa8", "#5b7f2b", "#22b8cf", "#1d4ed8"


class CloudFigure(NamedTuple):
    """What a figure of the thesis shows."""

    way: Way
    method: Method
    time_s: int


class CloudAt(NamedTuple):
    """A filter's belief at one time of the first run."""

    time_s: int
    particles: Array  # (N, 2) of equal weight [m]
    modes: Array  # (n, 2) MAP estimates until then, the last one this second's [m]
    plot: Array  # (2,) [m]
    truth: Array  # (T, 2) the ship's way [m]


FIGURES: dict[str, CloudFigure] = {
    "a8": CloudFigure("canal-middle", "none", 50),
    "a9": CloudFigure("canal-middle", "hard", 50),
    "a10": CloudFigure("canal-coast", "none", 50),
    "a11": CloudFigure("canal-coast", "hard", 50),
    "a14": CloudFigure("canal-imprecise", "none", 61),
    "a15": CloudFigure("canal-imprecise", "hard", 61),
    "a16": CloudFigure("canal-imprecise", "none", 101),
    "a17": CloudFigure("canal-imprecise", "hard", 101),
    "a18": CloudFigure("canal-imprecise", "interval", 61),
    "a19": CloudFigure("canal-imprecise", "interval", 101),
    "b5": CloudFigure("port-imprecise", "nearest", 36),
    "b6": CloudFigure("port-imprecise", "grid", 36),
    "b11": CloudFigure("port-perfect", "none", 15),
    "b12": CloudFigure("port-perfect", "hard", 15),
    "b13": CloudFigure("port-perfect", "none", 102),
    "b14": CloudFigure("port-perfect", "hard", 102),
    "b19": CloudFigure("port-imprecise", "hard", 10),
    "b20": CloudFigure("port-imprecise", "grid", 10),
    "b21": CloudFigure("port-imprecise", "hard", 55),
    "b22": CloudFigure("port-imprecise", "grid", 55),
    "b23": CloudFigure("port-imprecise", "hard", 73),
    "b24": CloudFigure("port-imprecise", "grid", 73),
}
COAST = (
    CloudFigure("port-imprecise", "none", 73),
    CloudFigure("port-imprecise", "hard", 73),
    CloudFigure("port-imprecise", "nearest", 73),
    CloudFigure("port-imprecise", "grid", 73),
    CloudFigure("port-imprecise", "exact", 73),
    CloudFigure("port-imprecise", "field", 73),
)


def cloud(case: ShipTrial, method: Method, time_s: int, seed: int) -> CloudAt:
    """Follow the ship of the campaign's first run until a second."""
    run = draw(case, default_rng(SeedSequence(seed, spawn_key=(0,))))
    model = filter_of(case, run, knowledge(case, method), case.particles)
    estimator = default_rng([run.seed, 1])
    modes, truth = [], scenery(case).truth[:, [X, Y]]
    for step in follow(model, run):
        if step.time_s >= time_s - TRAIL_S:
            modes.append(estimate(model, step, run.scans[step.time_s], "map", estimator))
        if step.time_s == time_s:
            break
    scan = run.scans[time_s]
    plot = scan.range_m[0] * np.array([np.sin(scan.bearing_rad[0]), np.cos(scan.bearing_rad[0])])
    survivors = estimator.choice(len(step.state.weights), len(step.state.weights), p=step.state.weights)
    return CloudAt(time_s, step.state.particles[survivors][:, [X, Y]], np.array(modes), plot, truth)


def draw_clouds(path: Path, case: ShipTrial, figures: Sequence[CloudFigure], seed: int) -> None:
    """Draw clouds of one way beside each other, three in a row at most, all on the same piece of the map."""
    clouds = [cloud(case, figure.method, figure.time_s, seed) for figure in figures]
    everything = np.concatenate([np.concatenate([c.particles, c.modes, c.plot[None]]) for c in clouds])
    middle = 0.5 * (everything.min(axis=0) + everything.max(axis=0))
    half = max(0.55 * float(np.ptp(everything, axis=0).max()), 30.0 if case.in_canal else 25.0)
    columns = min(3, len(clouds))
    rows = -(-len(clouds) // columns)
    width = 4.4 * columns if columns > 1 else 5.4
    with plots.figure(path, width, 4.3 * rows + 0.4, rows, columns) as (drawn, grid):
        for axes, figure, at in zip(grid.ravel(), figures, clouds, strict=False):
            _draw_map(axes, case, figure.method, middle, half)
            _draw_cloud(axes, at, "charted coast" + ("; P(water) .05, .5, .95" if figure.method not in SHARP else ""))
            axes.set_title(f"{name_of(figure.method, case.way)}, t = {figure.time_s} s", fontsize=9)
            axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))
        for axes in grid[-1]:
            axes.set_xlabel("x, east [m]")
        for axes in grid[:, 0]:
            axes.set_ylabel("y, north [m]")
        # the last panel's: the first may be without a chart
        legend = grid.ravel()[len(clouds) - 1].get_legend_handles_labels()
        drawn.legend(*legend, loc="outside lower center", ncols=3 if len(clouds) == 1 else 7)


def _draw_map(axes: Axes, case: ShipTrial, method: Method, middle: Array, half: float) -> None:
    """Draw P(water) as the filter takes it, and the charted coast over it."""
    axes.grid(visible=False)
    axes.set_aspect("equal")
    known = knowledge(case, method)
    if known:
        side = np.linspace(-half, half, 241)
        x, y = np.meshgrid(middle[0] + side, middle[1] + side)
        states = np.column_stack([x.ravel(), 0 * x.ravel(), y.ravel(), 0 * x.ravel()])
        water = np.exp(known[0].log_probability(states)).reshape(x.shape)
        extent = (middle[0] - half, middle[0] + half, middle[1] - half, middle[1] + half)
        axes.imshow(water, origin="lower", extent=extent, cmap=_land_to_water(), vmin=0, vmax=1, zorder=0, alpha=0.9)
        if method not in SHARP:
            axes.contour(x, y, water, levels=[0.05, 0.5, 0.95], colors=SHORE, linewidths=[0.5, 0.9, 0.5], zorder=1)
    land, hole = ("none", "none") if known else (LAND, "white")
    draw_land(axes, scenery(case).land, land, hole)


def draw_land(
    axes: Axes, land: Sequence[BaseGeometry], filled: str = LAND, hole: str = "white", width: float = 1.4
) -> None:
    """Draw polygons of land and their shores."""
    from matplotlib.patches import Polygon

    for polygon in land:
        rings = [(polygon.exterior, filled), *((inner, hole) for inner in polygon.interiors)]
        for ring, colour in rings:
            axes.add_patch(Polygon(np.array(ring.coords), fc=colour, ec=SHORE, lw=width, zorder=1))


def _draw_cloud(axes: Axes, at: CloudAt, coast: str) -> None:
    axes.plot(*at.particles.T, ".", color=CLOUD, markersize=1.5, alpha=0.35, zorder=2, rasterized=True)
    axes.plot([], [], "o", color=CLOUD, markersize=4, label="particles")
    axes.plot(*at.truth.T, color=plots.ESTIMATE, linewidth=1.2, zorder=3, label="the ship's way")
    axes.plot(*at.truth[at.time_s], "D", color=plots.ESTIMATE, markersize=6, zorder=5, label="the ship")
    axes.plot(*at.modes[:-1].T, "o", mfc="none", mec=MAP, markersize=4, alpha=0.6, zorder=4, label="MAP before")
    axes.plot(*at.modes[-1], "o", mfc="none", mec=MAP, mew=2, markersize=9, zorder=5, label="MAP")
    axes.plot([], [], color=SHORE, linewidth=1.4, label=coast)
    axes.plot(*at.plot, "x", color="black", mew=2, markersize=9, zorder=5, label="plot")


def _land_to_water() -> Colormap:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("water", [LAND, "#ffffff"])
