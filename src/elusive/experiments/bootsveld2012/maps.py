"""Figures 6.5 to 6.8 of Bootsveld (2012): the land mask of the whole map and its convolution, and both zoomed in."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from elusive.charts import Coast, CoastPart, FieldWater, HardWater, WaterModel
from elusive.charts.delta import HEIGHT_M, WIDTH_M
from elusive.contracts import Array, X, Y
from elusive.experiments.bootsveld2012.case import ShipCase, scenery
from elusive.experiments.bootsveld2012.shore import shoreline
from elusive.report import plots

FIGURES = ("fig6_5", "fig6_6", "fig6_7", "fig6_8")
PIXELS = 800  # along the map's width: at 12.5 m a pixel of the whole map, no method's cells are seen
ZOOM_M = 600.0


def draw_map(folder: Path, name: str, case: ShipCase) -> None:
    """Draw one figure; the whole map is about its middle, the zoom about the ship's way, with the way on it."""
    zoomed, mask = name in ("fig6_6", "fig6_8"), name in ("fig6_5", "fig6_6")
    model: WaterModel = HardWater() if mask else FieldWater()
    if zoomed:
        scene = scenery(case)
        coast, truth = scene.coast, scene.truth[:, [X, Y]]
        middle = 0.5 * (truth.min(axis=0) + truth.max(axis=0))
        half = np.array([ZOOM_M, ZOOM_M])
    else:
        coast = Coast.of(CoastPart(list(shoreline(case.shoreline, case.delta_seed)), case.sigma))
        truth, middle, half = None, np.zeros(2), np.array([WIDTH_M, HEIGHT_M]) / 2
    water = _raster(model, coast, middle, half)
    with plots.figure(folder / f"{name}.png", 6.8, 5.8) as (drawn, grid):
        axes = grid[0, 0]
        axes.grid(visible=False)
        extent = (middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1])
        image = axes.imshow(water, origin="lower", extent=extent, cmap="gray", vmin=0, vmax=1, interpolation="nearest")
        drawn.colorbar(image, ax=axes, label="land 0, water 1" if mask else "P(water)", shrink=0.85)
        if truth is not None:
            axes.plot(*truth.T, color=plots.ESTIMATE, linewidth=1.4, label="the ship's way")
            axes.legend(loc="upper left", frameon=True, framealpha=1.0)
        what = "Land mask" if mask else f"Its convolution, s = {case.sigma:g} m"
        axes.set(xlabel="x, east [m]", ylabel="y, north [m]", title=what)


def _raster(model: WaterModel, coast: Coast, middle: Array, half: Array) -> Array:
    """P(water) at the middles of pixels, row 0 in the south."""
    columns, rows = PIXELS, round(PIXELS * half[1] / half[0])
    x = middle[0] + half[0] * (2 * np.arange(columns) + 1 - columns) / columns
    y = middle[1] + half[1] * (2 * np.arange(rows) + 1 - rows) / rows
    at = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return model.bind(coast).probability(at).reshape(rows, columns)
