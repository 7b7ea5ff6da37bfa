"""By how much sensors err more or less than each other, from emitters' own bearings.

Residuals of each sensor beside the paths in the median, in the deviations that the paths leave them, R - H P H' (Huber
and Ronchetti, 2009, Robust statistics, section 7.2). Paths are estimated anew with what is found: a sensor that is
taken for more precise than it is draws them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.fitting import left_beside
from elusive.systems.bearings.found_norths import LEAST_SENSORS
from elusive.systems.bearings.heard import sensors_of
from elusive.systems.bearings.leftovers import HALF
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import LEAST_TIMES

ROUNDS, LEAST_LEFT = 4, 30  # in which they are sought; independent residuals of a sensor that tell its deviation
CLEARLY, ALIKE = 4.0, 1.3  # errors of a deviation by chance, and times of it, within which sensors are alike
MOST, SAID = 10.0, 2.0  # times a deviation; times that of most, from which it is said


def with_sensor_times(
    parameters: BearingTracking, sites: SensorSites, alone: Sequence[Sequence[PlaceSet]]
) -> BearingTracking:
    """Return the parameters with how precise each sensor is, where they are not alike.

    Two sensors' lines cross whatever either errs by, and tell nothing.

    Parameters
    ----------
    parameters
        Of how emitters are tracked.
    sites
        Where the sensors stand.
    alone
        The bearings of each emitter, with norths as they were found to be.
    """
    parts, n = [part for part in alone if len(part) >= LEAST_TIMES], len(sites.names)
    heard = {number for part in parts for one in part for number in sensors_of(one).tolist()}
    if parameters.sensor_times is not None or len(heard) < LEAST_SENSORS:
        return parameters
    found, times = parameters, np.ones(n)
    for count in range(ROUNDS):
        left = [left_beside(part, found, sites)[1] for part in parts]
        sensor = np.concatenate([np.empty(0, np.intp), *(one.sensor for one in left)])
        size = np.abs(np.concatenate([np.empty(0), *(one.deviations for one in left)]))
        number = np.bincount(sensor, np.concatenate([np.empty(0), *(one.free for one in left)]), n)
        half = np.array([np.median(size[sensor == k]) / HALF if number[k] >= LEAST_LEFT else 1.0 for k in range(n)])
        by_chance = np.maximum(CLEARLY * 1.17 / np.sqrt(2 * np.maximum(number, 1.0)), math.log(ALIKE))
        if not count and not (np.abs(np.log(half)) > by_chance).any():
            return parameters
        times = np.clip(times * half, 1 / MOST, MOST)
        found = parameters.replace(sensor_times=tuple(float(f"{one:.3g}") for one in times))
    return found


def uneven_finding(parameters: BearingTracking, sites: SensorSites, said: str = "") -> Finding:
    """Say which sensor is far less precise than most, and is weighed so."""
    times = np.array(parameters.sensor_times or (1.0,))
    ratio = float(times.max() / np.median(times))
    return Finding(
        "bearings.uneven", ratio < SAID, 1.0, ratio,
        f"{said}Bearings of sensor {sites.names[int(times.argmax())]} err by {ratio:.2g} times as much as those of "
        "most sensors in the median, and are weighed so: it is less precise, or its north, place or clock is wrong.",
        "Look at that sensor.", grave=False,
    )  # fmt: skip
