"""Two charts of one coast: the fine one is taken for the truth, the coarse one is what filters have."""

from __future__ import annotations

import dataclasses
from functools import cached_property, lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np

from elusive.charts import WATER_MODELS
from elusive.charts.chart import Chart, as_geometries
from elusive.charts.charted_area import ChartedAreaParameters, barred, lay_charts, read_charts
from elusive.charts.coast import Coast, rings_of
from elusive.charts.displaced import DisplacedWater
from elusive.charts.quality import Imprecision
from elusive.contracts import Array, Knowledge
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame

KnowledgeName = Literal["none", "hard", "nearest", "grid", "exact", "field"]
SHARE = 0.9  # of a persistent error's variance that persists
AROUND_M = 1000.0  # beyond the fine chart nothing is nearer than its own land


class Case(NamedTuple):
    """What a filter knows of the coast."""

    knowledge: KnowledgeName
    sigma_m: float | None = None  # of the coast; None: as the chart's quality says
    coast_error: Literal["fresh", "persistent"] = "fresh"  # drawn anew each second, as in the thesis, or kept


class ChartPair:
    """Both charts in a frame about the middle of the fine one; what is prepared of them is kept.

    Raises
    ------
    DataError
        If a chart cannot be read, or they do not overlap.
    """

    def __init__(self, fine: str, coarse: str) -> None:
        import shapely

        self.fine, chart = read_charts(fine)[0], read_charts(coarse)[0]
        self.frame = LocalFrame.about([self.fine])
        covered = shapely.intersection(shapely.union_all(chart.coverage), shapely.union_all(self.fine.coverage))
        if not covered.area:
            raise DataError(f"{coarse}: does not overlap {fine}; choose two charts of one coast.")
        # as far as the fine one reaches: a grid over all of the coarse one would be too large
        parts = as_geometries(part for part in shapely.get_parts(covered) if part.geom_type == "Polygon")
        self.coarse = dataclasses.replace(chart, coverage=parts)
        self._coasts: dict[float | None, Coast] = {}
        self._knowledge: dict[Case, Knowledge] = {}

    def knowledge(self, case: Case) -> tuple[Knowledge, ...]:
        """Prepare what a filter knows."""
        if case.knowledge == "none":
            return ()
        if case not in self._knowledge:
            model, coast = WATER_MODELS[case.knowledge](), self.coast(case.sigma_m)
            persistent = case.coast_error == "persistent"
            self._knowledge[case] = DisplacedWater.persistent(model, coast, SHARE) if persistent else model.bind(coast)
        return (self._knowledge[case],)

    def coast(self, sigma_m: float | None) -> Coast:
        """Coast of the coarse chart, with an imprecision or its own."""
        if sigma_m not in self._coasts:
            parameters = ChartedAreaParameters(imprecision=Imprecision(coast_sigma_m=sigma_m))
            self._coasts[sigma_m] = lay_charts([self.coarse], parameters, self.frame).coast
        return self._coasts[sigma_m]

    def depth(self, places: Array) -> Array:
        """Tell how far into the coarse chart's land places ``(N, 2)`` lie, negative at sea, ``(N,)`` [m]."""
        import shapely

        points = shapely.points(places)
        _, distance = self._coast_edges.query_nearest(points, return_distance=True, all_matches=False)
        return np.asarray(np.where(shapely.contains(self.coarse_land, points), distance, -distance))

    def away(self, places: Array) -> Array:
        """Directions from the nearest land of the fine chart to places ``(N, 2)`` at sea, ``(N, 2)`` unit vectors."""
        import shapely

        lines = shapely.get_coordinates(shapely.shortest_line(self.fine_land, shapely.points(places)))
        along = lines[1::2] - lines[::2]
        return np.asarray(along / np.hypot(*along.T)[:, None])

    @cached_property
    def fine_land(self) -> Any:
        """Land of the fine chart, x and y [m]."""
        return self._land(self.fine)

    @cached_property
    def coarse_land(self) -> Any:
        """Land of the coarse chart, x and y [m]."""
        return self._land(self.coarse)

    @cached_property
    def _coast_edges(self) -> Any:
        import shapely

        rings = rings_of(self.coarse_land)
        return shapely.STRtree(shapely.linestrings(rings.edges.reshape(-1, 2, 2)))

    def _land(self, chart: Chart) -> Any:
        import shapely

        land = shapely.union_all(barred(chart, self.frame, ChartedAreaParameters()))
        around = shapely.union_all(self.frame.project(self.fine.coverage))
        land = shapely.intersection(land, shapely.buffer(around, AROUND_M))
        shapely.prepare(land)
        return land


@lru_cache(maxsize=2)
def charts(fine: str, coarse: str) -> ChartPair:
    """Read two charts, once a process."""
    return ChartPair(fine, coarse)
