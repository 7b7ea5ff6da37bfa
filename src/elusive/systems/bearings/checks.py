"""Whether bearings are what the parameters say of them: residuals, geometry and descent of each emitter's track."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.contracts import X, Y
from elusive.report.clock import moment
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.causes import cause_of
from elusive.systems.bearings.choices import FLAT, BatchMap, Estimation, GraphFilter
from elusive.systems.bearings.faults import MOVED, Fault, fault_finding, fault_of
from elusive.systems.bearings.freer import motion_finding
from elusive.systems.bearings.geometry import geometry_findings, upper
from elusive.systems.bearings.given import (
    beneath_finding,
    clock_finding,
    repeated_finding,
    times_finding,
    units_finding,
)
from elusive.systems.bearings.heard import sensors_of
from elusive.systems.bearings.leftovers import FAR, FEW, Leftovers, Scale, least_precise, leftovers, scale_of
from elusive.systems.bearings.norths import norths_finding
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.receiver import receiver_finding
from elusive.systems.bearings.uneven import uneven_finding
from elusive.tracking.track import Step

NARROW = 0.7  # residuals in the median, to those expected, beyond their own error
COVERED = 0.7  # of a deviation, within which it covers errors that persist: from the one such recording, a drone's
NOW_AND_THEN, SELDOM = 3, 0.02  # manoeuvres beyond the motion that are none too many, and their share of the times


class Judged(NamedTuple):
    """What was checked of a track, and what was found to be wrong with a sensor, if the path lies off for it."""

    findings: tuple[Finding, ...]
    fault: Fault | None


def track_findings(
    steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, who: str = ""
) -> tuple[Finding, ...]:
    """Check one emitter's track; see :func:`judged`."""
    return judged(steps, parameters, sites, who).findings


def judged(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, who: str = "") -> Judged:
    """Check one emitter's track.

    Parameters
    ----------
    steps
        Of one emitter, one of each time; their states are of :class:`~elusive.systems.bearings.track.Emitter`.
    parameters, sites
        What it was tracked with.
    who
        What to call it, where there are several.
    """
    known = [step for step in steps if step.tracks and step.state.started]
    said = f"{who}: " if who else ""
    heard = [step.measurement for step in steps]
    found = [units_finding(sites), times_finding(heard, said)]
    found.append(repeated_finding(heard, sites, parameters.deviation_deg, said))
    if not known or isinstance(parameters.filter, GraphFilter):  # whose ellipses are said to be too small
        return Judged(tuple(found), None)
    flt = parameters.filter
    solid = "z" in known[0].state.state_names
    sensor = parameters.sensor_of(sites, type(known[0].measurement), solid)
    left = leftovers(known, sensor, flt if isinstance(flt, Estimation) else None)
    scale = scale_of(left)
    residuals, fault = _residuals(scale, known, parameters, sites, said)
    found += [*residuals, _uneven(left, parameters, sites, said)]
    found += [beneath_finding(known, sites, said)] if solid else []
    found.append(clock_finding(known, parameters, sites, said))
    receiver = receiver_finding(known, parameters, sites, said)
    found += [] if receiver is None else [receiver]
    found += estimate_findings(known, parameters, sites, said)
    return Judged(tuple(found), fault if fault is not None and fault.moved > MOVED else None)


def estimate_findings(
    steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, said: str = ""
) -> list[Finding]:
    """Check what a filter made of bearings, whatever is right or wrong with these; arguments as of :func:`judged`."""
    known = [step for step in steps if step.tracks and step.state.started]
    if not known:
        return []
    solid = "z" in known[0].state.state_names
    found = [_convergence(known, parameters, said), _manoeuvres(known, said), _alone(known, parameters, solid, said)]
    places = np.array([step.tracks[0].mean[[X, Y]] for step in known])
    spread = np.array([step.tracks[0].covariance[np.ix_([X, Y], [X, Y])] for step in known])
    return found + geometry_findings(places, spread, [step.measurement for step in known], parameters, sites, said)


def _manoeuvres(steps: Sequence[Step], said: str) -> Finding:
    """Say where the place was sought anew again and again, as after manoeuvres that the motion does not allow."""
    anew = [step.state.reopened for step in steps]
    begun = [step.time_s for step, now, before in zip(steps, anew, [False, *anew], strict=False) if now and not before]
    first = begun[0] if begun else math.nan
    return Finding(
        "bearings.manoeuvres", len(begun) <= max(NOW_AND_THEN, SELDOM * len(steps)), 0.0, float(len(begun)),
        f"{upper(said + 'bearings')} left what was expected at {moment(first)}, {len(begun)} times in all, as after a "
        "manoeuvre beyond what the motion allows; the place was sought anew with all that an emitter may have done.",
        "Tell a greater --q; elusive fit bearings finds it.", grave=False,
    )  # fmt: skip


