"""A sensor whose azimuths are turned far, by one angle or by one that changes: the others' path shows it.

A heading that swings, or azimuths from a bow taken as from north, are too large an error to be found step by step from
nothing. Each sensor is left out in turn, its azimuths then as likely in any direction; by evidence (MacKay, 2003,
section 28.1) one of these stands out, and what the sensor left out has beside the path is how far it is turned.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.faults import GAIN
from elusive.systems.bearings.fitting import better, tracked
from elusive.systems.bearings.heard import part_of
from elusive.systems.bearings.leftovers import FEW, HALF, Scale
from elusive.systems.bearings.parameters import BearingTracking
from elusive.tracking.track import Step

FEWEST, MOST = 3, 8  # sensors
STEADY, SLOWLY = 2.0, 0.5  # deviations of azimuths that are turned alike, and correlation of those that change


def turned_sensor(
    heard: Sequence[BearingSet], parameters: BearingTracking, sites: SensorSites, whole: Scale
) -> tuple[str, str] | None:
    """Say how one sensor's azimuths are turned, and what to do; None: the others fit no better without it.

    Parameters
    ----------
    heard
        Bearings of one emitter.
    parameters, sites
        What it was tracked with.
    whole
        Of what all sensors together leave.
    """
    used = np.unique(np.concatenate([times.sensor for times in heard])).tolist()
    if not FEWEST <= len(used) <= MOST:
        return None
    found = list[tuple[float, int, list[Step]]]()
    for number in used:
        rows = [times.sensor != number for times in heard]
        others = [part_of(times, kept) for times, kept in zip(heard, rows, strict=True) if kept.any()]
        steps, scale = tracked(others, parameters, sites)
        if steps and scale is not None and better(scale, whole):
            left_out = sum(int((~kept).sum()) for kept in rows)  # each as likely in any direction
            evidence = float(steps[-1].state.log_evidence) - left_out * math.log(2 * math.pi)
            found.append((evidence, number, steps))
    found.sort(key=lambda one: one[0])
    if not found or (len(found) > 1 and not found[-1][0] - found[-2][0] > GAIN):
        return None
    _, number, steps = found[-1]
    name, off = sites.names[number], _turned_by(number, heard, steps, sites)
    mean = float(np.angle(np.exp(1j * off).mean()))
    rest = wrapped(off - mean)
    spread, sigma = float(np.median(np.abs(rest))) / HALF, math.radians(parameters.deviation_deg)
    degrees = math.degrees(abs(mean))
    if len(off) >= FEW and spread < STEADY * sigma:
        turned = f"the azimuths of sensor {name} are about {degrees:.3g} degrees too {'large' if mean > 0 else 'small'}"
        return (f"the others fit without it, and {turned}", f"Turn them by {-math.degrees(mean):.3g} degrees.")
    if len(off) < FEW or rest[1:] @ rest[:-1] < SLOWLY * (rest @ rest):
        return None
    low, high = np.rad2deg(np.quantile(rest, (0.05, 0.95)) + mean)
    return (
        f"the others fit without sensor {name}, whose azimuths are turned by {low:.0f} to {high:.0f} degrees, which "
        "change slowly: they are from a bow that turns, or its heading, its place or its clock is wrong",
        f"Add the heading of each time to the azimuths of {name}, or leave {name} out.",
    )


def _turned_by(number: int, heard: Sequence[BearingSet], steps: Sequence[Step], sites: SensorSites) -> Array:
    """Return how far a sensor's azimuths lie clockwise of the directions to a track [rad]."""
    places = {step.time_s: step.tracks[0].mean[[X, Y]] for step in steps}
    off = list[float]()
    for times in heard:
        its = times.sensor == number
        if not its.any() or times.time_s not in places:
            continue
        stands = sites.positions_m[times.sensor] if times.places_m is None else times.places_m
        east, north = (places[times.time_s] - stands[its, :2]).T
        off += wrapped(times.azimuth_rad[its] - np.arctan2(east, north)).tolist()
    return np.array(off)
