"""Other ways in which angles may be meant: other conventions, of all sensors or of one, and names exchanged."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.sensors.bearing_sets import BearingSet, SensorSites

FEWEST, MOST = 3, 5  # sensors of which one alone may be read otherwise


class Cause(NamedTuple):
    """What a finding says of its cause, and what to do."""

    sentence: str
    remedy: str
    deviation_deg: float | None = None  # that explains it, where nothing else does


class Convention(NamedTuple):
    """How azimuths may be meant, and what they then are clockwise from north [rad]."""

    name: str
    remedy: str
    meant: Callable[[Array], Array]


CONVENTIONS = (
    Convention(
        "anticlockwise from east, or with the sensors' x and y exchanged",
        "Convert the azimuths (90 - azimuth), or exchange the columns x_m and y_m.",
        lambda azimuth: math.pi / 2 - azimuth,
    ),
    Convention(
        "from the emitter to the sensor", "Turn the azimuths by 180 degrees.", lambda azimuth: azimuth + math.pi
    ),
    Convention(
        "anticlockwise from north, or with x towards the west",
        "Change the sign of the azimuths, or of x_m.",
        lambda azimuth: -azimuth,
    ),
    Convention("clockwise from east", "Add 90 degrees to the azimuths.", lambda azimuth: azimuth + math.pi / 2),
    Convention("in radians", "Convert the azimuths to degrees.", lambda azimuth: np.rad2deg(azimuth)),
)
RADIANS = CONVENTIONS[-1]
ELEVATIONS = (
    Convention("from the zenith", "Convert the elevations (90 - elevation).", lambda angle: math.pi / 2 - angle),
    Convention("below the horizon", "Change the sign of the elevations.", lambda angle: -angle),
    Convention("in radians", "Convert the elevations to degrees.", lambda angle: np.rad2deg(angle)),
)


def reread(heard: Sequence[object], convention: Convention, sensor: int | None = None) -> list[BearingSet]:
    """Return bearings as another convention has them, of one sensor or of all."""
    return [
        times._replace(
            azimuth_rad=np.where(
                (times.sensor == sensor) | (sensor is None), convention.meant(times.azimuth_rad), times.azimuth_rad
            )
        )
        for times in heard
        if isinstance(times, BearingSet)
    ]


def conventions(heard: Sequence[BearingSet]) -> Iterator[tuple[Cause, list[BearingSet]]]:
    """Other ways to read all bearings."""
    for convention in CONVENTIONS:
        yield Cause(f"the azimuths are read {convention.name}", convention.remedy), reread(heard, convention)
    if any(np.isfinite(times.elevation_rad).any() for times in heard):
        for convention in ELEVATIONS:
            other = [times._replace(elevation_rad=convention.meant(times.elevation_rad)) for times in heard]
            yield Cause(f"the elevations are read {convention.name}", convention.remedy), other


def readings(heard: Sequence[BearingSet], sites: SensorSites) -> Iterator[tuple[Cause, list[BearingSet]]]:
    """Other ways to read bearings: all of them, those of one sensor, or two sensors under each other's names."""
    yield from conventions(heard)
    used = np.unique(np.concatenate([times.sensor for times in heard])).tolist()
    if not FEWEST <= len(used) <= MOST or any(times.places_m is not None for times in heard):
        return
    for number in used:
        for convention in CONVENTIONS:
            which = f"the azimuths of sensor {sites.names[number]} alone are read {convention.name}"
            yield Cause(which, convention.remedy), reread(heard, convention, number)
    for one, other in combinations(used, 2):
        names = f"sensors {sites.names[one]} and {sites.names[other]}"
        rows = np.arange(len(sites.names))
        rows[[one, other]] = other, one
        exchanged = [times._replace(sensor=rows[times.sensor]) for times in heard]
        yield Cause(f"{names} are exchanged", f"Exchange the names of {names}, or their places."), exchanged
