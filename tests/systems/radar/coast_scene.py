"""Ships before a real coast whose buildings and rocks, fixed and up to 60 m inland, echo in most scans."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely
from numpy.random import Generator

from elusive.charts.charted_area import ChartedArea, ChartedAreaParameters, lay_charts, read_charts
from elusive.charts.quality import Imprecision
from elusive.contracts import Array
from elusive.geometry.local_frame import LocalFrame
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from tests.charts.scenes import cell_path

RADAR = {"radar_lon_deg": -76.44, "radar_lat_deg": 38.97}  # on the water before Annapolis
FRAME = LocalFrame.at(-76.44, 38.97)
INLAND_M = (1.0, 60.0)
OFF_M = (100.0, 500.0)  # of ships from the shore


class CoastScene(NamedTuple):
    """What a radar saw, and what there was."""

    scans: list[RadarScan]
    ships: Array  # (scans, ships, 4)
    echoes: Array  # (echoes, 4)


def area_of(cell: str = "US4MD81M", sigma_m: float = 10.0) -> ChartedArea:
    """The coarse chart by default, its coast taken to be right to 10 m."""
    parameters = ChartedAreaParameters(imprecision=Imprecision(coast_sigma_m=sigma_m))
    return lay_charts(read_charts(cell_path(cell)), parameters, FRAME)


def land_of(area: ChartedArea, reach_m: float) -> shapely.Geometry:
    rings = area.coast.land
    lines = [rings.vertices[a:b] for a, b in zip(rings.starts[:-1], rings.starts[1:], strict=True)]
    land = shapely.build_area(shapely.MultiLineString(lines))
    return shapely.intersection(land, shapely.Point(0, 0).buffer(2 * reach_m))


def coast_scene(
    sensor: RadarSensor, land: shapely.Geometry, rng: Generator, *, echoes: int = 120, ships: int = 2,
    scans: int = 60, interval_s: float = 2.5, speed_mps: float = 6.0,
) -> CoastScene:  # fmt: skip
    """Echoes 1 to 60 m inland of a coast, and ships that sail straight before it."""
    reach = 0.9 * float(sensor.max_range_m)
    shapely.prepare(land)
    shore = land.boundary.intersection(shapely.Point(0, 0).buffer(reach))
    fixed = []
    while len(fixed) < echoes:
        inland = rng.uniform(*INLAND_M)
        at = shore.interpolate(rng.uniform(0, shore.length))
        angle = rng.uniform(0, 2 * np.pi)
        place = shapely.Point(at.x + inland * np.sin(angle), at.y + inland * np.cos(angle))
        if land.contains(place) and place.distance(land.boundary) > 0.95 * inland:
            fixed.append([place.x, 0.0, place.y, 0.0])
    sailing: list[Array] = []
    while len(sailing) < ships:
        far, bearing, course = reach * np.sqrt(rng.random()), *rng.uniform(0, 2 * np.pi, 2)
        start = far * np.array([np.sin(bearing), np.cos(bearing)])
        velocity = speed_mps * np.array([np.sin(course), np.cos(course)])
        way = start + interval_s * np.arange(scans)[:, None] * velocity
        off = shapely.distance(land, shapely.points(way[::5]))
        if (
            (np.hypot(*way.T) < reach).all()
            and OFF_M[0] < off.min() < OFF_M[1]
            and not land.contains_properly(shapely.points(way[::5])).any()
        ):
            sailing.append(
                np.column_stack([way[:, 0], np.full(scans, velocity[0]), way[:, 1], np.full(scans, velocity[1])])
            )
    there = np.array(sailing).reshape(ships, scans, 4).transpose(1, 0, 2)
    seen = [
        sensor.simulate(np.concatenate([there[k], np.array(fixed).reshape(-1, 4)]), rng, k * interval_s)
        for k in range(scans)
    ]
    return CoastScene(seen, there, np.array(fixed).reshape(-1, 4))
