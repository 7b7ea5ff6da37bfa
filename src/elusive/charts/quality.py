"""How imprecise a chart's coast is: a standard deviation for each stretch, and the area where each holds.

Bootsveld (2012), section 4.1: the plane is split into areas S_i, each with its own distribution of the constraint's
error, phi_k(s_k). IHO S-57 edition 3.1, appendix A: CATZOC and QUAPOS.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.charts.chart import UNASSESSED, Chart, as_geometries
from elusive.contracts import Array
from elusive.geometry.local_frame import Geometries, LocalFrame
from elusive.model import Model, NonNegative, Positive

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

GRADES = {1: "A1", 2: "A2", 3: "B", 4: "C", 5: "D", UNASSESSED: "U"}  # CATZOC
LOW_ACCURACY = (2, 3, 4, 5, 6, 7, 8, 9)  # QUAPOS: unsurveyed to estimated, what S-52 draws as of low accuracy
SPACING_M = 200.0  # between the places on the coast by which the plane is split
FALL_M = 100.0  # over which a deviation falls off by a factor of e, from a less certain area into a more certain one
GRADE, NEAR = 1.2, 0.08  # ratio of deviations within a graded area, and of areas that are not told apart
CORNERS = 4  # segments of a quarter of a circle


class Imprecision(Model):
    """How a chart's statements of quality become a standard deviation of its coast.

    CATZOC grades soundings, not coastlines, which are often better: give ``coast_sigma_m`` where more is known. Its
    95 % limits in two dimensions, 5, 20, 50 and 500 m, are 2.45 deviations along an axis. For D and U, S-57 gives no
    limit: C's stands in for them. Nor does it for QUAPOS: the factor is a choice. No survey makes a coast better than
    it was drawn: a width on paper, at the compilation scale where the chart states it, is the least deviation.
    """

    coast_sigma_m: Positive | None = Field(
        None, description="Deviation of the charted coast along an axis [m], everywhere; else from the charts' quality"
    )
    sigma_a1_m: Positive = Field(2.04, description="Deviation where CATZOC is A1 [m]")
    sigma_a2_m: Positive = Field(8.2, description="Deviation where CATZOC is A2 [m]")
    sigma_b_m: Positive = Field(20.4, description="Deviation where CATZOC is B [m]")
    sigma_c_m: Positive = Field(204.0, description="Deviation where CATZOC is C [m]")
    sigma_d_m: Positive = Field(
        204.0, description="Deviation where CATZOC is D, worse than C by an unstated amount [m]"
    )
    sigma_u_m: Positive = Field(204.0, description="Deviation where CATZOC is U, unassessed, or none is stated [m]")
    low_accuracy_factor: float = Field(
        2.0,
        ge=1,
        allow_inf_nan=False,
        description="Times these where the coast's own position is of low accuracy: QUAPOS 2 to 9",
    )
    drawn_mm: NonNegative = Field(
        0.3,
        description="Least deviation of a coast on paper, at the chart's compilation scale, whatever its grade; "
        "0: none [mm]",
    )

    def of(self, catzoc: NDArray[np.int64], quapos: NDArray[np.int64], scale: int | None = None) -> Array:
        """Return the deviation for each pair of CATZOC and QUAPOS [m], on a chart of a scale, if it states one."""
        if self.coast_sigma_m is not None:
            return np.full(len(catzoc), self.coast_sigma_m)
        by_grade = np.array([getattr(self, f"sigma_{grade.lower()}_m") for grade in GRADES.values()])
        known = np.where((catzoc >= 1) & (catzoc <= UNASSESSED), catzoc, UNASSESSED)
        graded = by_grade[known - 1] * np.where(np.isin(quapos, LOW_ACCURACY), self.low_accuracy_factor, 1.0)
        return np.asarray(np.maximum(graded, self.drawn_mm * (scale or 0) / 1000.0))


class QualityArea(NamedTuple):
    """Where a chart's coast has one imprecision."""

    sigma_m: float
    area: BaseGeometry  # within the chart's coverage, x and y [m]


