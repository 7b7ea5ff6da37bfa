"""From charts to one coast in one local metric frame: the finer chart wins, and a draught says what is navigable.

Bootsveld (2012), section 4.1, for charts of differing precision side by side; S-57, DRVAL1 and DRVAL2 of DEPARE.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from elusive.charts.chart import Chart, as_geometries, polygons_of
from elusive.charts.coast import Coast, CoastPart
from elusive.charts.enc import read_cell
from elusive.charts.outlines import SUFFIXES, read_outline
from elusive.charts.quality import Imprecision, quality_areas
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.model import Model, NonNegative

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

UNSTATED_SCALE = 250_000  # of a coast without a scale: about GSHHG's source
CIRCLE = 4  # segments of a quarter circle round a point of land
MOST_CELLS = 40  # of a folder


class ChartedAreaParameters(Model):
    """What a chart is taken to say about where a target can be."""

    imprecision: Imprecision = Field(Imprecision(), description="Of the charted coast")
    draught_m: NonNegative = Field(0.0, description="Depth that the target needs [m]; 0: all water is navigable")
    water_level_m: float = Field(0.0, allow_inf_nan=False, description="Height of the water above chart datum [m]")
    shoals: Literal["certain", "possible"] = Field(
        "certain",
        description="What a draught rules out: areas too shallow throughout (for tracking), or any that may be in some "
        "place, dredged and unsurveyed ones of unknown depth too (for planning)",
    )
    bias_east_m: float = Field(
        0.0, allow_inf_nan=False, description="How far the charts are known to stand east of the truth [m]"
    )
    bias_north_m: float = Field(
        0.0, allow_inf_nan=False, description="How far the charts are known to stand north of the truth [m]"
    )
    islet_mm: NonNegative = Field(
        0.3, description="Width on paper, at the chart's scale, of land that it draws as a point or a line [mm]"
    )


class ChartedArea(NamedTuple):
    """Some charts in one frame."""

    frame: LocalFrame
    charts: tuple[Chart, ...]  # finest first
    coast: Coast


def read_charts(*paths: str | Path) -> tuple[Chart, ...]:
    """Read charts of any kind, S-57 cells, GeoJSON or shapefiles; finest first, those without a scale last.

    Of a folder, such as an ENC_ROOT, all cells in it and below are read.

    Raises
    ------
    DataError
        If there is none, one is given twice, or one cannot be read.
    """
    if not paths:
        raise DataError("charts: none was given; give at least one.")
    charts: dict[Path, Chart] = {}
    for path in (file for given in paths for file in _files(Path(given))):
        if path.resolve() in charts:
            raise DataError(f"{path}: is given twice; give it once.")
        charts[path.resolve()] = read_outline(path) if path.suffix.lower() in SUFFIXES else read_cell(path)
    return tuple(sorted(charts.values(), key=lambda chart: chart.scale or np.inf))


def _files(path: Path) -> list[Path]:
    """Return a file, or the base cells of a folder."""
    if not path.is_dir():
        return [path]
    cells = sorted(path.rglob("*.000"))
    if not cells:
        raise DataError(f"{path}: holds no S-57 base cell (.000); give a folder that does, or charts.")
    if len(cells) > MOST_CELLS:
        raise DataError(f"{path}: holds {len(cells)} cells, more than {MOST_CELLS}; give those round the radar.")
    return cells


def lay_charts(
    charts: Sequence[Chart], parameters: ChartedAreaParameters | None = None, frame: LocalFrame | None = None
) -> ChartedArea:
    """Lay charts over each other.

    Parameters
    ----------
    charts
        From :func:`read_charts`; where two overlap the finer one wins, the earlier of two of one scale.
    parameters
        Imprecision, draught.
    frame
        Its origin; None: the middle of the charts.

    Raises
    ------
    DataError
        If the charts are too far apart, or have neither land nor shoals that a target cannot enter.
    """
    parameters = parameters or ChartedAreaParameters()
    charts = tuple(sorted(charts, key=lambda chart: chart.scale or np.inf))
    frame = frame or LocalFrame.about(charts)
    areas = [area for chart in charts for area in coast_parts(chart, frame, parameters)]
    return ChartedArea(frame, charts, Coast.of(*areas))


def coast_parts(chart: Chart, frame: LocalFrame, parameters: ChartedAreaParameters) -> list[CoastPart]:
    """Return what one chart says, an entry for each imprecision; a known bias is taken off it."""
    import shapely

    bias = np.array([parameters.bias_east_m, parameters.bias_north_m])

    def moved_back(shapes: Any) -> Any:
        return shapely.transform(shapes, lambda places: places - bias)

    land = list(moved_back(as_geometries(barred(chart, frame, parameters))))
    areas = [part._replace(area=moved_back(part.area)) for part in quality_areas(chart, frame, parameters.imprecision)]
    # The last is given the whole coverage: what the others leave of it, without slivers between them.
    covers = [*(area.area for area in areas[:-1]), shapely.union_all([area.area for area in areas])]
    return [CoastPart(land, area.sigma_m, polygons_of(cover)) for area, cover in zip(areas, covers, strict=True)]


def barred(chart: Chart, frame: LocalFrame, parameters: ChartedAreaParameters) -> list[BaseGeometry]:
    """Return where a target cannot be according to one chart: land, islets and what is too shallow, as polygons."""
    import shapely

    radius = 0.5e-3 * parameters.islet_mm * (chart.scale or UNSTATED_SCALE)
    shapes = [*frame.project(chart.land)]
    if radius > 0:
        shapes += [*shapely.buffer(frame.project(chart.islets), radius, quad_segs=CIRCLE)]
    shapes += [*frame.project(too_shallow(chart, parameters))]
    return polygons_of(shapely.union_all(shapes))


def too_shallow(chart: Chart, parameters: ChartedAreaParameters) -> Any:
    """Return the areas of depth that a draught rules out, in longitude and latitude."""
    if not parameters.draught_m:
        return as_geometries([])
    least, greatest = chart.depth_range_m.T + parameters.water_level_m
    if parameters.shoals == "certain":
        return chart.depths[greatest < parameters.draught_m]
    return chart.depths[~(least >= parameters.draught_m)]
