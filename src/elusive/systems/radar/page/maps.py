"""Maps of a chart: land, zones of quality, probability of water; with the route, the radar and its plots."""

from __future__ import annotations

from typing import Any

import numpy as np

from elusive.charts import FieldWater, Water
from elusive.charts.charted_area import barred, lay_charts
from elusive.charts.quality import GRADES
from elusive.contracts import Array
from elusive.report import drawing as draw
from elusive.report.extents import Extent, about
from elusive.report.plots import SERIES
from elusive.systems.radar.page.state import ChartsState
from elusive.workbench.placing import path_layers, placing

ZONES = {"A1": "#1b7f4b", "A2": "#4c9f38", "B": "#a3a500", "C": "#e08a00", "D": "#d1495b", "U": "#8a94a3"}
FINEST = 1 / 2000  # of what is seen: details below it are left out
RASTER_SIDE = 360
STEPS = 50  # of an arrow key, across what is seen
MARGIN = 0.02


def whole_chart(state: ChartsState) -> Extent:
    """Return what shows the whole chart, x and y [m]."""
    x0, x1, y0, y1 = state.chart_extent
    return about([(x0, y0), (x1, y1)], MARGIN)


def about_route(state: ChartsState) -> Extent:
    """Return what shows the routes, with room; the whole chart where there is none."""
    if not state.scene.routes_deg:
        return whole_chart(state)
    places = state.frame.to_local(np.concatenate(state.scene.routes_deg))
    middle, half = 0.5 * (places.min(axis=0) + places.max(axis=0)), 0.65 * float(np.ptp(places, axis=0).max())
    (west, south), (east, north) = (middle - half).tolist(), (middle + half).tolist()
    return west, east, south, north


def chart_shapes(state: ChartsState, extent: Extent, *, land: bool = True) -> list[draw.Layer]:
    """Return land, coverage and zones of quality, in detail as far as they are in view.

    Without ``land`` the shore is a line, and no zone is drawn: something else shows what is land.
    """
    import shapely

    assert state.chart is not None
    window = shapely.box(extent[0], extent[2], extent[1], extent[3])
    finest = FINEST * (extent[1] - extent[0])
    shapes: list[draw.Layer] = []
    for chart in state.chart.charts:
        inland = shapely.union_all(barred(chart, state.frame, state.scene.tracking.charted))
        fill = {"fill": "--land"} if land else {}
        shapes += _rings(inland, window, finest, colour="--shore", name="land" if land else "shore", **fill)
        covered = shapely.union_all(state.frame.project(chart.coverage))
        shapes += _rings(covered, window, finest, colour="--soft", dash=[5, 4], name="coverage")
        for zone, grade in zip(state.frame.project(chart.zones), chart.catzoc, strict=True) if land else ():
            name = GRADES.get(int(grade), "U")
            style = {"colour": ZONES.get(name, ZONES["U"]), "width": 2.5, "name": f"zone {name}"}
            shapes += _rings(zone, window, finest, **style)
    return shapes


def _rings(shape: Any, window: Any, finest: float, **style: Any) -> list[draw.Layer]:
    import shapely

    # what lies far outside is cut off, so far that a view is moved without seeing the cut
    seen = shapely.intersection(shape, window.buffer(window.length / 4))
    parts = [part for part in shapely.get_parts(shapely.simplify(seen, finest)) if part.geom_type == "Polygon"]
    rings = [[part.exterior, *part.interiors] for part in parts if not part.is_empty]
    return [draw.area([ring.coords for ring in of_part], **style) for of_part in rings]


def ashore_m(state: ChartsState) -> list[float]:
    """Return how much of each route lies on charted land [m]."""
    import shapely

    assert state.chart is not None
    taken = state.scene.tracking.charted
    land = shapely.union_all([part for chart in state.chart.charts for part in barred(chart, state.frame, taken)])
    lines = [shapely.linestrings(state.frame.to_local(np.array(route))) for route in state.scene.routes_deg]
    return [float(shapely.length(shapely.intersection(line, land))) for line in lines]


def raster_of(water: Water, extent: Extent, side: int = RASTER_SIDE) -> tuple[Array, int, int]:
    """Return P(water) over a rectangle, row 0 in the south, ``(rows, columns)``, NaN where nothing is known."""
    x0, x1, y0, y1 = extent
    pixel = max(x1 - x0, y1 - y0) / side
    columns, rows = max(1, round((x1 - x0) / pixel)), max(1, round((y1 - y0) / pixel))
    x, y = x0 + (np.arange(columns) + 0.5) * (x1 - x0) / columns, y0 + (np.arange(rows) + 0.5) * (y1 - y0) / rows
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    found = np.where(water.known(places), water.probability(places), np.nan)
    return found.reshape(rows, columns), rows, columns


def water_raster(state: ChartsState, extent: Extent) -> draw.Layer:
    """Return P(water) of what is in view; computed once a view."""
    assert state.chart is not None
    key = (state.chart.file, state.scene.tracking.charted.model_dump_json(), extent)
    if state.raster is None or state.raster[0] != key:
        water = FieldWater().bind(lay_charts(state.chart.charts, state.scene.tracking.charted, state.frame).coast)
        values = draw.shares(raster_of(water, extent)[0])
        state.raster = (key, draw.image(values, extent, "water", unit="", name="P(water)", smooth=True))
    return state.raster[1]


def chart_floor(
    state: ChartsState, whole: Extent, mode: str = "view", raster: draw.Layer | None = None, *, way: bool = False
) -> draw.Drawing:  # fmt: skip
    """Return a map; ``mode``: view, path or node; ``way``: with route, radar and plots."""
    view = state.view or whole
    layers, nodes = chart_shapes(state, view, land=raster is None), []
    if raster is not None:
        layers = [raster, *layers]
    if way:
        frame, scene = state.frame, state.scene
        if state.recorded is not None:
            plots = frame.to_local(state.recorded.plots_deg)
            layers.append(draw.points(plots, "--mark", marker="cross", size=5, name="plots"))
        layers += path_layers([frame.to_local(np.array(route)) for route in scene.routes_deg], SERIES)
        x, y = frame.to_local([[scene.radar.lon_deg, scene.radar.lat_deg]])[0].tolist()
        nodes = [("radar", round(x, 1), round(y, 1), True)]
    step = float(f"{(view[1] - view[0]) / STEPS:.1g}")
    label = "Sea chart: arrow keys move a cross, Enter acts"
    return placing(label, whole, layers, mode=mode, nodes=nodes, step=step, ground="--water")
