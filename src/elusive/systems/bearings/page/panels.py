"""What the maps and the player of bearings show: sensors, bearings, the tracks of several estimators with ellipses."""

from __future__ import annotations

import math

import numpy as np

from elusive.contracts import Array
from elusive.report import drawing as draw
from elusive.report.extents import Extent, about
from elusive.report.plots import SERIES
from elusive.sensors.bearing_sets import BearingSet
from elusive.systems.bearings.report.page import heard_layers, track_layer
from elusive.systems.bearings.scene import BearingScene, Flown, Found
from elusive.workbench.placing import path_layers, placing

LINES_MOST = 60  # bearings drawn of an emitter that stands still
AROUND_M = [[-100.0, -60.0], [100.0, 110.0]]  # shown in any case


def scene_floor(scene: BearingScene, mode: str, selected: set[str]) -> draw.Drawing:
    """Return a map of sensors and path; ``mode``: view, node or path."""
    ways = [np.reshape(way, (-1, 2)) for way in scene.simulation.ways_m]
    label = "Map of the sensors and the path: arrow keys move a cross, Enter places"
    nodes = [(site.name, site.x_m, site.y_m, site.name in selected) for site in scene.simulation.sites]
    extent = about(np.concatenate([scene.simulation.places, ways[0], AROUND_M]))
    return placing(label, extent, path_layers(ways, SERIES), mode=mode, nodes=nodes)


def still_floor(scene: BearingScene, found: Found | None) -> draw.Drawing:
    """Return a map of the sensors, the emitter and, once it is located, its ellipse."""
    emitter = (scene.still.x_m, scene.still.y_m)
    extent = about(np.concatenate([scene.simulation.places, [emitter], AROUND_M]))
    nodes = [(site.name, site.x_m, site.y_m, False) for site in scene.simulation.sites]
    layers = []
    if found is not None:
        place, ellipse = found.located.fix.position_m, found.located.ellipse
        layers.append(_lines(scene, found.sets, 2 * (extent[1] - extent[0])))
        layers.append(draw.points(place[None], "--mark", marker="plus", size=9, width=2.5, name="located"))
        if math.isfinite(ellipse.semi_major_m):
            axes = (ellipse.semi_major_m, ellipse.semi_minor_m, math.radians(90.0 - ellipse.azimuth_deg))
            layers.append(draw.ellipses([*place[:2], *axes], "--mark", width=2, name="its ellipse"))
    label = "Map of the sensors and the emitter: arrow keys move a cross, Enter places the emitter"
    return placing(label, extent, layers, mode="node", nodes=[*nodes, ("emitter", *emitter, True)])


def _lines(scene: BearingScene, sets: list[BearingSet], length: float) -> draw.Layer:
    sensor, angle = (np.concatenate([getattr(one, part) for one in sets]) for part in ("sensor", "azimuth_rad"))
    each = max(1, len(sensor) // LINES_MOST)
    start, angle = scene.simulation.places[sensor[::each]], angle[::each]
    ends = start + length * np.column_stack([np.sin(angle), np.cos(angle)])
    return draw.segments(np.column_stack([start, ends]), "--soft", alpha=0.5, name="bearings")


def watch_spec(flown: Flown) -> draw.Drawing:
    """Return the bearings and each estimator's track; the emitter's true place can be followed."""
    times, extent = _times(flown), about(np.concatenate([flown.scene.simulation.places, flown.truth]))
    every = np.arange(len(times))
    panels = []
    for number, (name, outcome) in enumerate(flown.shown):
        heard = heard_layers(outcome.tracked, every)
        if number == 0:
            panels.append(draw.plane("Bearings", extent, heard, span=6))
        others = [layer for layer in heard if layer.get("name") != "bearings now"]
        panels.append(draw.plane(name, extent, [*others, track_layer(outcome.tracked, every)], span=6))
    x, y = flown.truth.T
    focus = {"times": draw.rounded(times, 4), "x": draw.rounded(x), "y": draw.rounded(y)}
    return draw.drawing("Bearings and tracks", times, panels, focus=focus, near=_near(flown, extent))


def _times(flown: Flown) -> Array:
    return np.array([one.time_s for one in flown.sets])


def _near(flown: Flown, extent: Extent) -> float:
    """How many times nearer the emitter is followed: six of the usual deviations and errors fill a panel."""
    usual = [10.0]
    for _, outcome in flown.shown:
        tracked = outcome.tracked
        if tracked.known.any() and tracked.error is not None:
            usual.append(
                float(np.median(tracked.error[tracked.known]) + 6 * np.median(tracked.deviation[tracked.known]))
            )
    return max(1.5, (extent[1] - extent[0]) / (2 * float(np.median(usual))))
