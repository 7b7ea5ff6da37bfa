"""The figure of some charts: land, coast, depths, quality and disagreements, in longitude and latitude."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from elusive.charts.chart import Chart, as_geometries
from elusive.charts.charted_area import ChartedAreaParameters, too_shallow
from elusive.charts.quality import GRADES, LOW_ACCURACY
from elusive.geometry.local_frame import Geometries, LocalFrame
from elusive.geometry.longitude import wrapped
from elusive.report import plots

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LAND, SHORE, WATER, UNKNOWN, BARRED = "#e8d9a8", "#3f3a2d", "#e3eff7", "#f1f3f5", "#9f1239"
DEPTH_LIMITS_M = (0.0, 2.0, 5.0, 10.0, 20.0)  # least depth of an area; below the first it dries
DEPTH_COLOURS = ("#a9c191", "#7fb2d6", "#a6cbe5", "#c6dff0", "#dfeef7", "#f4f9fc")
DEPTH_NAMES = ("dries", "0 to 2 m", "2 to 5 m", "5 to 10 m", "10 to 20 m", "over 20 m")
UNSURVEYED = "#cbd5e1"
GRADE_COLOURS = {1: "#1b5e7d", 2: "#3f8f9d", 3: "#86bfa4", 4: "#f2d388", 5: "#e39b62", 6: "#b9b4c7"}
LONGEST_IN, WIDEST_IN = 7.2, 5.2  # of one panel


def draw_charts(
    path: Path,
    charts: Sequence[Chart],
    frame: LocalFrame,
    parameters: ChartedAreaParameters,
    regions: Geometries,
) -> None:
    """Draw charts, finest first: what they show on the left, how good it is on the right.

    ``regions`` are polygons where charts disagree by more than their imprecision, x and y [m].
    """
    west, south, east, north = _extent(charts, frame)
    stretch = 1 / np.cos(np.deg2rad(frame.lat_deg))
    height = min(LONGEST_IN, WIDEST_IN * stretch * (north - south) / (east - west))
    width = height * (east - west) / (stretch * (north - south))
    with plots.figure(path, max(2 * width, 6.0) + 1.6, height + 1.6, 1, 2) as (_, axes):
        for drawn in axes[0]:
            drawn.set(xlim=(west, east), ylim=(south, north), aspect=stretch)
        left, right = axes[0]
        for number, chart in enumerate(reversed(charts)):
            _draw_depths(left, chart, frame, parameters, 10 * number)
            _draw_quality(right, chart, frame, 10 * number)
        top = 10 * len(charts)
        if len(regions):
            _fill(right, frame.unproject(regions), frame, BARRED, top, edgecolor=BARRED, linewidth=1.0)
        for drawn in (left, right):
            _frame_axes(drawn, charts, frame, top)
            _scale_bar(drawn, frame, top + 1)
        below = -0.45 / height
        left.set_title("Charted land and depth")
        _legend(left, _depth_key(charts, parameters), below)
        quality = _quality_key(charts, bool(len(regions)))
        right.set_title("Quality: CATZOC of depths, QUAPOS of coast" if quality else "Quality: none is stated")
        _legend(right, quality, below)


def _draw_depths(axes: Axes, chart: Chart, frame: LocalFrame, parameters: ChartedAreaParameters, layer: int) -> None:
    """Draw land over depths; a finer chart hides what lies under it."""
    _fill(axes, chart.coverage, frame, WATER, layer)
    least = chart.depth_range_m[:, 0]
    unknown = np.isnan(least)
    for number, colour in enumerate(DEPTH_COLOURS):
        _fill(axes, chart.depths[(np.digitize(least, DEPTH_LIMITS_M) == number) & ~unknown], frame, colour, layer + 1)
    _fill(axes, chart.depths[unknown], frame, UNSURVEYED, layer + 1)
    shoals = too_shallow(chart, parameters)
    _fill(axes, shoals, frame, "none", layer + 2, hatch="////", edgecolor=BARRED, linewidth=0.0)
    _fill(axes, chart.land, frame, LAND, layer + 3)
    _line(axes, chart.coast, frame, layer + 4, color=SHORE, linewidth=0.5)
    _islets(axes, chart, frame, layer + 4)


def _draw_quality(axes: Axes, chart: Chart, frame: LocalFrame, layer: int) -> None:
    """Draw zones by their grade, and the coast by whether its own position is of low accuracy."""
    _fill(axes, chart.coverage, frame, "#ffffff", layer)
    for grade, colour in GRADE_COLOURS.items():
        _fill(axes, chart.zones[chart.catzoc == grade], frame, colour, layer + 1)
    _fill(axes, chart.land, frame, "#f1ede2", layer + 2)
    low = np.isin(chart.edge_quality, LOW_ACCURACY)
    _line(axes, chart.edges[~low], frame, layer + 3, color=SHORE, linewidth=0.5)
    _line(axes, chart.edges[low], frame, layer + 4, color=plots.ESTIMATE, linewidth=1.0)


def _islets(axes: Axes, chart: Chart, frame: LocalFrame, layer: int) -> None:
    points = as_geometries(shape for shape in chart.islets if "Point" in shape.geom_type)
    _line(axes, as_geometries(s for s in chart.islets if "Line" in s.geom_type), frame, layer, color=SHORE)
    for part in _coordinates(points, frame):
        axes.plot(*part.T, ".", color=SHORE, markersize=3, zorder=layer)


def _coordinates(shapes: Geometries, frame: LocalFrame) -> Iterable[Any]:
    """Give the coordinates of each geometry, with longitudes on the near side of the antimeridian."""
    import shapely

    for shape in shapes:
        yield frame.alongside(shapely.get_coordinates(shape))


def _fill(axes: Axes, shapes: Geometries, frame: LocalFrame, colour: str, layer: int, **style: Any) -> None:
    """Fill polygons, their holes left open."""
    import shapely
    from matplotlib.collections import PathCollection
    from matplotlib.path import Path as Outline

    outlines = []
    for shape in shapely.get_parts(shapes):
        rings = as_geometries(shapely.get_rings(shapely.normalize(shape)))
        outlines.append(
            Outline.make_compound_path(*(Outline(ring, closed=True) for ring in _coordinates(rings, frame)))
        )
    filled: dict[str, Any] = {"edgecolor": "face", "linewidth": 0.2} | style
    axes.add_collection(PathCollection(outlines, facecolor=colour, zorder=layer, **filled), autolim=False)


def _line(axes: Axes, shapes: Geometries, frame: LocalFrame, layer: int, **style: Any) -> None:
    import shapely
    from matplotlib.collections import LineCollection

    lines = list(_coordinates(as_geometries(shapely.get_parts(shapes)), frame))
    axes.add_collection(LineCollection(lines, zorder=layer, capstyle="round", **style), autolim=False)


def _extent(charts: Sequence[Chart], frame: LocalFrame) -> tuple[float, float, float, float]:
    """Return west, south, east, north of all charts, with a margin."""
    parts = [part for chart in charts for part in _coordinates(chart.coverage, frame)]
    (west, south), (east, north) = np.min(np.concatenate(parts), axis=0), np.max(np.concatenate(parts), axis=0)
    margin = 0.02 * max(east - west, north - south)
    return float(west - margin), float(south - margin), float(east + margin), float(north + margin)


def _frame_axes(axes: Axes, charts: Sequence[Chart], frame: LocalFrame, layer: int) -> None:
    """Name degrees, and outline what each chart covers."""
    import shapely
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    axes.set_facecolor(UNKNOWN)
    axes.grid(visible=False)
    for side in axes.spines.values():
        side.set(visible=True, color="#64748b")
    east = FuncFormatter(lambda lon, _: _degrees(wrapped(lon), "E", "W"))
    north = FuncFormatter(lambda lat, _: _degrees(lat, "N", "S"))
    axes.xaxis.set(major_formatter=east, major_locator=MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.yaxis.set(major_formatter=north, major_locator=MaxNLocator(5, steps=[1, 2, 5, 10]))
    for chart in charts:
        outline = as_geometries([shapely.boundary(shapely.union_all(chart.coverage))])
        _line(axes, outline, frame, layer, color="#1e293b", linewidth=1.0, linestyle=(0, (5, 3)))
        corner = np.concatenate(list(_coordinates(chart.coverage, frame)))
        axes.annotate(
            chart.name, (corner[:, 0].min(), corner[:, 1].max()), (3, -3), textcoords="offset points", va="top",
            fontsize=7, zorder=layer, bbox={"boxstyle": "square,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.8},
        )  # fmt: skip


def _degrees(value: float, positive: str, negative: str) -> str:
    return f"{abs(value):.6g}° {positive if value >= 0 else negative}"


def _scale_bar(axes: Axes, frame: LocalFrame, layer: int) -> None:
    """Draw a bar of a round length, right at the middle latitude."""
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    degree_m = 100 * float(frame.to_local([[frame.lon_deg + 0.01, frame.lat_deg]])[0, 0])
    most = 0.25 * (east - west) * degree_m
    decade = 10 ** np.floor(np.log10(most))
    length = decade * max(step for step in (1, 2, 5) if step * decade <= most)
    x, y, half = (
        east - 0.04 * (east - west) - 1.2 * length / degree_m,
        south + 0.05 * (north - south),
        0.5 * length / degree_m,
    )
    axes.add_patch(_box(x - 0.4 * half, y - 0.025 * (north - south), 2.8 * half, 0.075 * (north - south), layer))
    for number, colour in enumerate(("#1e293b", "#ffffff")):
        axes.add_patch(_box(x + number * half, y, half, 0.01 * (north - south), layer + 1, colour, "#1e293b"))
    text = f"{length / 1000:g} km" if length >= 1000 else f"{length:g} m"
    axes.text(x + half, y + 0.015 * (north - south), text, ha="center", va="bottom", fontsize=7, zorder=layer + 2)


def _box(x: float, y: float, width: float, height: float, layer: int, face: str = "white", edge: str = "none") -> Any:
    from matplotlib.patches import Rectangle

    alpha = 0.8 if edge == "none" else 1.0
    return Rectangle((x, y), width, height, facecolor=face, edgecolor=edge, linewidth=0.7, alpha=alpha, zorder=layer)


def _depth_key(charts: Sequence[Chart], parameters: ChartedAreaParameters) -> list[tuple[str, dict[str, Any]]]:
    """Name what the left panel shows, as far as the charts have it."""
    least = np.concatenate([chart.depth_range_m[:, 0] for chart in charts])
    found = set(np.digitize(least[np.isfinite(least)], DEPTH_LIMITS_M).tolist())
    key = [("land", {"fc": LAND, "ec": SHORE})]
    key += [(DEPTH_NAMES[number], {"fc": DEPTH_COLOURS[number]}) for number in sorted(found)]
    if any(not len(chart.depths) for chart in charts):
        key.append(("water", {"fc": WATER}))
    if np.isnan(least).any():
        key.append(("depth unknown", {"fc": UNSURVEYED}))
    if parameters.draught_m:
        key.append((f"too shallow for {parameters.draught_m:g} m", {"fc": "white", "hatch": "////", "ec": BARRED}))
    return [*key, ("nothing known", {"fc": UNKNOWN, "ec": "#94a3b8"})]


def _quality_key(charts: Sequence[Chart], differing: bool) -> list[tuple[str, dict[str, Any]]]:
    """Name what the right panel shows, as far as the charts have it."""
    found = set(np.concatenate([chart.catzoc for chart in charts]).tolist())
    key: list[tuple[str, dict[str, Any]]] = [
        (f"CATZOC {GRADES[grade]}", {"fc": colour}) for grade, colour in GRADE_COLOURS.items() if grade in found
    ]
    if np.isin(np.concatenate([chart.edge_quality for chart in charts]), LOW_ACCURACY).any():
        key.append(("coast of low accuracy", {"color": plots.ESTIMATE}))
    if differing:
        key.append(("charts disagree", {"fc": BARRED}))
    return key


def _legend(axes: Axes, key: Sequence[tuple[str, dict[str, Any]]], below: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = [
        Line2D([], [], label=name, **style) if "color" in style else Patch(label=name, **({"ec": "#94a3b8"} | style))
        for name, style in key
    ]
    if handles:
        place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, below)}
        axes.legend(handles=handles, ncols=5, fontsize=7, columnspacing=1.2, handlelength=1.6, **place)
