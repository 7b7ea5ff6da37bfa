"""Extended and iterated Kalman filter on bearings, live or of a whole recording, and the smoother behind it.

Bar-Shalom, Li and Kirubarajan (2001), section 10.3; Bell and Cathey (1993) for the iterated update; Rauch, Tung and
Striebel (1965). It starts from the most probable path of the first bearings, as soon as they tell a place. Near a
sensor a bearing bends within the belief: the square of (half the variance of the place / range^2) is added to its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.gaussian import _extended_kernels as kernels
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian.bearing_problem import BearingProblem
from elusive.sensors.bearing_table import BearingTable, PlaceSet, tabulated


class ExtendedState(NamedTuple):
    """A Gaussian belief at a time, and what the bearings were worth."""

    time_s: float  # NaN before the first bearing
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    log_evidence: float  # log p(bearings | earlier ones); 0 while the filter has not begun, and without bearings
    pending: tuple[PlaceSet, ...] | None  # bearings before the place was told; None once the filter has begun


class FilteredPath(NamedTuple):
    """A belief at each time."""

    times_s: Array  # (K,)
    states: Array  # (K, d)
    covariances: Array  # (K, d, d)
    log_evidence: float  # log p(bearings since the filter began | those until then)
    begun: int  # row of the time from which on the filter ran; before, the most probable paths of the first bearings


class ExtendedKalmanFilter(BearingProblem):
    """Gaussian beliefs from bearings linearised about the prediction or, iterated, about the result.

    A robust loss gives less weight to bearings that lie far from where the belief, as sure as it is, expects them.
    """

    iterations: int = Field(10, gt=0, le=100, description="Linearisations of an update; 1: the plain extended filter")

    def init(self, rng: Generator, time_s: float = np.nan) -> ExtendedState:
        """Return the belief before the first bearing; nothing is drawn."""
        anchor = self.anchor()
        return ExtendedState(np.nan, anchor.at, np.asarray(np.linalg.inv(anchor.information)), 0.0, ())

    def step(self, state: ExtendedState, time_s: float, measurement: PlaceSet | None, rng: Generator) -> ExtendedState:
        """Return the belief at the time of the bearings, with them; None: the prediction.

        Raises
        ------
        DataError
            If a bearing cannot be used or its time is not after the state's.
        """
        if measurement is None and np.isnan(state.time_s):
            return state
        if measurement is None:
            measurement = self.sensor.nothing(time_s)
        if measurement.time_s <= state.time_s:
            raise DataError(f"bearings at {measurement.time_s:g} s: come after {state.time_s:g} s; sort them by time.")
        if state.pending is not None:
            pending = (*state.pending, measurement)
            found, told = self.begin(tabulated(pending, self.sensor))
            last = marginals(found.L, found.Y)[-1]
            return ExtendedState(measurement.time_s, found.path[-1], last, 0.0, None if told else pending)
        table = tabulated((measurement,), self.sensor)
        transitions = self.stepped(measurement.time_s - state.time_s)
        mean, covariance = kernels.predict(
            transitions, 0, state.mean, state.covariance, np.empty_like(state.covariance)
        )
        worth = kernels.update(table, 0, transitions, self.robust, self.iterations, mean, mean, covariance)
        return ExtendedState(measurement.time_s, mean, covariance, worth, None)

    def track(self, sets: Iterable[PlaceSet], *, smooth: bool = False) -> FilteredPath:
        """Filter a recording, and smooth it.

        Parameters
        ----------
        sets
            Bearings in the order of time.
        smooth
            Whether each belief is to be given all bearings, later ones too.

        Raises
        ------
        DataError
            If a bearing cannot be used, times do not go forwards, or there is no bearing at all.
        """
        table = tabulated(sets, self.sensor)
        if not len(table.sensor):
            raise DataError("bearings: there is none; a path needs at least one.")
        return self.over(table, smooth=smooth)

    def over(self, table: BearingTable, *, smooth: bool = False) -> FilteredPath:
        """Filter a table of bearings, one at least, and smooth it."""
        K, d = len(table.times_s), len(self.state_names)
        means, covariances, log_densities = np.empty((K, d)), np.empty((K, d, d)), np.zeros(K)
        for begun in range(K):
            found, told = self.begin(table.between(0, begun + 1))
            means[begun], covariances[begun] = found.path[-1], marginals(found.L, found.Y)[-1]
            if told:
                break
        transitions = self.transitions(table.times_s)
        kernels.filtered(table, transitions, self.robust, self.iterations, begun, means, covariances, log_densities)
        if smooth:
            kernels.smoothed(transitions, begun, means, covariances)
            kernels.smoothed_start(found.path, found.L, found.Y, means[: begun + 1], covariances[: begun + 1])
        return FilteredPath(table.times_s, means, covariances, float(log_densities.sum()), begun)
