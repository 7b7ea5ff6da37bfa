"""Maps of a chart: land, zones of quality, probability of water; with the route, the radar and its plots."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from elusive.charts import FieldWater, Water
from elusive.charts.charted_area import barred, lay_charts
from elusive.charts.quality import GRADES
from elusive.contracts import Array
from elusive.systems.radar.page.state import ChartsState, Extent
from elusive.workbench.blocks import HELD

LAND, SHORE = "#d8c28a", "#6b5a2b"
ZONES = {"A1": "#1b7f4b", "A2": "#4c9f38", "B": "#a3a500", "C": "#e08a00", "D": "#d1495b", "U": "#8a94a3"}
FINEST = 1 / 2000  # of what is seen: details below it are left out
RASTER_SIDE = 360
UNKNOWN = 255
STEPS = 50  # of an arrow key, across what is seen
MARGIN = 0.02


def view_of(state: ChartsState) -> Extent:
    """Return what is in view, x and y [m]."""
    if state.view is not None:
        return state.view
    x0, x1, y0, y1 = state.chart_extent
    margin = MARGIN * max(x1 - x0, y1 - y0)
    return x0 - margin, x1 + margin, y0 - margin, y1 + margin


def about_route(state: ChartsState) -> Extent:
    """Return what shows the route, with room; the whole chart where there is none."""
    if not state.scene.routes_deg:
        return view_of(state)
    places = state.frame.to_local(np.concatenate(state.scene.routes_deg))
    middle, half = 0.5 * (places.min(axis=0) + places.max(axis=0)), 0.65 * float(np.ptp(places, axis=0).max())
    return tuple(float(value) for value in (middle[0] - half, middle[0] + half, middle[1] - half, middle[1] + half))  # type: ignore[return-value]


def zoomed(extent: Extent, x: float, y: float, times: float) -> Extent:
    """Return a view about a place, so many times as wide."""
    half = 0.5 * times * max(extent[1] - extent[0], extent[3] - extent[2])
    return x - half, x + half, y - half, y + half


def chart_shapes(state: ChartsState, extent: Extent, *, land: bool = True) -> list[dict[str, Any]]:
    """Return land, coverage and zones of quality as a map draws them, as far as they are in view.

    Without ``land`` the shore is a line, and no zone is drawn: something else shows what is land.
    """
    import shapely

    assert state.chart is not None
    window = shapely.box(extent[0], extent[2], extent[1], extent[3])
    finest = FINEST * (extent[1] - extent[0])
    shapes: list[dict[str, Any]] = []
    for chart in state.chart.charts:
        inland = shapely.union_all(barred(chart, state.frame, state.scene.tracking.charted))
        shapes += _rings(inland, window, finest, {"stroke": SHORE} | ({"fill": LAND} if land else {}))
        shapes += _rings(
            shapely.union_all(state.frame.project(chart.coverage)), window, finest,
            {"stroke": "--ew-quiet", "dashed": True},
        )  # fmt: skip
        for zone, grade in zip(state.frame.project(chart.zones), chart.catzoc, strict=True) if land else ():
            colour = ZONES.get(GRADES.get(int(grade), "U"), ZONES["U"])
            shapes += _rings(zone, window, finest, {"stroke": colour, "width": 2.5})
    return shapes


def grades_of(state: ChartsState) -> list[str]:
    """Return the grades of quality that the chart states."""
    assert state.chart is not None
    found = {GRADES.get(int(grade), "U") for chart in state.chart.charts for grade in chart.catzoc}
    return [grade for grade in ZONES if grade in found]


def _rings(shape: Any, window: Any, finest: float, style: dict[str, Any]) -> list[dict[str, Any]]:
    import shapely

    # what lies far outside is cut off beyond the edge, so that no cut is seen
    seen = shapely.intersection(shape, window.buffer(0.05 * math.sqrt(window.area)))
    drawn = []
    for part in shapely.get_parts(shapely.simplify(seen, finest)):
        if part.geom_type == "Polygon" and not part.is_empty:
            rings = [part.exterior, *part.interiors]
            drawn.append({"rings": [np.round(ring.coords, 1).tolist() for ring in rings], **style})
    return drawn


def raster_of(water: Water, extent: Extent, side: int = RASTER_SIDE) -> tuple[Array, int, int]:
    """Return P(water) over a rectangle, row 0 in the south, ``(rows, columns)``, NaN where nothing is known."""
    x0, x1, y0, y1 = extent
    pixel = max(x1 - x0, y1 - y0) / side
    columns, rows = max(1, round((x1 - x0) / pixel)), max(1, round((y1 - y0) / pixel))
    x, y = x0 + (np.arange(columns) + 0.5) * (x1 - x0) / columns, y0 + (np.arange(rows) + 0.5) * (y1 - y0) / rows
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    found = np.where(water.known(places), water.probability(places), np.nan)
    return found.reshape(rows, columns), rows, columns


def water_raster(state: ChartsState, extent: Extent) -> dict[str, Any]:
    """Return P(water) of what is in view, for a map; computed once a view."""
    assert state.chart is not None
    key = (state.chart.file, state.scene.tracking.charted.model_dump_json(), extent)
    if state.raster is not None and state.raster[0] == key:
        return state.raster[1]
    water = FieldWater().bind(lay_charts(state.chart.charts, state.scene.tracking.charted, state.frame).coast)
    values, rows, columns = raster_of(water, extent)
    data = np.where(np.isnan(values), UNKNOWN, np.round(254 * np.nan_to_num(values))).astype(np.uint8)
    if state.raster is not None:
        HELD.drop(state.raster[1]["url"].rpartition("/")[2])
    url = f"/blocks/{HELD.hold(data.tobytes())}"
    state.raster = (key, {"url": url, "rows": rows, "columns": columns, "extent": list(extent)})
    return state.raster[1]


def chart_floor(state: ChartsState, mode: str, raster: dict[str, Any] | None = None, *, way: bool) -> dict[str, Any]:
    """Return a map; ``mode``: view, path or node; ``way``: with route, radar and plots."""
    extent = view_of(state)
    spec: dict[str, Any] = {
        "label": "Sea chart: arrow keys move a cross, Enter acts", "extent": list(extent), "corners": [], "mode": mode,
        "step": float(f"{(extent[1] - extent[0]) / STEPS:.1g}"),
        "shapes": chart_shapes(state, extent, land=raster is None),
    }  # fmt: skip
    if raster is not None:
        spec["raster"] = raster
    if way:
        frame, scene = state.frame, state.scene
        spec["paths"] = [np.round(frame.to_local(np.array(route)), 1).tolist() for route in scene.routes_deg]
        x, y = np.round(frame.to_local([[scene.radar.lon_deg, scene.radar.lat_deg]])[0], 1).tolist()
        spec["nodes"] = [{"name": "radar", "x": x, "y": y, "selected": True}]
        if state.recorded is not None:
            reach = 0.006 * (extent[1] - extent[0])
            for east, north in np.round(frame.to_local(state.recorded.plots_deg), 1).tolist():
                for dx, dy in ((reach, reach), (reach, -reach)):
                    line = [[east - dx, north - dy], [east + dx, north + dy]]
                    spec["shapes"].append({"line": line, "stroke": "--ew-accent", "width": 1.4})
    return spec
