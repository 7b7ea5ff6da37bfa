"""Several emitters of a recording, tracked as if a sensor had not erred as all emitters' bearings together tell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import softmax

from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.faults import Explained, Fault
from elusive.systems.bearings.found_norths import Norths, norths_of
from elusive.systems.bearings.listeners import UNTOLD
from elusive.systems.bearings.mended import HARDLY, path_with
from elusive.systems.bearings.own import own_steps
from elusive.systems.bearings.pairings import lowered, pairings, pairings_finding
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.persisting import less_sure
from elusive.systems.bearings.sensor_errors import SensorError, also_at
from elusive.systems.bearings.several import track_several
from elusive.systems.bearings.several_checks import crowd_scale, several_fault, several_findings
from elusive.systems.bearings.several_fit import fitted
from elusive.tracking.track import Step, Track

ROUNDS = 3  # in which an error is found more closely: whose each bearing is is known better each time


class SeveralTold(NamedTuple):
    """What is told of a recording of several emitters."""

    steps: list[Step]
    parameters: BearingTracking  # that were found
    findings: tuple[Finding, ...]
    fault: Fault | None  # that is mended


def several_told(heard: Sequence[PlaceSet], given: BearingTracking, sites: SensorSites) -> SeveralTold:
    """Track a recording of several emitters, find what is wrong with a sensor, and track it again without that.

    Parameters
    ----------
    heard
        In the order of time.
    given
        Of how emitters are tracked; what is not given is found.
    sites
        Where the sensors were told to stand.

    Raises
    ------
    ParameterError
        If the tracker cannot do what is asked.
    DataError
        If a measurement cannot be used.
    """
    parameters = fitted(given, sites, heard)
    tracked = _Tracked(list(track_several(heard, parameters, sites)), parameters, sites)
    fault = several_fault(tracked.steps, parameters, sites)
    best = None
    if fault is not None and fault.perhaps[0].gain > fault.claimed:
        best, tracked = _without(fault.perhaps[0], heard, given, sites)
        what, remedy = best.error.said(best.sizes)
        fault = fault._replace(what=what, remedy=remedy)
    steps, asked, stand = tracked
    pairs, norths = pairings(steps, asked, stand), norths_of(asked, stand)
    scale = crowd_scale(steps, stand, asked)
    findings = (*several_findings(steps, asked, stand, fault, scale), pairings_finding(pairs))
    share = {} if pairs is None else dict(zip(pairs.tracks, pairs.probability.tolist(), strict=True))
    share |= {number: UNTOLD * share.get(number, 1.0) for number in scale.alone}
    told = [less_sure(norths.wider(step, stand), asked) for step in lowered(steps, share)]
    if fault is not None:
        claimed = Explained(_turned(norths_of(parameters, sites)), (), (), fault.claimed, [])
        perhaps = [best, claimed, *fault.perhaps[1:]] if best else [claimed, *fault.perhaps]
        told = _covering(told, tracked, perhaps, parameters, sites)
    came = {one.time_s: one for one in heard}
    told = [step._replace(measurement=came[step.time_s]) for step in told if step.time_s in came]
    return SeveralTold(told, asked, findings, fault if best else None)


class _Tracked(NamedTuple):
    """What was tracked, with what was found, and where sensors were taken to stand."""

    steps: list[Step]
    parameters: BearingTracking
    sites: SensorSites


def _without(
    best: Explained, heard: Sequence[PlaceSet], given: BearingTracking, sites: SensorSites
) -> tuple[Explained, _Tracked]:
    """Return an error with its size as it is found at last, and what is tracked without it."""
    bearings = [one for one in heard if isinstance(one, BearingSet)]
    for count in range(ROUNDS):
        mended, stand = best.error.without(bearings, sites, best.sizes)
        mended = also_at((one.time_s for one in heard), mended)
        parameters = fitted(given, stand, mended)
        steps = list(track_several(mended, parameters, stand))
        more = several_fault(steps, parameters, stand, best.error) if best.sizes and count + 1 < ROUNDS else None
        if more is None:
            break
        best = best._replace(sizes=tuple(np.add(best.sizes, more.perhaps[0].sizes).tolist()))
    return best, _Tracked(steps, parameters, stand)


def _turned(norths: Norths) -> SensorError:
    """Return norths, with which emitters were tracked at first, as an error."""
    return SensorError(
        (), "norths", lambda sizes: ("", ""),
        lambda heard, sites, sizes: ([norths.righted(one) for one in heard], sites),
    )  # fmt: skip


def _covering(
    told: Sequence[Step],
    tracked: _Tracked,
    perhaps: Sequence[Explained],
    parameters: BearingTracking,
    sites: SensorSites,
) -> list[Step]:
    """Return the steps with ellipses that cover what is nearly as likely as the first error, without which they are.

    Parameters
    ----------
    told, tracked
        What is told, and as it was tracked.
    perhaps
        Errors, the likeliest first.
    parameters, sites
        What was found at first, and where sensors were told to stand.
    """
    best, names = perhaps[0], parameters.over_ground(parameters.plain_motion, solid=False).state_names
    kept = [one for one in perhaps if one.gain > best.gain - HARDLY]
    weight, norths = softmax([one.gain for one in kept]), norths_of(tracked.parameters, tracked.sites)
    back, wider = tuple(np.negative(best.sizes).tolist()), dict[int, tuple[Array, Array]]()
    for number, its in own_steps(tracked.steps, tracked.sites, tracked.parameters.deviation_deg).items():
        own = [norths.as_heard(step.measurement) for step in its]
        # what came, by whose it is now
        came = best.error.without(own, tracked.sites, back)[0] if best.sizes else own
        steps = [Step(one.time_s, one, None, ()) for one in came]
        first, *others = [path_with(one, steps, names, parameters, sites) for one in kept]
        if first is not None:
            more = weight[0] * first.by_size
            for part, other in zip(weight[1:].tolist(), others, strict=True):
                if other is not None:
                    off = other.mean - first.mean
                    more = more + part * (other.by_size + np.einsum("ki,kj->kij", off, off))
            wider[number] = np.array([step.time_s for step in steps]), more[:, [[X], [Y]], [X, Y]]

    def covering(one: Track, time_s: float) -> Track:
        if one.track not in wider:
            return one
        times_s, more = wider[one.track]
        covariance = one.covariance.copy()
        covariance[np.ix_([X, Y], [X, Y])] += more[np.abs(times_s - time_s).argmin()]
        return one._replace(covariance=covariance)

    return [step._replace(tracks=tuple(covering(one, step.time_s) for one in step.tracks)) for step in told]