def _alone(steps: Sequence[Step], parameters: BearingTracking, solid: bool, said: str) -> Finding:
    """Check that a single sensor's distance is not that of a guess."""
    used = set[int]().union(*(set(sensors_of(step.measurement).tolist()) for step in steps))
    flt = parameters.filter
    weighed = isinstance(flt, BatchMap) and flt.bias is None and not solid and parameters.motion.kind not in FLAT
    return Finding(
        "bearings.alone", len(used) > 1 or weighed, 2.0, float(len(used)),
        f"{upper(said + 'one sensor alone')} reports, which tells directions: {flt.kind} begins at a guess of the "
        "distance and may end on the sensor.",
        "Take --filter map --motion cv, which weighs distances by their evidence, or add a sensor.",
    )  # fmt: skip


def _residuals(
    scale: Scale, steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, said: str
) -> tuple[list[Finding], Fault | None]:
    """Check the residuals' size and, where that is right, that they do not persist."""
    precise = _precision(parameters, type(steps[0].measurement))
    seen = (
        f"{said}residuals are {scale.half:.2g} times what {precise} allows in the median and {scale.most:.2g} times "
        f"at 95 %, and {100 * scale.far:.0f} % are further than {FAR:g} deviations from the track"
    )
    # where errors persist a deviation that looks too large may be what covers them
    persists = scale.persists and scale.lasting > COVERED
    if scale.wide:
        cause, fault = cause_of(steps, parameters, sites)
        wide = Finding("bearings.residuals", False, 1.0, scale.half, f"{upper(seen)}: {cause.sentence}.", cause.remedy)
        return [wide], fault
    error = 1.17 * NARROW * 2 / math.sqrt(max(scale.number, 1.0))
    narrow = scale.number >= FEW and scale.half < NARROW - error and not scale.persists
    found = [
        Finding(
            "bearings.residuals", not narrow, 1.0, scale.half,
            f"{upper(seen)}: the deviation told is too large, and so are the ellipses.",
            f"Tell the deviation that was measured: about {scale.half:.2g} of {precise}.", grave=False,
        )
    ]  # fmt: skip
    found.append(
        Finding(
            "bearings.independent", not persists, 0.0, scale.correlation,
            f"{upper(said + 'what a sensor leaves')} repeats from one time to the next (correlation "
            f"{scale.correlation:.2f}): its errors persist, or the emitter manoeuvres more than the motion allows. The "
            "ellipses count each reading as new, and cannot be trusted.",
            "Estimate a bias of each sensor, --bias-sd-deg with --bias-memory-s, or tell a greater deviation; "
            "elusive fit bearings finds both as far as the bearings tell them.",
        )
    )  # fmt: skip
    fault = fault_of([steps], parameters, sites)
    found += [fault_finding(fault, said), norths_finding(steps, parameters, sites, said)]
    if found[-2].holds and not persists:
        found.append(motion_finding(steps, parameters, sites, said))
    return found, fault


def _uneven(left: Leftovers, parameters: BearingTracking, sites: SensorSites, said: str) -> Finding:
    """Check that no sensor is far less precise than was told, which the others' residuals hide."""
    number, size = least_precise(left)
    if number < 0:
        return uneven_finding(parameters, sites, said)
    return Finding(
        "bearings.uneven", False, 1.0, size,
        f"{upper(said + 'what sensor')} {sites.names[number]} reports lies {size:.2g} times as far from the track as "
        "its deviation allows in the median: it is less precise than was told, or errs in another way, and draws the "
        "track with it.",
        f"Leave {sites.names[number]} out, or tell a deviation that holds for it.",
    )  # fmt: skip


def _convergence(steps: Sequence[Step], parameters: BearingTracking, said: str) -> Finding:
    converged = all(step.state.converged for step in steps)
    return Finding(
        "bearings.convergence", converged, 1.0, float(converged),
        f"{upper(said + 'the descent to the most probable path')} has not come to an end: there is no telling how far "
        "it is.",
        f"Give more --iterations, or another filter than {parameters.filter.kind}.",
    )  # fmt: skip


def _precision(parameters: BearingTracking, heard: type[object]) -> str:
    told = f"--sigma-deg {parameters.deviation_deg:g}"
    if heard is BearingSet:
        return told
    arrivals = f"--sigma-s {parameters.arrivals.sigma_s:g}"
    return arrivals if heard.__name__ == "ArrivalSet" else f"{told} and {arrivals}"
