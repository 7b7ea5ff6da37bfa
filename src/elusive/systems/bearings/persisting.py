"""By how much errors that persist make places of several emitters less sure than independent bearings would.

An error of a sensor that wanders and is forgotten: Gelb (1974), section 3.8. A tracker of several takes each bearing as
new; how large such errors are, and for how long they last, is found by the evidence of each emitter's own bearings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.filters.gaussian.map_smoother import SmoothedPath
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import BatchMap, SeveralEmitters
from elusive.systems.bearings.faults import LEAST_TIMES
from elusive.systems.bearings.fit import fit_bearings
from elusive.systems.bearings.fitting import tracked
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import whole, whole_path
from elusive.tracking.track import Step

BY_CHANCE = 3.0  # deviations of a correlation that is none
MOST_EMITTERS = 3  # that tell, those that are heard for longest
MUCH = 1.5  # times a deviation of place, beyond which it is said


def with_persisting(
    parameters: BearingTracking, told_deg: float | None, sites: SensorSites, alone: Sequence[Sequence[PlaceSet]]
) -> BearingTracking:
    """Return the parameters of several emitters with how many times less sure places are, where that is not given.

    Parameters
    ----------
    parameters
        Of how emitters are tracked.
    told_deg
        Deviation of a bearing; None: what lasts of it is found as well.
    sites
        Where the sensors stand.
    alone
        The bearings of each emitter, with norths as they were found to be.
    """
    emitters = parameters.emitters
    assert isinstance(emitters, SeveralEmitters)
    if emitters.persisting is not None:
        return parameters
    long, times = sorted((part for part in alone if len(part) >= LEAST_TIMES), key=len)[-MOST_EMITTERS:], 1.0
    scales = [scale for part in long if (scale := tracked(part, parameters, sites)[1]) is not None]
    number = sum(scale.number for scale in scales)
    if sum(scale.number * scale.correlation for scale in scales) > BY_CHANCE * math.sqrt(number):
        times = max(float(np.mean([_times(parameters, told_deg, sites, part) for part in long])), 1.0)
    return parameters.replace(emitters=emitters.replace(persisting=float(f"{times:.3g}")))


def persists(parameters: BearingTracking) -> float:
    """Return how many times less sure places of several emitters are, as far as that is known."""
    emitters = parameters.emitters
    return (emitters.persisting or 1.0) if isinstance(emitters, SeveralEmitters) else 1.0


def less_sure(step: Step, parameters: BearingTracking) -> Step:
    """Return a step whose tracks are as unsure as errors that persist leave them."""
    times = persists(parameters)
    if times == 1.0:
        return step
    return step._replace(tracks=tuple(one._replace(covariance=times**2 * one.covariance) for one in step.tracks))


def persisting_finding(parameters: BearingTracking) -> Finding:
    """Say that errors persist, where that makes places far less sure."""
    times = persists(parameters)
    return Finding(
        "bearings.independent", times <= MUCH, 1.0, times,
        f"Errors of bearings persist from one time to the next: places are {times:.2g} times less sure than as many "
        "independent bearings would make them, and the ellipses are as much larger.",
        "Look for what wanders: headings, reflections near a sensor, the direction in which it errs.", grave=False,
    )  # fmt: skip


def _times(parameters: BearingTracking, told_deg: float | None, sites: SensorSites, part: Sequence[PlaceSet]) -> float:
    """Return the same by one emitter's bearings: its path with errors that persist, beside that without."""
    try:
        tree = fit_bearings(part, sites, BearingTracking(sigma_deg=told_deg, sensor_times=parameters.sensor_times)).tree
    except DataError:
        return 1.0
    bias = tree.get("filter", {}).get("bias")
    if bias is not None and "memory_s" not in bias:  # norths, by which places are wider already
        return 1.0
    motion, sigma_deg = {"kind": "cv"} | tree["motion"], tree.get("sigma_deg", parameters.deviation_deg)
    found = parameters.replace(sigma_deg=sigma_deg, motion=motion, filter=BatchMap(bias=bias))
    ways = [whole_path(whole(asked), part, sites) for asked in (parameters, found)]
    if any(path is None for path in ways):
        return 1.0
    plain, wandering = (_spread(path) for path in ways if path is not None)
    return float(np.sqrt(np.median(wandering / plain)))


def _spread(path: SmoothedPath) -> Array:
    """Variances of places, ``(K,)``."""
    return path.covariances[:, X, X] + path.covariances[:, Y, Y]
