"""Where two charts disagree by more than their imprecision: inconsistency, Bootsveld (2012), sections 2.2 and 2.3.

Two measurements of one coast are consistent while they differ by no more than their precision explains: within
z sqrt(s_1^2 + s_2^2), z = 1.96 for 95 %. A pier or a creek that only one of them has is an inconsistency too.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product
from typing import Any, NamedTuple

import numpy as np

from elusive.charts.chart import Chart, as_geometries
from elusive.charts.charted_area import ChartedAreaParameters, barred
from elusive.charts.quality import quality_areas
from elusive.contracts import Array
from elusive.geometry.local_frame import Geometries, LocalFrame

Z = 1.96
ROUGHNESS = 0.02  # of the allowed distance: by which a coast may be simplified before it is widened by that
STEP_M = 20.0  # between the places on the coast at which distances are taken


class Disagreement(NamedTuple):
    """How two charts differ where both say something.

    ``regions`` are the places that one calls land and the other water, further than the imprecision allows from one of
    the two coasts: x, y [m]. Distances are those of the finer chart's coast, by its length, to the coarser's.
    """

    finer: str
    coarser: str
    overlap_m2: float
    median_m: float
    percentile_95_m: float
    coast_share: float  # of the finer chart's coast beyond what the imprecision allows
    area_m2: float  # of the regions
    regions: Geometries

    @property
    def sentence(self) -> str:
        """What is to be said of it."""
        distances = f"their coasts differ by {self.median_m:.1f} m (median), {self.percentile_95_m:.0f} m (95 %)"
        if not self.area_m2:
            return f"{self.finer} and {self.coarser} agree within their imprecision; {distances}."
        return (
            f"{self.finer} and {self.coarser} disagree by more than their imprecision over {self.area_m2 / 1e6:.3g} "
            f"km2 and {100 * self.coast_share:.1f} % of the finer one's coast; {distances}."
        )


def disagreements(
    charts: Sequence[Chart], frame: LocalFrame, parameters: ChartedAreaParameters | None = None
) -> list[Disagreement]:
    """Compare each pair of charts that overlap.

    Parameters
    ----------
    charts
        Finest first.
    frame
        Of the charted area.
    parameters
        Their imprecision; land is compared whatever the draught.
    """
    parameters = (parameters or ChartedAreaParameters()).replace(draught_m=0.0)
    drawn = [_Drawn(chart, frame, parameters) for chart in charts]
    found = (_compared(finer, coarser) for finer, coarser in combinations(drawn, 2))
    return [one for one in found if one is not None]


class _Drawn:
    """One chart in the common frame."""

    def __init__(self, chart: Chart, frame: LocalFrame, parameters: ChartedAreaParameters) -> None:
        import shapely

        self.name = chart.name
        self.coverage = shapely.union_all(frame.project(chart.coverage))
        self.land = shapely.union_all(barred(chart, frame, parameters))
        self.coast = frame.project(chart.coast)
        self.areas = quality_areas(chart, frame, parameters.imprecision)

    def sigma(self, places: Geometries) -> Array:
        """Return the imprecision at points [m]."""
        import shapely

        nearest = shapely.STRtree([area.area for area in self.areas]).nearest(places)
        return np.asarray(np.array([area.sigma_m for area in self.areas])[nearest])


def _compared(finer: _Drawn, coarser: _Drawn) -> Disagreement | None:
    """Compare two charts; None where they share no area."""
    import shapely

    overlap = shapely.intersection(finer.coverage, coarser.coverage)
    if not overlap.area:
        return None
    distance, allowed = _distances(finer, coarser, overlap)
    middle, most = np.quantile(distance, [0.5, 0.95]) if len(distance) else (0.0, 0.0)
    regions = _regions(finer, coarser, overlap)
    return Disagreement(
        finer.name, coarser.name, float(overlap.area), float(middle), float(most),
        float((distance > allowed).mean()) if len(distance) else 0.0,
        float(shapely.area(regions).sum()), regions,
    )  # fmt: skip


def _distances(finer: _Drawn, coarser: _Drawn, overlap: Any) -> tuple[Array, Array]:
    """Return distances from the finer coast to the coarser, each step of its length, and what is allowed [m]."""
    import shapely

    lines = shapely.intersection(finer.coast, overlap)
    lines = as_geometries(part for part in shapely.get_parts(lines) if part.geom_type == "LineString")
    if not len(lines) or not len(coarser.coast):
        return np.zeros(0), np.zeros(0)
    along = shapely.union_all(lines) if len(lines) > 1 else lines[0]
    places = shapely.line_interpolate_point(along, np.arange(0.5 * STEP_M, shapely.length(along), STEP_M))
    _, distance = shapely.STRtree(coarser.coast).query_nearest(places, return_distance=True, all_matches=False)
    return distance, Z * np.hypot(finer.sigma(places), coarser.sigma(places))


def _regions(finer: _Drawn, coarser: _Drawn, overlap: Any) -> Geometries:
    """Return where one has land and the other water, beyond what is allowed from one of the coasts."""
    import shapely

    charts = (finer, coarser)
    differing = shapely.symmetric_difference(*(shapely.intersection(one.land, overlap) for one in charts))
    parts: list[Any] = []
    for first, second in product(finer.areas, coarser.areas):
        here = shapely.intersection(shapely.intersection(first.area, second.area), differing)
        if here.is_empty:
            continue
        allowed = Z * float(np.hypot(first.sigma_m, second.sigma_m))
        around = shapely.box(*shapely.bounds(here)).buffer(2 * allowed, quad_segs=1)
        coasts = [shapely.boundary(shapely.intersection(one.land, around)) for one in charts]
        near = [shapely.buffer(shapely.simplify(coast, ROUGHNESS * allowed), allowed, quad_segs=4) for coast in coasts]
        beyond = shapely.difference(here, shapely.intersection(*near))
        parts.extend(part for part in shapely.get_parts(beyond) if part.geom_type == "Polygon" and part.area > 0)
    return as_geometries(parts)
