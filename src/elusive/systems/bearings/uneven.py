"""By how much sensors err more or less than each other, from several emitters' own bearings.

Residuals of each sensor beside the paths in the median, in the deviations that the paths leave them, R - H P H' (Huber
and Ronchetti, 2009, Robust statistics, section 7.2). Paths are estimated anew with what is found: a sensor that is
taken for more precise than it is draws them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.errors import ElusiveError
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.sensors.bearings import BearingSensors, wrapped
from elusive.systems.bearings.choices import SeveralEmitters
from elusive.systems.bearings.found_norths import LEAST_SENSORS
from elusive.systems.bearings.heard import bearings_of, sensors_of, starts_of
from elusive.systems.bearings.leftovers import HALF, LEAST_FREE
from elusive.systems.bearings.own import direction_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import LEAST_TIMES, whole

ROUNDS, LEAST_LEFT = 4, 30  # in which they are sought; residuals of a sensor that tell its deviation
CLEARLY, ALIKE = 4.0, 1.3  # errors of a deviation by chance, and times of it, within which sensors are alike
MOST = 10.0  # times a deviation


def with_sensor_times(
    parameters: BearingTracking, sites: SensorSites, alone: Sequence[Sequence[PlaceSet]]
) -> BearingTracking:
    """Return the parameters of several emitters with how precise each sensor is, where they are not alike.

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
    emitters, parts = parameters.emitters, [part for part in alone if len(part) >= LEAST_TIMES]
    assert isinstance(emitters, SeveralEmitters)
    heard = {number for part in parts for one in part for number in sensors_of(one).tolist()}
    if emitters.sensor_times is not None or len(heard) < LEAST_SENSORS:
        return parameters
    times = np.ones(len(sites.names))
    for count in range(ROUNDS):
        half, number = _halves(parameters, times, sites, parts)
        by_chance = np.maximum(CLEARLY * 1.17 / np.sqrt(2 * np.maximum(number, 1.0)), math.log(ALIKE))
        if not count and not (np.abs(np.log(half)) > by_chance).any():
            return parameters
        times = np.clip(times * half, 1 / MOST, MOST)
    found = tuple(float(f"{one:.3g}") for one in times)
    return parameters.replace(emitters=emitters.replace(sensor_times=found))


def _halves(
    parameters: BearingTracking, times: Array, sites: SensorSites, parts: Sequence[Sequence[PlaceSet]]
) -> tuple[Array, Array]:
    """Return each sensor's residuals in the median, to what is expected, and how many there are, ``(n,)`` each."""
    sigmas_deg, n = parameters.deviation_deg * times, len(times)
    smoother = whole(parameters).bind(sites, type(parts[0][0]), elevations=False)
    assert isinstance(smoother, MapSmoother)
    assert isinstance(smoother.sensor, BearingSensors)
    smoother = smoother.replace(sensor=smoother.sensor.replace(sensor_sigma_deg=tuple(sigmas_deg.tolist())))
    sensors, sizes = [np.empty(0, np.intp)], [np.empty(0)]
    for part in parts:
        try:
            path, angles = smoother.smooth(part), bearings_of(part)
        except ElusiveError:
            continue
        rows = np.repeat(np.arange(len(part)), angles.counts)
        off = path.states[rows][:, [X, Y]] - starts_of(part, sites)
        direction, spread = direction_of(off, path.covariances[rows][:, [[X], [Y]], [[X, Y]]])
        variance = np.deg2rad(sigmas_deg)[angles.sensor] ** 2
        free = 1 - spread / variance
        size = np.abs(wrapped(angles.azimuth_rad - direction)) / np.sqrt(variance * np.maximum(free, LEAST_FREE))
        sensors.append(angles.sensor[free > LEAST_FREE])
        sizes.append(size[free > LEAST_FREE])
    sensor, size = np.concatenate(sensors), np.concatenate(sizes)
    number = np.bincount(sensor, minlength=n).astype(np.float64)
    half = [np.median(size[sensor == k]) / HALF if number[k] >= LEAST_LEFT else 1.0 for k in range(n)]
    return np.array(half), number
