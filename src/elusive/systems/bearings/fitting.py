"""The most probable path of one emitter where something is tried: how likely it is, and how well bearings fit it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.contracts import X, Y
from elusive.errors import ElusiveError
from elusive.filters.gaussian.transitions import AngleBias
from elusive.metrics.consistency import squared_deviations
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.choices import Estimation, OneEmitter
from elusive.systems.bearings.emitter import whole_steps
from elusive.systems.bearings.leftovers import Leftovers, Scale, leftovers, scale_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.tracking.track import Step


def bias_of(parameters: BearingTracking) -> AngleBias | None:
    """Return the bias of each sensor that is estimated."""
    return parameters.filter.bias if isinstance(parameters.filter, Estimation) else None


def tried_with(parameters: BearingTracking, *, biased: bool = True) -> BearingTracking:
    """Return what one emitter's whole path is estimated with to try something; perhaps without a bias."""
    asked = parameters.replace(motion=parameters.plain_motion, emitters=OneEmitter()).by("map")
    return asked if biased or bias_of(asked) is None else asked.replace(filter=asked.filter.replace(bias=None))


def path_of(heard: Sequence[object], asked: BearingTracking, sites: SensorSites) -> list[Step] | None:
    """Track one emitter; None where that cannot be done."""
    try:
        steps = whole_steps(heard, asked, sites)  # type: ignore[arg-type]
    except ElusiveError:
        return None
    return steps if math.isfinite(evidence_of(steps)) and all(step.tracks for step in steps) else None


def evidence_of(steps: Sequence[Step]) -> float:
    """Log evidence of a path."""
    return float(steps[-1].state.log_evidence)


def apart_by(base: list[Step], other: list[Step]) -> float:
    """How far two paths lie apart, in deviations of the first."""
    ground = np.ix_([X, Y], [X, Y])
    there = {step.time_s: step.tracks[0].mean[[X, Y]] for step in other}
    both = [step for step in base if step.time_s in there]  # a clock that is set has times of its own
    off = np.array([step.tracks[0].mean[[X, Y]] - there[step.time_s] for step in both])
    spread = np.array([step.tracks[0].covariance[ground] for step in both])
    return math.sqrt(float(np.mean(squared_deviations(off, spread))) / 2)


def tracked(
    heard: Sequence[object], parameters: BearingTracking, sites: SensorSites
) -> tuple[list[Step], Scale | None]:
    """Return the path and the size of its residuals; nothing where there is none."""
    steps, left = left_beside(heard, parameters, sites)
    return steps, scale_of(left) if steps else None


def left_beside(
    heard: Sequence[object], parameters: BearingTracking, sites: SensorSites
) -> tuple[list[Step], Leftovers]:
    """Return the path and what bearings leave beside it; nothing where there is none."""
    asked = tried_with(parameters)
    assert isinstance(asked.filter, Estimation)
    try:
        steps = whole_steps(heard, asked, sites)  # type: ignore[arg-type]
    except ElusiveError:
        steps = []
    sensor = asked.sensor_of(sites, BearingSet, bool(steps) and "z" in steps[0].state.state_names)
    return steps, leftovers(steps, sensor, asked.filter)
