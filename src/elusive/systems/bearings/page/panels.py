"""What the map and the player of bearings show: sensors, beams of the bearings, tracks with their ellipses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.sensors.bearing_sets import BearingSet
from elusive.systems.bearings.choices import FilterName
from elusive.systems.bearings.report.contents import half_axes
from elusive.systems.bearings.results import BearingOutcome
from elusive.systems.bearings.scene import BearingScene, Flown, Found
from elusive.workbench.blocks import Panel, player_spec, scaled

SIDE = 180  # pixels along the longer side
MARGIN = 0.08
SHARPEST_DEG = 0.8  # of a beam: a narrower one would fall between the pixels
LINES_MOST = 60  # bearings drawn
CORNERS = 28  # dots of an ellipse
INSIDE, OUTSIDE = "#7ee787", "#ff9d5c"
LEGEND = (
    "bright: along a sensor's bearing", "+ the true place", "green: the estimate; line: the last 25 of it",
    "green dots: 95 % ellipse that holds the truth", "orange dots: one that does not",
)  # fmt: skip
EDGES = tuple(2 * math.pi * k / CORNERS for k in range(CORNERS))


def extent_of(places: Array) -> tuple[float, float, float, float]:
    """Return what of the ground is shown, least and greatest x and y."""
    shown = places if len(places) else np.array([[-100.0, -100.0], [100.0, 100.0]])
    low, high = shown.min(axis=0), shown.max(axis=0)
    margin = MARGIN * max(*(high - low), 10.0)
    return float(low[0] - margin), float(high[0] + margin), float(low[1] - margin), float(high[1] + margin)


def scene_floor(scene: BearingScene, mode: str, selected: set[str]) -> dict[str, Any]:
    """Return a map of sensors and path; ``mode``: view, node or path."""
    places = np.concatenate(
        [
            scene.simulation.places,
            np.array(scene.simulation.ways_m[0]).reshape(-1, 2),
            [[-100.0, -60.0], [100.0, 110.0]],
        ]
    )
    return {
        "label": "Map of the sensors and the path: arrow keys move a cross, Enter places",
        "extent": extent_of(places), "corners": [], "mode": mode,
        "paths": [list(map(list, way)) for way in scene.simulation.ways_m],
        "nodes": [
            {"name": site.name, "x": site.x_m, "y": site.y_m, "selected": site.name in selected}
            for site in scene.simulation.sites
        ],
    }  # fmt: skip


def still_floor(scene: BearingScene, found: Found | None) -> dict[str, Any]:
    """Return a map of the sensors, the emitter and, once it is located, its ellipse."""
    emitter = (scene.still.x_m, scene.still.y_m)
    spec = scene_floor(scene, "node", set()) | {
        "label": "Map of the sensors and the emitter: arrow keys move a cross, Enter places the emitter", "paths": [],
    }  # fmt: skip
    spec["nodes"] = [*spec["nodes"], {"name": "emitter", "x": emitter[0], "y": emitter[1], "selected": True}]
    x0, x1, y0, y1 = extent_of(np.concatenate([scene.simulation.places, [emitter], [[-100.0, -60.0], [100.0, 110.0]]]))
    spec["extent"] = [x0, x1, y0, y1]
    if found is not None:
        x, y = found.located.fix.position_m.tolist()
        ellipse = found.located.ellipse
        reach = 0.012 * (x1 - x0)
        spec["shapes"] = [
            *_lines(scene, found.sets, 2 * (x1 - x0)),
            {"line": [[x - reach, y], [x + reach, y]], "stroke": "--ew-accent", "width": 2},
            {"line": [[x, y - reach], [x, y + reach]], "stroke": "--ew-accent", "width": 2},
        ]
        if math.isfinite(ellipse.semi_major_m):
            angle = math.radians(90.0 - ellipse.azimuth_deg)
            spec["ellipses"] = [[x, y, ellipse.semi_major_m, ellipse.semi_minor_m, angle]]
    return spec


def _lines(scene: BearingScene, sets: list[BearingSet], length: float) -> list[dict[str, Any]]:
    rows = [row for one in sets for row in zip(one.sensor.tolist(), one.azimuth_rad.tolist(), strict=True)]
    lines = []
    for sensor, azimuth in rows[:: max(1, len(rows) // LINES_MOST)]:
        x, y = scene.simulation.places[sensor].tolist()
        far = [x + length * math.sin(azimuth), y + length * math.cos(azimuth)]
        lines.append({"line": [[x, y], far], "stroke": "--ew-quiet", "alpha": 0.5})
    return lines


def watch_spec(flown: Flown, *, close: bool = False) -> dict[str, Any]:
    """Return a player of the bearings and of each estimator's track; ``close``: from above the emitter, moving along.

    Places are then told from the true one.
    """
    scene, shown = flown.scene, flown.shown
    centres = flown.truth if close else np.zeros_like(flown.truth)
    half = _reach(shown)
    extent = (-half, half, -half, half) if close else extent_of(np.concatenate([scene.simulation.places, flown.truth]))
    beams = _beams(scene, flown.sets, extent, centres)
    bright = scaled("Bearings", beams, "sensors", low=0.0)
    ground = (0.35 * bright.values).astype(np.uint8)  # dim beneath marks, so that these are seen
    panels = [
        bright,
        *(Panel(name, ground, colours="grey") for name, _ in shown),
    ]
    truth = [[["truth", x, y, "", "", 0]] for x, y in np.round(flown.truth - centres, 3).tolist()]
    marks: list[Any] = [
        truth,
        *([*map(_both, truth, _tracks(outcome, flown.truth, centres, close))] for _, outcome in shown),
    ]
    return player_spec(
        "Bearings and tracks", panels, extent, marks=marks,
        nodes=[] if close else np.round(scene.simulation.places, 3).tolist(),
        interval_s=scene.simulation.interval_s, legend=list(LEGEND),
    )  # fmt: skip


def _both(first: list[Any], second: list[Any]) -> list[Any]:
    return [*first, *second]


def _reach(shown: list[tuple[FilterName, BearingOutcome]]) -> float:
    """Half the side of what is seen close, three of the usual deviations about the usual error [m]."""
    usual = [5.0]
    for _, outcome in shown:
        tracked = outcome.tracked
        if tracked.told.any() and tracked.error is not None:
            usual.append(float(np.median(tracked.error[tracked.told]) + 3 * np.median(tracked.deviation[tracked.told])))
    return float(np.median(usual))


def _tracks(outcome: BearingOutcome, truth: Array, centres: Array, close: bool) -> list[list[Any]]:
    tracked = outcome.tracked
    marks: list[list[Any]] = []
    for place, true, told, (along, across, angle) in zip(
        tracked.places - centres, truth - centres, tracked.told, half_axes(tracked.covariances), strict=True
    ):
        if not told:
            marks.append([])
            continue
        cos, sin = math.cos(angle), math.sin(angle)
        off = np.array([[cos, sin], [-sin, cos]]) @ (true - place) / np.array([along, across])
        colour = INSIDE if float(np.hypot(*off)) <= 1 else OUTSIDE
        outline = [(along * math.cos(edge), across * math.sin(edge)) for edge in EDGES]
        x, y = place.tolist()
        dots = [
            ["points", round(x + cos * u - sin * v, 3), round(y + sin * u + cos * v, 3), colour, "", 0]
            for u, v in outline
        ]
        # a line of places that are told from a moving one would be none of a path
        marks.append([*dots, ["head" if close else "track", round(x, 3), round(y, 3), "CONFIRMED", "", 0]])
    return marks


def _beams(
    scene: BearingScene, sets: list[BearingSet], extent: tuple[float, float, float, float], centres: Array
) -> Array:
    """Return how many bearings point to each pixel, soft at their deviation, ``(T, H, W)``."""
    x0, x1, y0, y1 = extent
    pixel = max(x1 - x0, y1 - y0) / SIDE
    columns, rows = max(1, round((x1 - x0) / pixel)), max(1, round((y1 - y0) / pixel))
    x, y = x0 + (np.arange(columns) + 0.5) * (x1 - x0) / columns, y0 + (np.arange(rows) + 0.5) * (y1 - y0) / rows
    sigma = math.radians(max(scene.simulation.sensors.sigma_deg, SHARPEST_DEG))
    beams = np.zeros((len(sets), rows, columns))
    for image, one, centre in zip(beams, sets, centres, strict=True):
        toward = [np.arctan2(x[None] - east, y[:, None] - north) for east, north in scene.simulation.places - centre]
        for sensor, azimuth in zip(one.sensor.tolist(), one.azimuth_rad.tolist(), strict=True):
            off = (toward[sensor] - azimuth + np.pi) % (2 * np.pi) - np.pi
            image += np.exp(-0.5 * (off / sigma) ** 2) / np.count_nonzero(one.sensor == sensor)
    return beams
