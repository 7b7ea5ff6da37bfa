"""The shoreline of Bootsveld (2012), chapter 6: a real one from a file, or a seeded synthetic delta.

The thesis takes the cell US5LA26M, Port Fourchon and approaches, which is not to be had any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from elusive.charts.delta import HEIGHT_M, WIDTH_M, synthetic_delta
from elusive.errors import DataError

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

PORT_FOURCHON = (-90.2, 29.13)  # longitude and latitude of the map's middle [degrees]


@cache
def shoreline(path: Path | None, seed: int) -> Sequence[BaseGeometry]:
    """Return the land of the map as polygons in metres about the map's middle; None draws the synthetic delta.

    A file of land polygons is cut to 10 by 9 km: round Port Fourchon if it reaches there, else round its middle.

    Raises
    ------
    DataError
        If the file cannot be read, or shows no land there.
    """
    import shapely

    from elusive.charts.chart import as_geometries, polygons_of

    window = shapely.box(-WIDTH_M / 2, -HEIGHT_M / 2, WIDTH_M / 2, HEIGHT_M / 2)
    if path is None:
        return polygons_of(synthetic_delta(seed))
    from elusive.charts.outlines import read_outline
    from elusive.geometry.local_frame import LocalFrame

    chart = read_outline(path)
    west, south, east, north = chart.extent_deg
    at_port = west < PORT_FOURCHON[0] < east and south < PORT_FOURCHON[1] < north
    frame = LocalFrame.at(*PORT_FOURCHON) if at_port else LocalFrame.about([chart])
    near = shapely.intersects(frame.unproject(as_geometries([window]))[0], chart.land)
    land = polygons_of(shapely.intersection(shapely.union_all(frame.project(chart.land[near])), window))
    if not land:
        raise DataError(f"{path}: shows no land near {frame.lat_deg:g}, {frame.lon_deg:g}; give another shoreline.")
    return land
