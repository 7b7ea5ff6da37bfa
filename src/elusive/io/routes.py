"""A ship's route as waypoints in longitude and latitude: a table in CSV, or GeoJSON (RFC 7946); a path in metres."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io._geojson import GEOJSON, geometries
from elusive.io._table_lines import table_lines

CORNER = ("x_m", "y_m")
COLUMNS = ("lon_deg", "lat_deg", "speed_mps")
Waypoint = tuple[float, float, float]


class Route(NamedTuple):
    """Waypoints in the order in which they are sailed."""

    lonlat_deg: Array  # (W, 2), WGS 84
    speed_mps: Array  # (W,) from each waypoint to the next; NaN where it is not known


def read_route(path: str | os.PathLike[str]) -> Route:
    """Read a route.

    Parameters
    ----------
    path
        A table whose first line names ``lon_deg,lat_deg`` and perhaps ``speed_mps``, the speed from that waypoint to
        the next, a waypoint a line; or ``.geojson`` that holds one LineString, its speed as the property
        ``speed_mps``.

    Raises
    ------
    DataError
        If the file cannot be read, a waypoint is no place or a speed not positive, or there are fewer than two; the
        sentence says where.
    """
    file = Path(path)
    table = _line(file) if file.suffix.lower() in GEOJSON else _table(file)
    for number, (lon, lat, speed) in enumerate(table, 1):
        if not (abs(lon) <= 360 and abs(lat) <= 90):
            raise DataError(f"{path}, waypoint {number}: ({lon:g}, {lat:g}) is no longitude and latitude in degrees.")
        if not (math.isnan(speed) or 0 < speed < math.inf):
            raise DataError(
                f"{path}, waypoint {number}: its speed, {speed:g} m/s, is not positive; give a positive one."
            )
    if len(table) < 2:
        raise DataError(f"{path}: holds {len(table)} waypoints; a route needs two at least.")
    values = np.array(table, dtype=np.float64)
    return Route(values[:, :2], values[:, 2])


def read_way(path: str | os.PathLike[str]) -> Array:
    """Read the corners of a path, ``(n, 2)`` east and north [m]: CSV under a header that names ``x_m`` and ``y_m``.

    Raises
    ------
    DataError
        If the header lacks a column, a line is no place, or there is none.
    """
    corners = [[line.number(name) for name in CORNER] for line in table_lines(path, CORNER, None, "a corner a line")]
    if not corners:
        raise DataError(f"{path}: holds no place; write {','.join(CORNER)}, a corner a line.")
    return np.array(corners)


def _table(path: Path) -> list[Waypoint]:
    return [
        (line.number("lon_deg"), line.number("lat_deg"), line.number("speed_mps", absent=math.nan))
        for line in table_lines(path, COLUMNS[:2], COLUMNS[2:], "a waypoint a line")
    ]


def _line(path: Path) -> list[Waypoint]:
    lines = geometries(path, "LineString", f"a table of {','.join(COLUMNS[:2])}")
    if len(lines) != 1:
        raise DataError(f"{path}: holds {len(lines)} LineStrings; a route is one.")
    ((coordinates, properties),) = lines
    stated = properties.get(COLUMNS[2])
    try:
        speed = math.nan if stated is None else float(stated)
        table = [(float(place[0]), float(place[1]), speed) for place in coordinates]
    except (TypeError, ValueError, OverflowError, IndexError, KeyError):
        raise DataError(f"{path}: its coordinates or its speed are no numbers; write [longitude, latitude].") from None
    if not np.isfinite(np.array(table).reshape(-1, 3)[:, :2]).all():
        raise DataError(f"{path}: has a coordinate that is not finite; leave it out.")
    return table
