"""What the player of the charts shows: for each use of the chart P(water), the particle cloud, plots, track, truth."""

from __future__ import annotations

import numpy as np

from elusive.charts import ExactWater, GridWater, HardWater, Water, WaterModel
from elusive.report import drawing as draw
from elusive.report.extents import about
from elusive.report.plots import SERIES
from elusive.systems.radar.page.maps import raster_of
from elusive.systems.radar.report.page import radar_layers
from elusive.systems.radar.scene_run import Sailed, Used

SIDE = 700  # pixels along the longer side
SPREADS = 12.0  # deviations of a track across a panel that follows the ship
NARROWEST_M = 50.0


def watch_spec(sailed: Sailed) -> draw.Drawing:
    """Return a panel for each use of the chart; the ship's true place can be followed."""
    shown = [(one, one.outcome.tracked) for one in sailed.each if one.outcome is not None]
    spreads = [np.median(path.spread) for _, tracked in shown for path in tracked.paths]
    close = max(NARROWEST_M, SPREADS * float(np.median(spreads)) if spreads else NARROWEST_M)
    extent = about(np.concatenate([sailed.truth, sailed.truth + 0.5 * close, sailed.truth - 0.5 * close]))
    panels = []
    for one, tracked in shown:
        water = draw.shares(raster_of(_water(one, sailed), extent, SIDE)[0])
        likely = draw.image(water, extent, "water", unit="", name="P(water)", smooth=True)
        layers = [likely, *radar_layers(tracked._replace(chart=None), sailed.times_s)]
        axes = ("east of the radar", "north of the radar")
        panels.append(draw.plane(one.name, extent, layers, axes=axes, span=4, ground="--water"))
    x, y = sailed.truth.T
    focus = {"times": draw.rounded(sailed.times_s, 4), "x": draw.rounded(x), "y": draw.rounded(y)}
    return draw.drawing(
        "The ship at the coast, by each use of the chart", sailed.times_s, [*panels, errors_chart(sailed)], focus=focus,
        near=(extent[1] - extent[0]) / close,
    )  # fmt: skip


def errors_chart(sailed: Sailed) -> draw.Panel:
    """Return the error of each use of the chart over time."""
    lines = []
    for number, one in enumerate(sailed.each):
        found = None if one.outcome is None else one.outcome.tracked.nearest_error
        if found is not None:
            lines.append(draw.line(*found, SERIES[number % len(SERIES)], name=f"error, {one.name}"))
    top = 1.05 * max([1.0, *(max(layer["y"]) for layer in lines)])
    return draw.chart("How far off?", sailed.times_s, lines, axis="error", unit="m", reach=(0.0, top), span=12)


def _water(one: Used, sailed: Sailed) -> Water:
    """P(water) as this use of the chart has it; without any, land as it is charted, for the eye alone."""
    knowledge = one.parameters.knowledge
    model = knowledge if isinstance(knowledge, WaterModel) else HardWater()
    if isinstance(model, GridWater):
        model = ExactWater()  # its cells are finer than what is drawn, and take long to fill
    return model.bind(sailed.surroundings.coast)
