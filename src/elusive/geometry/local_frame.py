"""One local metric frame a scene: azimuthal equidistant about its centre on the WGS 84 ellipsoid.

Ranges and bearings from the origin are exact, as a radar there measures them; across the line of sight lengths are
stretched by d^2 / 6R^2 at a distance d: 1e-5 at 50 km, 1e-3 at 500 km. Snyder (1987), Map projections: a working
manual, section 25.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.longitude import unwrapped, wrapped

EARTH_RADIUS_M = 6_371_009.0
FURTHEST_M = 500_000.0
STEP_DEG = 0.01  # longer edges are divided: straight in longitude and latitude, they bend by 3 cm within it


Geometries = NDArray[np.object_]


class Covering(Protocol):
    """What covers a part of the Earth: a chart."""

    @property
    def coverage(self) -> Geometries:
        """Polygons in longitude and latitude [degrees]."""


class LocalFrame(NamedTuple):
    """x east and y north of a place [m]; outside of it all is longitude and latitude, WGS 84."""

    lon_deg: float
    lat_deg: float

    @classmethod
    def at(cls, lon_deg: float, lat_deg: float) -> LocalFrame:
        """Put the origin at a place.

        Raises
        ------
        DataError
            If the longitude is not within 360 degrees, or the latitude not within 90.
        """
        if not (abs(lon_deg) <= 360 and abs(lat_deg) <= 90):
            raise DataError(f"({lon_deg:g}, {lat_deg:g}): is no longitude and latitude in degrees.")
        return cls(wrapped(float(lon_deg)), float(lat_deg))

    @classmethod
    def about(cls, charts: Sequence[Covering]) -> LocalFrame:
        """Put the origin in the middle of some charts; they may lie on both sides of the antimeridian.

        Raises
        ------
        DataError
            If a chart reaches further than 500 km from the middle: the frame would stretch it by a thousandth.
        """
        import shapely

        places = np.concatenate([shapely.get_coordinates(chart.coverage) for chart in charts])
        lon = unwrapped(places[:, 0])
        frame = cls.at(0.5 * (lon.min() + lon.max()), 0.5 * float(places[:, 1].min() + places[:, 1].max()))
        furthest = float(np.hypot(*frame.to_local(places).T).max())
        if not furthest <= FURTHEST_M:
            raise DataError(
                f"charts: reach {furthest / 1000:.0f} km from their middle, more than the {FURTHEST_M / 1000:.0f} km "
                f"at which a flat frame stretches by {100 * cls.distortion(FURTHEST_M):.1f} %; give fewer charts, or a "
                "file cut to the scene."
            )
        return frame

    @staticmethod
    def distortion(distance_m: float) -> float:
        """Relative stretch of lengths across the line of sight at a distance from the origin."""
        angle = distance_m / EARTH_RADIUS_M
        return float(angle / np.sin(angle) - 1) if angle else 0.0

    def to_local(self, lonlat_deg: ArrayLike) -> Array:
        """Turn ``(N, 2)`` longitudes and latitudes [degrees] into x, y [m]."""
        return self._through(lonlat_deg, "FORWARD")

    def to_lonlat(self, xy_m: ArrayLike) -> Array:
        """Turn ``(N, 2)`` x, y [m] into longitudes and latitudes [degrees]."""
        return self._through(xy_m, "INVERSE")

    def project(self, shapes: Geometries) -> Geometries:
        """Turn geometries in longitude and latitude into x, y [m]; long edges are divided first."""
        import shapely

        near = shapely.transform(shapes, self.alongside)
        return np.asarray(shapely.transform(shapely.segmentize(near, STEP_DEG), self.to_local), dtype=object)

    def alongside(self, lonlat_deg: Array) -> Array:
        """Add a turn to ``(N, 2)`` longitudes beyond the antimeridian, so that no edge runs round the Earth."""
        off = lonlat_deg[:, 0] - self.lon_deg
        return np.column_stack([lonlat_deg[:, 0] - 360 * np.round(off / 360), lonlat_deg[:, 1]])

    def unproject(self, shapes: Geometries) -> Geometries:
        """Turn geometries in x, y [m] into longitude and latitude."""
        import shapely

        return np.asarray(shapely.transform(shapes, self.to_lonlat), dtype=object)

    def _through(self, points: ArrayLike, direction: str) -> Array:
        table = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        return np.column_stack(_transformer(*self).transform(table[:, 0], table[:, 1], direction=direction))


@cache
def _transformer(lon_deg: float, lat_deg: float) -> Any:
    try:
        from pyproj import Transformer
    except ModuleNotFoundError:
        raise missing_extra("pyproj") from None
    local = f"+proj=aeqd +lon_0={lon_deg!r} +lat_0={lat_deg!r} +ellps=WGS84 +units=m +no_defs"
    return Transformer.from_crs("EPSG:4326", local, always_xy=True)


def missing_extra(package: str) -> DataError:
    """Return the error that says which extra is not installed."""
    return DataError(f"charts: {package} is not installed; run pip install 'elusive[charts]'.")
