"""What is in some charts: extent, layers, quality, imprecision, and where they disagree; drawn if asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.charts.chart import Chart, as_geometries
from elusive.charts.charted_area import ChartedAreaParameters, barred, read_charts
from elusive.charts.compare import Disagreement, disagreements
from elusive.charts.quality import GRADES, LOW_ACCURACY, coast_sigma
from elusive.errors import ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.systems.radar.chart_figure import draw_charts
from elusive.systems.radar.water_map import ChartParameters, check_map_name, write_water_map

__all__ = ["ChartParameters", "ChartSummary", "ChartsDescribed", "describe_charts"]

FIGURES = (".png", ".pdf", ".svg")


class ChartSummary(NamedTuple):
    """One chart, as rows of a table."""

    name: str
    rows: list[tuple[str, str]]


class ChartsDescribed(NamedTuple):
    """What some charts hold, finest first."""

    summaries: list[ChartSummary]
    disagreements: list[Disagreement]
    remarks: list[str]


def describe_charts(
    paths: Sequence[str | Path],
    parameters: ChartedAreaParameters | None = None,
    figure: Path | None = None,
    water_map: Path | None = None,
) -> ChartsDescribed:
    """Say what is in some charts: S-57 base cells (``.000``), GeoJSON or shapefiles.

    They are drawn into ``figure`` (PNG, PDF or SVG), and the probability of water into ``water_map`` (GeoTIFF or
    netCDF), whose cells are among the parameters; neither by default.

    Raises
    ------
    DataError
        If a chart cannot be read or they lie too far apart.
    ParameterError
        If the name of figure or map has another ending, the map would have too many cells or hold nothing,
        or its cells are given and it is not.
    """
    if figure is not None and figure.suffix.lower() not in FIGURES:
        raise ParameterError(f"{figure}: a figure's name must end with {', '.join(FIGURES)}.")
    if water_map is not None:
        check_map_name(water_map)
    parameters = parameters or ChartedAreaParameters()
    if water_map is None:
        for name in ("map_cell_m", "map_extent_deg"):
            if getattr(parameters, name, None) is not None:
                raise ParameterError(
                    f"{name}: has no meaning without a map; give --water-probability, or leave it out."
                )
    charts = read_charts(*paths)
    frame = LocalFrame.about(charts)
    found = disagreements(charts, frame, parameters)
    if water_map is not None:
        fields = {name: getattr(parameters, name) for name in type(parameters).model_fields}
        write_water_map(water_map, charts, ChartParameters(**fields))
    if figure is not None:
        regions = as_geometries(region for one in found for region in one.regions)
        draw_charts(figure, charts, frame, parameters, regions)
    remarks = [f"{chart.path}: {remark}." for chart in charts for remark in chart.remarks]
    return ChartsDescribed([_summary(chart, frame, parameters) for chart in charts], found, remarks)


def _summary(chart: Chart, frame: LocalFrame, parameters: ChartedAreaParameters) -> ChartSummary:
    import shapely

    west, south, east, north = chart.extent_deg
    covered = shapely.union_all(frame.project(chart.coverage))
    land = shapely.intersection(shapely.union_all(barred(chart, frame, parameters.replace(draught_m=0.0))), covered)
    rows = [
        ("scale", "not stated" if chart.scale is None else f"1:{chart.scale:_}".replace("_", " ")),
        ("edition", _edition(chart)),
        ("extent", f"{west:.4f}, {south:.4f} to {east:.4f}, {north:.4f} (longitude, latitude)"),
        ("covered", f"{covered.area / 1e6:.1f} km2, of it land {land.area / 1e6:.1f} km2"),
        ("objects", ", ".join(f"{count} {layer}" for layer, count in chart.counts.items())),
        *_quality_rows(chart, frame, parameters),
    ]
    if parameters.draught_m and not len(chart.depths):
        rows.append((f"navigable, {parameters.draught_m:g} m", "it charts no depths"))
    elif parameters.draught_m:
        closed = shapely.intersection(shapely.union_all(barred(chart, frame, parameters)), covered).area
        share = 100 * (covered.area - closed) / max(covered.area - land.area, 1e-9)
        words = "not certainly" if parameters.shoals == "certain" else "certainly not"
        rows.append((f"navigable, {parameters.draught_m:g} m", f"{share:.1f} % of the water is {words} too shallow"))
    return ChartSummary(chart.name, rows)


def _edition(chart: Chart) -> str:
    if not chart.edition:
        return "not stated"
    issued = "" if chart.issued is None else f", issued {chart.issued.isoformat()}"
    return f"{chart.edition}, update {chart.update}{issued}"


def _quality_rows(chart: Chart, frame: LocalFrame, parameters: ChartedAreaParameters) -> list[tuple[str, str]]:
    """Say how good the coast is said to be, and what that makes of its imprecision."""
    import shapely

    lines, sigma = coast_sigma(chart, frame, parameters.imprecision)
    length = shapely.length(lines)
    grades = [f"{int((chart.catzoc == grade).sum())} {name}" for grade, name in GRADES.items() if grade in chart.catzoc]
    low = np.isin(chart.edge_quality, LOW_ACCURACY)
    spread = [f"{value:g} m on {_km(length[sigma == value].sum())}" for value in np.unique(sigma)]
    quapos = ", ".join(f"{name} on {count}" for name, count in sorted(chart.quapos_counts.items()) if name)
    return [
        ("quality zones", f"CATZOC {', '.join(grades)}" if grades else "none"),
        (
            "edges",
            f"{sum(chart.quapos_counts.values())}, QUAPOS {quapos or 'on none'}" if chart.quapos_counts else "none",
        ),
        ("coast", f"{_km(length.sum())}, of it {_km(length[low].sum())} of low accuracy"),
        ("its imprecision", ", ".join(spread) or "no coast"),
    ]


def _km(length_m: float) -> str:
    return f"{length_m / 1000:.0f} km" if length_m >= 100_000 else f"{length_m / 1000:.1f} km"