def quality_areas(chart: Chart, frame: LocalFrame, imprecision: Imprecision) -> list[QualityArea]:
    """Split a chart's coverage by the imprecision of the nearest stretch of coast, the smallest first.

    An edge of the coast has the CATZOC of the quality zone nearest to its middle, and its own QUAPOS. Areas do not
    overlap and fill the coverage.
    """
    import shapely

    coverage = shapely.union_all(frame.project(chart.coverage))
    lines, sigma = coast_sigma(chart, frame, imprecision)
    values, label = np.unique(sigma, return_inverse=True)
    if len(values) <= 1:
        alone = (
            values[0] if len(values) else imprecision.of(np.array([UNASSESSED]), np.zeros(1, np.int64), chart.scale)[0]
        )
        return [QualityArea(float(alone), coverage)]
    places, of_line = shapely.get_coordinates(shapely.segmentize(lines, SPACING_M), return_index=True)
    places, first = np.unique(places, axis=0, return_index=True)
    cells = shapely.get_parts(
        shapely.voronoi_polygons(shapely.MultiPoint(places), extend_to=coverage.buffer(SPACING_M), ordered=True)
    )
    label = label[of_line[first]]
    parts = [shapely.coverage_union_all(cells[label == number]) for number in range(len(values))]
    parts = shapely.coverage_simplify(
        as_geometries(parts), SPACING_M / 2
    )  # cells are jagged, and their places a choice
    areas, left = [], coverage
    for part, value in zip(parts[:-1], values[:-1], strict=True):
        area = shapely.intersection(part, left)
        left = shapely.difference(left, area)
        areas.append(QualityArea(float(value), area))
    areas.append(QualityArea(float(values[-1]), left))
    return graded([part for part in areas if not part.area.is_empty])


def graded(areas: Sequence[QualityArea]) -> list[QualityArea]:
    """Let the deviation fall off from a less certain area into a more certain one, instead of by a step.

    It is the least function that is nowhere below the areas' own and whose logarithm changes by one over
    ``FALL_M``: land of the less certain area is as uncertain on both sides of the border. It is cut into areas, the
    smallest deviation first, within which it differs by a factor of ``GRADE`` at most.
    """
    import shapely

    own = np.array([area.sigma_m for area in areas])
    spread = math.log(own.max() / own.min())
    if not spread > 0:
        return list(areas)
    even = own.min() * np.exp(spread * np.linspace(0.0, 1.0, math.ceil(spread / math.log(GRADE)) + 1))
    kept = np.concatenate([own, (own * math.sqrt(GRADE))[own < own.max()]])  # an area's own deviation holds alone
    apart = (np.abs(np.log(even[:, None] / kept)) > NEAR).all(axis=1)
    levels = np.unique(np.concatenate([kept, even[apart]]))
    found, above, whole = list[QualityArea](), shapely.Polygon(), shapely.union_all([area.area for area in areas])
    for number in range(len(levels) - 1, -1, -1):
        low, high = levels[number], levels[min(number + 1, len(levels) - 1)]
        reach = [
            shapely.buffer(area.area, FALL_M * math.log(area.sigma_m / low), quad_segs=CORNERS)
            for area in areas
            if area.sigma_m >= low
        ]
        here = shapely.intersection(shapely.union_all(reach), whole)
        value = low if low in own else math.sqrt(low * high)
        found.append(QualityArea(float(value), shapely.difference(here, above)))
        above = here
    return [part for part in reversed(found) if not part.area.is_empty]


def coast_sigma(chart: Chart, frame: LocalFrame, imprecision: Imprecision) -> tuple[Geometries, Array]:
    """Return the edges of a chart's coast, x and y [m], and the deviation of each [m]."""
    import shapely

    lines = frame.project(chart.edges)
    catzoc = np.full(len(lines), UNASSESSED)
    if len(chart.zones) and len(lines):
        middles = shapely.line_interpolate_point(lines, 0.5, normalized=True)
        catzoc = chart.catzoc[shapely.STRtree(frame.project(chart.zones)).nearest(middles)]
    return lines, imprecision.of(catzoc, chart.edge_quality, chart.scale)
