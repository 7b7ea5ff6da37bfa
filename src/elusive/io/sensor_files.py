"""Where sensors stand, from a table or GeoJSON; places that lines of a table tell, in local metres."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import closing
from pathlib import Path

import numpy as np

from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io._geojson import GEOJSON, geometries
from elusive.io._table_lines import TableLine, table_lines
from elusive.io.sources.lines import lines_of
from elusive.sensors.bearing_sets import SensorSites

PLACES, GEOGRAPHIC = ("x_m", "y_m"), ("lon_deg", "lat_deg")  # of a sensor, in its line
Place = tuple[float, float, float]


class Placing:
    """Places of lines in local metres: as they are, or of longitudes and latitudes about the first one."""

    def __init__(self, frame: LocalFrame | None) -> None:
        self.frame = frame

    def of(self, line: TableLine) -> Place | None:
        """Return the place that a line tells, if it does."""
        if GEOGRAPHIC[0] in line.cells and GEOGRAPHIC[1] in line.cells:
            lon, lat = (line.number(name, most=most) for name, most in zip(GEOGRAPHIC, (360, 90), strict=True))
            self.frame = self.frame or LocalFrame.at(lon, lat)
            x, y = self.frame.to_local(np.array([[lon, lat]]))[0].tolist()
        elif PLACES[0] in line.cells and PLACES[1] in line.cells:
            x, y = (line.number(name) for name in PLACES)
        else:
            return None
        return x, y, line.number("z_m", absent=0.0)


def read_sensors(path: str | os.PathLike[str]) -> SensorSites:
    """Read where sensors stand.

    Parameters
    ----------
    path
        CSV, its first line ``sensor,x_m,y_m`` and perhaps ``z_m``, a sensor a line [m east, north, up]; or
        ``sensor,lon_deg,lat_deg``, which become metres about the first sensor; or GeoJSON of Points, each named by the
        property ``sensor`` or ``name``, or its ``id``, its third coordinate the height, where there is one.

    Raises
    ------
    DataError
        If the file cannot be read, a line is no place, a name comes twice, or there is none; the sentence says where.
    """
    needed, placed = ("sensor", *GEOGRAPHIC), Placing(None)
    if Path(path).suffix.lower() in GEOJSON:
        rows: Iterable[TableLine] = _points(Path(path))
    else:
        with closing(lines_of(str(path))) as lines:
            header = next((line for _, line in lines if not line.startswith("#")), "")
        needed = ("sensor", *(GEOGRAPHIC if GEOGRAPHIC[0] in header else PLACES))
        rows = table_lines(path, needed, ("z_m",), "one sensor a line")
    places = dict[str, Place]()
    for line in rows:
        name = line.cells["sensor"]
        if not name or name in places:
            raise DataError(f"{line.where}: the sensor's name {name!r:.60} is empty or taken; give another.")
        if (place := placed.of(line)) is not None:
            places[name] = place
    if not places:
        raise DataError(f"{path}: holds no sensor; write {','.join(needed)}, one sensor a line.")
    return SensorSites(tuple(places), np.array(list(places.values())), placed.frame)


def _points(path: Path) -> Iterator[TableLine]:
    """Yield the Points of a GeoJSON file as the lines of a table."""
    for number, (place, told) in enumerate(geometries(path, "Point", "a table of sensor,lon_deg,lat_deg"), start=1):
        name = next((told[key] for key in ("sensor", "name", "id") if told.get(key) is not None), "")
        cells = dict(zip((*GEOGRAPHIC, "z_m"), map(str, place), strict=False))
        if len(cells) < 2:
            raise DataError(f"{path}, Point {number}: has no longitude and latitude; write [longitude, latitude].")
        yield TableLine(f"{path}, Point {number}", {"sensor": str(name), **cells})
