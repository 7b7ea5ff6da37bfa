"""The belief about one emitter at each time, and its path estimated as a whole."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.factor_graph import FactorGraphFilter
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import Estimator
from elusive.systems.bearings.heard import have_elevations
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import powers_found
from elusive.tracking.track import Status, Step, Track

FLAT_NAMES = ("x", "vx", "y", "vy")


class Emitter(NamedTuple):
    """The belief about an emitter at one time."""

    state_names: tuple[str, ...]
    mean: Array  # (d,), NaN before there is any
    covariance: Array  # (d, d)
    started: bool  # whether the bearings have given a place
    log_evidence: float  # of the measurement given the earlier ones; of an estimate of the whole, all at its last step
    converged: bool = True  # whether the descent to the path came to its end
    reopened: bool = False  # whether bearings rather tell a manoeuvre beyond what the motion allows

    def step(self, measurement: PlaceSet) -> Step:
        """Return the step to which a measurement led."""
        status: Status = "confirmed" if self.started else "candidate"
        track = Track(1, status, float("nan"), self.mean, self.covariance)
        return Step(measurement.time_s, measurement, self, (track,) if np.isfinite(self.mean[0]) else ())


def whole_steps(measurements: Iterable[PlaceSet], parameters: BearingTracking, sites: SensorSites) -> list[Step]:
    """Return the steps of one emitter, by a filter that takes all measurements at once.

    Raises
    ------
    ParameterError
        If the filter cannot take them.
    DataError
        If there is none, or one cannot be used.
    """
    known = list(in_order(measurements))
    if not known:
        raise DataError("bearings: there is none; a track needs at least one.")
    asked = powers_found(parameters, sites, [known])
    return list(of_whole(asked.bind(sites, type(known[0]), elevations=have_elevations(known)), known))


def in_order(measurements: Iterable[PlaceSet]) -> Iterator[PlaceSet]:
    """Yield measurements, each later than the one before."""
    before_s = -math.inf
    for number, measurement in enumerate(measurements):
        if not measurement.time_s > before_s:
            raise DataError(
                f"bearings: measurement {number}, of {measurement.time_s:g} s, is not later than the one before; put "
                "what was heard at one time into one measurement, in the order of time."
            )
        before_s = measurement.time_s
        yield measurement


def of_whole(estimator: Estimator, measurements: list[Any]) -> Iterator[Step]:
    """Yield the steps of an estimator that takes all measurements at once."""
    path: Any
    if isinstance(estimator, FactorGraphFilter):
        path = estimator.track_sets(measurements)
        for row, measurement in enumerate(measurements):
            yield by_axis(*(part[row] for part in path[1:])).step(measurement)
        return
    if isinstance(estimator, MapSmoother):
        path = estimator.smooth(measurements)
    elif isinstance(estimator, ExtendedKalmanFilter):
        path = estimator.track(measurements, smooth=True)
    else:
        assert isinstance(estimator, FixedLagSmoother)
        path = estimator.track(measurements)
    names, last = estimator.state_names, len(measurements) - 1
    evidence, converged = getattr(path, "log_evidence", float("nan")), getattr(path, "converged", True)
    for row, measurement in enumerate(measurements):
        log_evidence = evidence if row == last else 0.0
        yield Emitter(names, path.states[row], path.covariances[row], True, log_evidence, converged).step(measurement)


def by_axis(place: Array, variance: Array, velocity: Array, velocity_variance: Array) -> Emitter:
    """Return the belief of a factor graph, each axis its own: arrays are ``(2,)``."""
    mean = np.column_stack([place, velocity]).ravel()
    covariance = np.diag(np.column_stack([variance, velocity_variance]).ravel())
    return Emitter(FLAT_NAMES, mean, covariance, bool(np.isfinite(place).all()), float("nan"))
