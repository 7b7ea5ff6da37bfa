"""One chart as it was read, in longitude and latitude (WGS 84): land, coast, depths, quality and coverage."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.local_frame import Geometries
from elusive.geometry.longitude import unwrapped, wrapped

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

NOTHING: Geometries = np.zeros(0, dtype=object)
UNASSESSED = 6  # CATZOC U


@dataclass(frozen=True, eq=False)
class Chart:
    """What one chart says. Geometries are in degrees, longitude and latitude, WGS 84.

    Attributes
    ----------
    name, path
        Of the cell or the file.
    scale
        Denominator of the compilation scale; None where none is stated.
    edition, update, issued
        Edition, number of the last update applied, and its date of issue.
    counts
        Number of objects by layer.
    quapos_counts
        Number of all edges, not of the coast's alone, by their QUAPOS; 0 where none is stated.
    land
        Polygons of land, solid structures among them.
    islets
        Points and lines of land, too small for the chart to draw as areas.
    marks
        Points that stand out of the water or on land, and do not float: beacons, landmarks, rocks.
    coverage
        Polygons within which the chart says anything.
    coast
        Lines of the coast, natural and built.
    edges, edge_quality
        Edges of the coast, and the QUAPOS of each; 0 where none is stated.
    depths, depth_range_m
        Polygons of depth, and ``(D, 2)`` least and greatest depth below chart datum; NaN where not known.
    zones, catzoc
        Polygons of quality, and the CATZOC of each.
    remarks
        What the reader found odd but could live with.
    """

    name: str
    path: Path
    land: Geometries
    coverage: Geometries
    coast: Geometries
    scale: int | None = None
    edition: str = ""
    update: int | None = None
    issued: date | None = None
    counts: Mapping[str, int] = field(default_factory=dict)
    quapos_counts: Mapping[int, int] = field(default_factory=dict)
    islets: Geometries = field(default_factory=NOTHING.copy)
    marks: Geometries = field(default_factory=NOTHING.copy)
    edges: Geometries = field(default_factory=NOTHING.copy)
    edge_quality: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    depths: Geometries = field(default_factory=NOTHING.copy)
    depth_range_m: Array = field(default_factory=lambda: np.zeros((0, 2)))
    zones: Geometries = field(default_factory=NOTHING.copy)
    catzoc: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    remarks: tuple[str, ...] = ()

    @property
    def extent_deg(self) -> tuple[float, float, float, float]:
        """West, south, east, north of the coverage; east is less than west across the antimeridian."""
        import shapely

        lon, lat = shapely.get_coordinates(self.coverage).T
        lon = unwrapped(lon)
        return wrapped(float(lon.min())), float(lat.min()), wrapped(float(lon.max())), float(lat.max())


def valid_polygons(shapes: Iterable[Any], where: str) -> Geometries:
    """Return the polygons of polygons and multi-polygons, one each, after a look at each.

    Raises
    ------
    DataError
        If one is no polygon, crosses itself or has a coordinate that is no longitude or latitude.
    """
    import shapely

    polygons: list[Any] = []
    for number, shape in enumerate(shapes, 1):
        if shape is None or shape.is_empty:
            raise DataError(f"{where}, object {number}: has no outline; mend the file.")
        if shape.geom_type not in ("Polygon", "MultiPolygon"):
            raise DataError(f"{where}, object {number}: is a {shape.geom_type}, not a polygon; leave it out.")
        coordinates = np.abs(shapely.get_coordinates(shape))
        if not (coordinates <= (360, 90)).all():
            raise DataError(f"{where}, object {number}: has a coordinate that is no longitude or latitude.")
        if not shape.is_valid:
            reason = shapely.is_valid_reason(shape)
            raise DataError(f"{where}, object {number}: is no valid polygon ({reason}); mend the file.")
        polygons.extend(shapely.get_parts(shape))
    return as_geometries(polygons)


def as_geometries(shapes: Iterable[Any]) -> Geometries:
    """Return an array of geometries."""
    listed = list(shapes)
    array = np.empty(len(listed), dtype=object)
    array[:] = listed
    return array


def polygons_of(shape: BaseGeometry) -> list[BaseGeometry]:
    """Return a shape's polygons; lines and points, where areas only touch, are left out."""
    import shapely

    return [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
