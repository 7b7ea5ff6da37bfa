"""How precise bearings are, where nobody tells: by the evidence of the path, unless something else is wrong."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

from elusive.errors import DataError
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.causes import cause_of
from elusive.systems.bearings.choices import Estimation
from elusive.systems.bearings.faults import LEAST_TIMES, fault_of
from elusive.systems.bearings.fit import fit_bearings
from elusive.systems.bearings.fitting import tracked
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import powers_found


def deviation_found(parameters: BearingTracking, sites: SensorSites, heard: Sequence[PlaceSet]) -> BearingTracking:
    """Return the parameters with the deviation of one emitter's bearings, where it is not given.

    Bearings that leave their path since another convention, a second emitter or a sensor's error explains them tell no
    deviation, nor do those of a single sensor or with times of arrival. The usual one is taken then, and what is wrong
    is found beside it.

    Parameters
    ----------
    parameters
        Of how the emitter is tracked.
    sites
        Where the sensors stand.
    heard
        What is heard of it, in the order of time.
    """
    if parameters.sigma_deg is not None:
        return parameters
    usual = parameters.replace(sigma_deg=parameters.deviation_deg)
    biased = isinstance(parameters.filter, Estimation) and parameters.filter.bias is not None
    if biased or len(heard) < LEAST_TIMES or not all(isinstance(one, BearingSet) for one in heard):
        return usual
    moving = powers_found(usual, sites, [heard])
    steps, scale = tracked(heard, moving, sites)
    if scale is None:
        return usual
    if scale.wide and cause_of(steps, moving, sites, scale).deviation_deg is None:
        return usual
    if not scale.wide and scale.persists and fault_of([steps], moving, sites) is not None:
        return usual
    with contextlib.suppress(DataError):  # one sensor alone
        return parameters.replace(sigma_deg=fit_bearings(heard, sites).tree["sigma_deg"])
    return usual
