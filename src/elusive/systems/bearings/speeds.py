"""How fast several emitters are, from their own bearings: a new one's velocity is drawn as wide as that.

Where none is as fast as an emitter drawn at random, its particles hardly reach a faster one's velocity: the track lags,
breaks and begins anew.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elusive.contracts import VX, VY
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import SeveralEmitters
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import LEAST_TIMES, whole, whole_path

FASTER = 0.75  # share of the times at which an emitter is slower than what is taken for the median: rather too wide
MEDIAN = 1.17741  # of a speed, in the deviation of a velocity on each axis (Rayleigh)


def with_speeds(
    parameters: BearingTracking, given: SeveralEmitters, sites: SensorSites, alone: Sequence[Sequence[PlaceSet]]
) -> BearingTracking:
    """Return the parameters with the deviation of new emitters' velocities, unless it is given; at least the usual.

    Parameters
    ----------
    parameters
        Of how emitters are tracked.
    given
        What is told of them.
    sites
        Where the sensors stand.
    alone
        The bearings of each emitter, with norths as they were found to be.
    """
    emitters = parameters.emitters
    assert isinstance(emitters, SeveralEmitters)
    if given.speed_sd_mps is not None:
        return parameters
    paths = [whole_path(whole(parameters), part, sites) for part in alone if len(part) >= LEAST_TIMES]
    speeds = [np.hypot(*path.states[:, [VX, VY]].T) for path in paths if path is not None]
    if not speeds:
        return parameters
    found = float(np.quantile(np.concatenate(speeds), FASTER)) / MEDIAN
    speed_sd_mps = max(float(f"{found:.3g}"), emitters.usual_speed_mps)
    return parameters.replace(emitters=emitters.replace(speed_sd_mps=speed_sd_mps))


def drawn_speed(parameters: BearingTracking) -> float:
    """Return the deviation of a new emitter's velocity, on each axis, as far as it is known [m/s]."""
    emitters = parameters.emitters
    assert isinstance(emitters, SeveralEmitters)
    return emitters.speed_sd_mps or emitters.usual_speed_mps
