"""How precise bearings are and what persists of their errors, where nobody tells, unless something else is wrong."""

from __future__ import annotations

import math
from collections.abc import Sequence

from elusive.errors import DataError
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.causes import ALONE, of_several
from elusive.systems.bearings.choices import Estimation, GraphFilter, OneEmitter
from elusive.systems.bearings.faults import LEAST_TIMES, fault_of
from elusive.systems.bearings.fit import fit_bearings
from elusive.systems.bearings.fitting import tracked
from elusive.systems.bearings.leftovers import FEW
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import NORTHS, powers_found
from elusive.systems.bearings.readings import perhaps_radians
from elusive.systems.bearings.uneven import with_sensor_times

NORTHS_DEG = 10.0  # of what persists, beyond which azimuths rather mean something else


def errors_found(parameters: BearingTracking, sites: SensorSites, heard: Sequence[PlaceSet]) -> BearingTracking:
    """Return the parameters with the deviation and the bias of one emitter's bearings, where they are not given.

    Bearings that leave their path since another convention or a second emitter explains them tell neither, nor do
    those of a single sensor or with times of arrival. The usual deviation and no bias are taken then, and what is
    wrong is found beside them.

    Parameters
    ----------
    parameters
        Of how the emitter is tracked.
    sites
        Where the sensors stand.
    heard
        What is heard of it, in the order of time.
    """
    usual = parameters.replace(sigma_deg=parameters.deviation_deg)
    told = isinstance(parameters.filter, GraphFilter) or parameters.filter.bias is not None
    if told and parameters.sigma_deg is not None:
        return parameters
    if len(heard) < LEAST_TIMES or not all(isinstance(one, BearingSet) for one in heard):
        return usual
    moving = powers_found(usual, sites, [heard])
    steps, scale = tracked(heard, moving, sites)
    if scale is None:
        return usual
    if scale.wide or perhaps_radians(heard):
        fault = fault_of([steps], moving, sites, roughly=True)
        if fault is not None:
            # as they are meant they tell how precise they are
            heard, sites = fault.perhaps[0].error.without(
                [one for one in heard if isinstance(one, BearingSet)], sites, ()
            )
    try:
        fit = fit_bearings(heard, sites, parameters)
    except DataError:  # one sensor alone
        return usual
    tree = fit.tree
    found = usual.replace(sigma_deg=tree.get("sigma_deg", usual.sigma_deg))
    bias = tree.get("filter", {}).get("bias")
    if bias is not None and isinstance(found.filter, Estimation):
        # one deviation greater: three lines or two hardly tell how far norths are off
        (error,) = (one.deviation for one in fit.values if one.option == "--bias-sd-deg")
        greater = min(error / bias["sd_deg"], NORTHS) if math.isfinite(error) else 0.0
        bias = bias | {"sd_deg": float(f"{math.exp(greater) * bias['sd_deg']:.3g}")}
        found = found.replace(filter=found.filter.replace(bias=bias))
        if bias["sd_deg"] > NORTHS_DEG:
            return usual
    asked = found.replace(motion={"kind": "cv"} | tree["motion"], emitters=OneEmitter())
    asked = asked if parameters.sigma_deg else with_sensor_times(asked, sites, [heard])
    scale = tracked(heard, asked, sites)[1]
    if scale is None or scale.wide or scale.number < FEW:
        return usual
    found = found.replace(sensor_times=asked.sensor_times)
    scatter = found.deviation_deg > ALONE * usual.deviation_deg
    return usual if scatter and of_several(steps, found.deviation_deg, moving, sites) else found
