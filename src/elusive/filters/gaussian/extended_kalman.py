"""Extended and iterated Kalman filter of any motion and sensor, live or of a whole recording, and its smoother.

Bar-Shalom, Li and Kirubarajan (2001), section 10.3; Bell and Cathey (1993) for the iterated update; Rauch, Tung and
Striebel (1965). Without a prior it starts from the most probable path of the first bearings, as soon as they give a
place. Near a sensor a bearing bends within the belief: the square of (half the variance of the place / range^2) is
added to its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array, interval_since
from elusive.filters.gaussian import _extended_kernels as kernels
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian._map_kernels import Descent
from elusive.filters.gaussian.bearing_stretch import BearingStretch
from elusive.filters.gaussian.kalman import smoothed
from elusive.filters.gaussian.plain_stretch import PlainStretch
from elusive.filters.gaussian.problem import Problem, Stretch


class ExtendedState(NamedTuple):
    """A Gaussian belief at a time, and the evidence of its measurement."""

    time_s: float  # NaN before the first measurement, where the prior has no time
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    log_evidence: float  # log p(measurement | earlier ones); 0 while the filter has not started, and without one
    pending: tuple[tuple[float, Any], ...] | None  # bearings before they gave a place; None once it has started


class FilteredPath(NamedTuple):
    """A belief at each time."""

    times_s: Array  # (K,)
    states: Array  # (K, d)
    covariances: Array  # (K, d, d)
    log_evidence: float  # log p(measurements since the filter started | those until then)
    started: int  # row of the time from which on the filter ran; before, the most probable paths of the first bearings


class ExtendedKalmanFilter(Problem):
    """Gaussian beliefs from measurements linearised about the prediction or, iterated, about the result.

    A robust loss gives less weight to readings that lie far from where the belief, as sure as it is, expects them.
    """

    iterations: int = Field(10, gt=0, le=100, description="Linearisations of an update; 1: the plain extended filter")

    def init(self, rng: Generator, time_s: float = math.nan) -> ExtendedState:
        """Return the belief before the first measurement; nothing is drawn."""
        pending = () if math.isnan(time_s) else ((time_s, None),)
        return ExtendedState(time_s, *self.first(), 0.0, pending if self.prior is None else None)

    def step(self, state: ExtendedState, time_s: float, measurement: Any | None, rng: Generator) -> ExtendedState:
        """Return the belief at a time and with its measurement; None: without.

        Raises
        ------
        DataError
            If a measurement cannot be used or its time is before the state's.
        """
        interval_s = interval_since(state.time_s, time_s)
        if state.pending is not None:
            if measurement is None and not state.pending:
                return state
            pending = (*state.pending, (time_s, measurement))
            found, placed = self.started(self.stretch(pending))
            last = marginals(found.L, found.Y)[-1]
            return ExtendedState(time_s, found.path[-1], last, 0.0, None if placed else pending)
        belief = self.predicted(state.mean, state.covariance, interval_s)
        return ExtendedState(time_s, *self.updated(time_s, *belief, measurement, self.iterations), None)

    def track(
        self, measurements: Iterable[Any | None], times_s: Iterable[float] | None = None, *, smooth: bool = False
    ) -> FilteredPath:
        """Filter a recording, taken as by :meth:`recorded`; ``smooth``: each belief is given later measurements too."""
        return self.over(self.recorded(measurements, times_s), smooth=smooth)

    def over(self, stretch: Stretch, *, smooth: bool = False) -> FilteredPath:
        """Filter a stretch of measurements, one at least, and smooth it."""
        return self._plain(stretch, smooth) if isinstance(stretch, PlainStretch) else self._compiled(stretch, smooth)

    def _plain(self, stretch: PlainStretch, smooth: bool) -> FilteredPath:
        rng, log_evidence, states = np.random.default_rng(0), 0.0, list[ExtendedState]()
        state = self.init(rng)
        for time_s, measurements in zip(stretch.times_s.tolist(), stretch.measurements, strict=True):
            for measurement in measurements or (None,):
                state = self.step(state, time_s, measurement, rng)
                log_evidence += state.log_evidence
            states.append(state)
        if smooth:
            states = smoothed(self, states)
        means, covariances = np.array([s.mean for s in states]), np.array([s.covariance for s in states])
        return FilteredPath(stretch.times_s, means, covariances, log_evidence, 0)

    def _compiled(self, stretch: BearingStretch, smooth: bool) -> FilteredPath:
        table, transitions, iterations = stretch.table, stretch.transitions, self.iterations
        K, d = len(table.times_s), len(self.state_names)
        means, covariances, log_densities = np.empty((K, d)), np.empty((K, d, d)), np.zeros(K)
        started, found = 0, None
        if self.prior is not None:
            means[0], covariances[0] = self.first()
            log_densities[0] = kernels.update(
                table, 0, transitions, self.robust, iterations, means[0].copy(), means[0], covariances[0]
            )
        else:
            if smooth:  # those before the start are smoothed from it, and need no belief of their own
                started, found = self._sought(stretch)
                means[started], covariances[started] = found.path[-1], marginals(found.L, found.Y)[-1]
            else:
                for started in range(K):
                    found, placed = self.started(stretch.until(started + 1))
                    means[started], covariances[started] = found.path[-1], marginals(found.L, found.Y)[-1]
                    if placed:
                        break
        kernels.filtered(table, transitions, self.robust, iterations, started, means, covariances, log_densities)
        if smooth:
            kernels.smoothed(transitions, started, means, covariances)
            if found is not None:
                first = slice(started + 1)
                kernels.smoothed_start(found.path, found.L, found.Y, means[first], covariances[first])
        return FilteredPath(table.times_s, means, covariances, float(log_densities.sum()), started)

    def _sought(self, stretch: BearingStretch) -> tuple[int, Descent]:
        """Find, by doubling and halving, the first time by which bearings give a place, else the last; and a path."""
        last = len(stretch.times_s) - 1
        before, row = -1, 0
        found, placed = self.started(stretch.until(1))
        while not placed and row < last:
            before, row = row, min(2 * row + 1, last)
            found, placed = self.started(stretch.until(row + 1))
        while placed and row - before > 1:
            middle = (before + row) // 2
            earlier, there = self.started(stretch.until(middle + 1))
            before, row, found = (before, middle, earlier) if there else (middle, row, found)
        return row, found
