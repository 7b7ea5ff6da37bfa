"""Other ways in which angles may be meant: other conventions, and sensors under each other's names."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.sensor_errors import Heard, SensorError

FEWEST, MOST = 3, 5  # sensors of which two may be exchanged


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


def reread(heard: Sequence[BearingSet], convention: Convention) -> list[BearingSet]:
    """Return bearings as another convention has them."""
    return [times._replace(azimuth_rad=convention.meant(times.azimuth_rad)) for times in heard]


def perhaps_radians(heard: Sequence[object]) -> bool:
    """Say whether no azimuth, of two sensors or more, is beyond a turn of radians."""
    every = [times for times in heard if isinstance(times, BearingSet) and len(times.sensor)]
    if len({number for times in every for number in times.sensor.tolist()}) < 2:
        return False
    return (
        float(np.rad2deg(np.abs(wrapped(np.concatenate([times.azimuth_rad for times in every])))).max()) <= 2 * math.pi
    )


def readings(heard: Sequence[BearingSet], sites: SensorSites, used: Sequence[int]) -> list[SensorError]:
    """Other ways to read bearings: all of them, or two sensors under each other's names."""
    found = []
    for convention in CONVENTIONS:
        if convention is not RADIANS:
            found.append(_reading("azimuths", convention, partial(reread, convention=convention)))
        elif perhaps_radians(heard):
            # a number that is a radian is 57 times as far from the next one
            read = _reading("azimuths", RADIANS, partial(reread, convention=RADIANS))
            found.append(read._replace(likelier=math.log(180 / math.pi)))
    if any(np.isfinite(times.elevation_rad).any() for times in heard):
        found += [_reading("elevations", convention, partial(_upwards, convention)) for convention in ELEVATIONS]
    if FEWEST <= len(used) <= MOST and all(times.places_m is None for times in heard):
        found += [_exchanged(sites, *pair) for pair in combinations(used, 2)]
    return found


def _reading(what: str, convention: Convention, meant: Callable[[Heard], Heard]) -> SensorError:
    said = f"the {what} are read {convention.name}", convention.remedy
    return SensorError((), "reading", lambda sizes: said, lambda heard, sites, sizes: (meant(heard), sites))


def _upwards(convention: Convention, heard: Heard) -> Heard:
    return [times._replace(elevation_rad=convention.meant(times.elevation_rad)) for times in heard]


def _exchanged(sites: SensorSites, one: int, other: int) -> SensorError:
    names = f"sensors {sites.names[one]} and {sites.names[other]}"
    rows = np.arange(len(sites.names))
    rows[[one, other]] = other, one
    said = f"{names} are exchanged", f"Exchange the names of {names}, or their places."
    return SensorError(
        (),
        "reading",
        lambda sizes: said,
        lambda heard, sites, sizes: ([times._replace(sensor=rows[times.sensor]) for times in heard], sites),
    )
