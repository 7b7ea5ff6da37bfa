"""Emitters tracked by what sensors hear of them: a recording as a whole, or each time as it comes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, islice
from typing import Any

import numpy as np

from elusive.errors import DataError
from elusive.filters.gaussian.factor_graph import FactorGraphFilter, FactorGraphState
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.recovering import RecoveringFilter, recovers
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import WHOLE, IgnoreElevations, OneEmitter, SeveralEmitters
from elusive.systems.bearings.emitter import FLAT_NAMES, Emitter, by_axis, in_order, of_whole
from elusive.systems.bearings.heard import angles_of, have_elevations
from elusive.systems.bearings.live_one import OneFit
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import powers_found
from elusive.systems.bearings.several import decided, track_several
from elusive.systems.bearings.several_fit import fitted
from elusive.tracking.memory import Memory
from elusive.tracking.track import Step

RECOVERING = ("iekf", "fixed-lag")  # the plain filter is there to compare


def track(
    measurements: Iterable[PlaceSet],
    parameters: BearingTracking,
    sites: SensorSites,
    *,
    live: bool = False,
    memory: Memory | None = None,
) -> Iterator[Step]:
    """Yield a step for each time; its state is an :class:`Emitter`, of several emitters their tracker's.

    Filters go from time to time. Estimators of the whole (``map``, ``rts``) take all measurements first, and unless it
    is live ``fixed-lag`` and the factor graph, which finds all fixes at once. Live the first measurement decides
    whether there are heights and, where ``parameters.emitters`` is left to what is heard, several emitters.

    Parameters
    ----------
    measurements
        In the order of time, all of one kind.
    parameters
        What to do.
    sites
        Where the sensors stand.
    live
        Whether a step is to be yielded before the next measurement is taken.
    memory
        Where a filter keeps its state, and goes on from.

    Raises
    ------
    ParameterError
        If the estimator cannot do what is asked.
    DataError
        If a measurement cannot be used, or has the time of the one before.
    """
    parameters.check(live=live)
    memory = memory or Memory()
    coming = in_order(memory.new(measurements))
    known = list(islice(coming, 1) if live else coming)
    if not known:
        raise DataError("bearings: there is none; a track needs at least one.")
    decisive = [memory.first] if live else known
    parameters = decided(parameters, decisive)[0]
    if isinstance(parameters.emitters, SeveralEmitters):
        parameters = parameters if live else fitted(parameters, sites, known)
        yield from track_several(chain(known, coming), parameters, sites, memory, live=live)
        return
    parameters = parameters if live else powers_found(parameters, sites, [known])

    def made(asked: BearingTracking) -> Any:
        return asked.bind(sites, type(known[0]), elevations=have_elevations(decisive))

    estimator = made(parameters)
    at_once = isinstance(estimator, FixedLagSmoother | FactorGraphFilter) and not live
    if at_once or parameters.filter.kind in WHOLE:
        yield from of_whole(estimator, known)
        return
    names, rng = getattr(estimator, "state_names", FLAT_NAMES), np.random.default_rng(0)  # nothing is drawn
    begun = OneFit(parameters, sites, memory.first if live else None)
    state, fit = memory.held or (_stepping(estimator, parameters).init(rng), begun)
    stepping = _stepping(made(fit.parameters), parameters)
    for measurement in chain(known, coming):
        norths = fit.norths
        state = stepping.step(state, measurement.time_s, norths.righted(measurement), rng)
        if live and fit.heed({1: measurement}):
            stepping = _stepping(made(fit.parameters), parameters)
        memory.keep(measurement.time_s, state, fit)
        yield norths.wider(_emitter(names, state).step(measurement), sites)


def _stepping(estimator: Any, parameters: BearingTracking) -> Any:
    """Return what goes from time to time."""
    recovering = parameters.filter.kind in RECOVERING and recovers(estimator)
    return RecoveringFilter(estimator) if recovering else estimator


def _emitter(names: tuple[str, ...], state: Any) -> Emitter:
    if isinstance(state, FactorGraphState):
        return by_axis(state.mean, state.variance, state.velocity, state.velocity_variance)
    started = state.started if hasattr(state, "started") else state.pending is None
    evidence, reopened = getattr(state, "log_evidence", float("nan")), getattr(state, "reopened", False)
    return Emitter(names, state.mean, state.covariance, bool(started), evidence, reopened=reopened)


def track_labelled(
    heard: dict[str, list[PlaceSet]], parameters: BearingTracking, sites: SensorSites
) -> dict[str, tuple[list[Step], BearingTracking]]:
    """Track each label's emitter by itself, as each moves; tracks are numbered in the order of the labels.

    They have no existence. With each are the parameters it was tracked with.
    """
    if not all(have_elevations(measurements) for measurements in heard.values()):
        parameters = parameters.replace(elevations=IgnoreElevations())
    parameters, found = parameters.replace(emitters=OneEmitter()), dict[str, tuple[list[Step], BearingTracking]]()
    for number, (label, measurements) in enumerate(heard.items(), start=1):
        own = powers_found(parameters, sites, [measurements])
        steps = track(measurements, own, sites)
        numbered = [step._replace(tracks=tuple(one._replace(track=number) for one in step.tracks)) for step in steps]
        found[label] = numbered, own
    return found


def together(labelled: Iterable[list[Step]]) -> list[Step]:
    """Return the steps of several emitters time by time."""
    at: dict[float, list[Step]] = {}
    for steps in labelled:
        for step in steps:
            at.setdefault(step.time_s, []).append(step)
    whole = []
    for time_s, parts in sorted(at.items()):
        angles = [angles_of(step.measurement) for step in parts]
        places = [part.places_m for part in angles if part.places_m is not None]
        sensor, azimuth, elevation = (np.concatenate([part[k] for part in angles]) for k in (1, 2, 3))
        heard = BearingSet(time_s, sensor, azimuth, elevation, np.concatenate(places) if places else None)
        tracks = tuple(track for step in parts for track in step.tracks)
        whole.append(Step(time_s, heard, parts[0].state, tracks))
    return whole
