"""An emitter tracked by what sensors hear of it: a recording as a whole, or each time as it comes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.factor_graph import FactorGraphState
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.runner import run
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import Estimator, RtsSmoother
from elusive.systems.bearings.heard import have_elevations
from elusive.systems.bearings.parameters import BearingTracking
from elusive.tracking.track import Status, Step, Track

FLAT_NAMES = ("x", "vx", "y", "vy")


class Emitter(NamedTuple):
    """The belief about an emitter at one time."""

    state_names: tuple[str, ...]
    mean: Array  # (d,), NaN before there is any
    covariance: Array  # (d, d)
    started: bool  # whether the bearings have told a place
    log_evidence: float  # of the measurement given the earlier ones; of an estimate of the whole, all at its last step

    def step(self, measurement: PlaceSet) -> Step:
        """Return the step to which a measurement led."""
        status: Status = "confirmed" if self.started else "candidate"
        track = Track(1, status, float("nan"), self.mean, self.covariance)
        return Step(measurement.time_s, measurement, self, (track,) if np.isfinite(self.mean[0]) else ())


def track(
    measurements: Iterable[PlaceSet], parameters: BearingTracking, sites: SensorSites, *, live: bool = False
) -> Iterator[Step]:
    """Yield a step for each time; its state is an :class:`Emitter`.

    Filters go from time to time. Estimators of the whole (``map``, ``rts``; ``fixed-lag``, unless it is live) take
    all measurements first. Live the first of them decides whether there are heights.

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

    Raises
    ------
    ParameterError
        If the estimator cannot do what is asked.
    DataError
        If a measurement cannot be used.
    """
    parameters.check(live=live)
    coming = iter(measurements)
    known = [next(coming)] if live else list(coming)
    elevations = have_elevations(known)
    estimator = parameters.bind(sites, type(known[0]), elevations=elevations)
    smooth = isinstance(parameters.filter, RtsSmoother)
    if isinstance(estimator, MapSmoother) or smooth or (isinstance(estimator, FixedLagSmoother) and not live):
        yield from _of_whole(estimator, known)
        return
    names = getattr(estimator, "state_names", FLAT_NAMES)
    measured = chain(known, coming)
    fed = list[PlaceSet]()

    def feed() -> Iterator[PlaceSet]:
        for measurement in measured:
            fed.append(measurement)
            yield measurement

    # filters of bearings draw nothing
    filtered: Any = estimator
    for state in run(filtered, feed(), np.random.default_rng(0)):
        yield _emitter(names, state).step(fed.pop())


def _of_whole(estimator: Estimator, measurements: list[PlaceSet]) -> Iterator[Step]:
    path: Any
    if isinstance(estimator, MapSmoother):
        path = estimator.smooth(measurements)
    elif isinstance(estimator, ExtendedKalmanFilter):
        path = estimator.track(measurements, smooth=True)
    else:
        assert isinstance(estimator, FixedLagSmoother)
        path = estimator.track(measurements)
    names, last = estimator.state_names, len(measurements) - 1
    evidence = getattr(path, "log_evidence", float("nan"))
    for row, (measurement, mean, covariance) in enumerate(
        zip(measurements, path.states, path.covariances, strict=True)
    ):
        yield Emitter(names, mean, covariance, True, evidence if row == last else 0.0).step(measurement)


def _emitter(names: tuple[str, ...], state: Any) -> Emitter:
    if isinstance(state, FactorGraphState):
        mean, variance = np.empty(4), np.empty(4)
        mean[::2], mean[1::2] = state.mean, state.velocity
        variance[::2], variance[1::2] = state.variance, state.velocity_variance
        return Emitter(names, mean, np.diag(variance), state.started, float("nan"))
    started = state.started if hasattr(state, "started") else state.pending is None
    return Emitter(names, state.mean, state.covariance, bool(started), getattr(state, "log_evidence", float("nan")))
