"""Land as polygons in one local metric frame, with the imprecision of each chart; flat arrays for the kernels.

The imprecision follows Bootsveld (2012), section 4.1: the plane is split into the charts' areas, and a position takes
the deviation of the area that it lies in. Land is united across charts first, so that a coast drawn twice counts once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

MOST_AREAS = 100
SNAP_M = 1e-5  # vertices of united polygons come to lie on this grid: no slivers where two charts meet
BORDER_M = 0.1  # off a chart's border, land that is cut there: a border's chord is off by 3 cm, 1e-7 degrees are 1 cm


class CoastPart(NamedTuple):
    """What one chart says: its land, where it says anything, and how imprecise it is."""

    land: BaseGeometry | Sequence[BaseGeometry]  # polygons with holes, x east and y north [m]
    sigma_m: float  # standard deviation of the coast's position along each axis [m]
    coverage: BaseGeometry | Sequence[BaseGeometry] | None = None  # polygons; None: everywhere


class Rings(NamedTuple):
    """Closed rings one after the other, what they enclose on their left; the first vertex is repeated as the last."""

    vertices: Array  # (V, 2) x, y [m]
    starts: NDArray[np.int64]  # (R + 1,) ring r is vertices[starts[r]:starts[r + 1]]

    @property
    def each(self) -> list[Array]:
        """Each ring's vertices, ``(V, 2)``."""
        return [self.vertices[a:b] for a, b in pairwise(self.starts)]

    @property
    def edges(self) -> Array:
        """Edges as ``(E, 4)``: x, y of the first end, x, y of the second."""
        pairs = np.hstack([self.vertices[:-1], self.vertices[1:]])
        return np.delete(pairs, self.starts[1:-1] - 1, axis=0)


@dataclass(frozen=True, eq=False)
class Coast:
    """United land of one or several charts in one local metric frame.

    Attributes
    ----------
    land
        Rings of the land, land on their left: outer rings counter-clockwise, holes clockwise.
    on_border
        ``(V,)`` whether the edge that begins at a vertex of ``land`` is no coast: it ends there because a chart does.
    border
        Rings round what the charts cover; none where something is known everywhere.
    areas
        Rings round the area of each chart, finest first; the areas do not overlap.
    sigma_m
        ``(K,)`` imprecision in each area [m].
    everywhere
        Whether the last area is all that the others leave.
    """

    land: Rings
    on_border: NDArray[np.bool_]
    border: Rings
    areas: tuple[Rings, ...]
    sigma_m: Array
    everywhere: bool

    @classmethod
    def of(cls, *charts: CoastPart) -> Coast:
        """Unite charts, finest first: where two overlap, the later says nothing.

        Parameters
        ----------
        charts
            One for each chart; only the last may do without a coverage.

        Raises
        ------
        DataError
            If there is no chart, a shape is no polygon, crosses itself or has a coordinate that is not finite, or
            shapely is not installed.
        ParameterError
            If an imprecision is not positive.
        """
        try:
            import shapely
        except ModuleNotFoundError as error:
            raise DataError("charts: their polygons need shapely; install elusive[charts].") from error
        if not charts:
            raise DataError("charts: none was given; give at least one.")
        lands, covers, sigmas, seams = [], [], [], []
        taken: Any = shapely.Polygon()
        united: dict[int, Any] = {}  # a chart of several imprecisions gives the same land with each
        for number, chart in enumerate(charts, 1):
            if not (math.isfinite(chart.sigma_m) and chart.sigma_m > 0):
                raise ParameterError(f"chart {number}: sigma_m must be positive (got {chart.sigma_m!r}).")
            if id(chart.land) not in united:
                united[id(chart.land)] = _united(chart.land, f"chart {number}, land")
            land = united[id(chart.land)]
            if chart.coverage is None:
                if number < len(charts):
                    raise DataError(f"chart {number}: has no coverage and hides those after it; put it last.")
                lands.append(shapely.difference(land, taken, grid_size=SNAP_M))
                sigmas.append(chart.sigma_m)
                continue
            cover = shapely.difference(_united(chart.coverage, f"chart {number}, coverage"), taken, grid_size=SNAP_M)
            parts = shapely.get_parts(cover)  # lines and points may be left where two borders meet
            cover = shapely.multipolygons(parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON])
            if cover.is_empty:
                continue
            lands.append(shapely.intersection(land, cover, grid_size=SNAP_M))
            covers.append(cover)
            sigmas.append(chart.sigma_m)
            taken = shapely.union_all([taken, cover], grid_size=SNAP_M)
            if number == len(charts) or charts[number].land is not chart.land:
                seams.append(shapely.boundary(taken))
        if not sigmas:
            raise DataError("charts: their coverage is empty; nothing is known anywhere.")
        if len(sigmas) > MOST_AREAS:
            raise DataError(f"charts: {len(sigmas)} areas are too many; give at most {MOST_AREAS}.")
        everywhere = charts[-1].coverage is None
        outline = rings_of(shapely.union_all(lands, grid_size=SNAP_M) if len(lands) > 1 else lands[0])
        border = rings_of(shapely.Polygon() if everywhere else taken)
        return cls(
            outline,
            _along(outline, seams),
            border,
            tuple(rings_of(cover) for cover in covers),
            np.array(sigmas),
            everywhere,
        )

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Least x and y, greatest x and y of land and of what is covered [m]; zeros where there is neither."""
        corners = np.concatenate([self.land.vertices, *(area.vertices for area in self.areas)])
        if not len(corners):
            return 0.0, 0.0, 0.0, 0.0
        (west, south), (east, north) = corners.min(axis=0), corners.max(axis=0)
        return float(west), float(south), float(east), float(north)

    def extent(self, area: int) -> Array | None:
        """Least and greatest x and y of an area, ``(2, 2)`` [m]; None if it has no bounds."""
        if area == len(self.areas):
            return None
        corners = self.areas[area].vertices
        return np.array([corners.min(axis=0), corners.max(axis=0)])

    @property
    def length_m(self) -> float:
        """Length of the coast, without the stretches where land ends because a chart does [m]."""
        return float(edge_lengths(self.land)[~self.on_border].sum())

    @property
    def area_m2(self) -> float:
        """Area of the land [m^2]."""
        x0, y0, x1, y1 = self.land.edges.T if len(self.land.vertices) else np.zeros((4, 0))
        return float(0.5 * ((x0 - x1) * (y0 + y1)).sum())


def rings_of(shape: BaseGeometry) -> Rings:
    """Return the rings of a polygon or several, what they enclose on their left."""
    import shapely

    polygons = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon" and not part.is_empty]
    rings = shapely.get_rings(shapely.orient_polygons(polygons, exterior_cw=False)) if polygons else []
    if not len(rings):
        return Rings(np.zeros((0, 2)), np.zeros(1, np.int64))
    vertices, ring = shapely.get_coordinates(rings, return_index=True)
    return Rings(np.ascontiguousarray(vertices), np.searchsorted(ring, np.arange(len(rings) + 1)).astype(np.int64))


def edge_lengths(rings: Rings) -> Array:
    """Length of the edge that begins at each vertex, ``(V,)`` [m]; zero at the last of a ring."""
    lengths = np.zeros(len(rings.vertices))
    if len(lengths):
        lengths[:-1] = np.hypot(*np.diff(rings.vertices, axis=0).T)
        lengths[rings.starts[1:] - 1] = 0.0
    return lengths


def _united(shapes: BaseGeometry | Sequence[BaseGeometry], where: str) -> Any:
    """Return the union of polygons, after a look at each."""
    import shapely

    parts = shapely.get_parts(np.atleast_1d(np.array(shapes, dtype=object)))
    for number, part in enumerate(parts, 1):
        if part.geom_type != "Polygon":
            raise DataError(f"{where}: part {number} is a {part.geom_type}; give polygons.")
        if not np.isfinite(shapely.get_coordinates(part)).all():
            raise DataError(f"{where}: part {number} has a coordinate that is not finite; leave it out.")
        if not part.is_valid:
            raise DataError(
                f"{where}: part {number} is no valid polygon ({shapely.is_valid_reason(part)}); mend it first."
            )
    return shapely.union_all(parts, grid_size=SNAP_M)


def _along(land: Rings, seams: Sequence[BaseGeometry]) -> NDArray[np.bool_]:
    """Tell which edges of the land run along a chart's border, whether or not another chart goes on there."""
    import shapely

    along = np.zeros(len(land.vertices), dtype=bool)
    if len(along) and seams:
        line = shapely.union_all(seams)
        shapely.prepare(line)
        near = shapely.dwithin(line, shapely.points(land.vertices), BORDER_M)
        middles = shapely.points(0.5 * (land.vertices[:-1] + land.vertices[1:]))
        along[:-1] = near[:-1] & near[1:]
        along[:-1][along[:-1]] = shapely.dwithin(line, middles[along[:-1]], BORDER_M)
        along[land.starts[1:] - 1] = False
    return along
