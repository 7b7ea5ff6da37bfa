"""Fixed-lag maximum a posteriori of any motion and sensor: the most probable path of the last seconds, at every step.

Sibley, Matthies and Sukhatme (2010), J. Field Robotics 27(5): what leaves the window is summed out, not forgotten.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array, interval_since
from elusive.errors import DataError
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian._map_kernels import Anchor
from elusive.filters.gaussian.problem import Problem, Stretch, anchored
from elusive.model import Positive
from elusive.runner import timed

WINDOW_TOLERANCE = 1e-3


class Window(NamedTuple):
    """The last times, their measurements, the steps between them, and what is known from before."""

    stretch: Stretch
    anchor: Anchor
    path: Array  # (n, d) most probable states
    covariances: Array  # (n, d, d)


class FixedLagState(NamedTuple):
    """The belief now, and those of the times that leave the window with it, smoothed over the lag."""

    time_s: float  # NaN before the first measurement, where the prior has no time
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    left_times_s: Array  # (j,), mostly one
    left_means: Array  # (j, d)
    left_covariances: Array  # (j, d, d)
    window: Window | None  # None before the first measurement
    started: bool  # whether a place is known; nothing leaves the window before


class LaggedPath(NamedTuple):
    """A state at each time, given all measurements up to a lag later."""

    times_s: Array  # (K,)
    states: Array  # (K, d)
    covariances: Array  # (K, d, d)


class FixedLagSmoother(Problem):
    """The most probable path of a sliding window: live, and nearly as good as that of all measurements at once.

    The noise of a turn (ctrv) leaves place and velocity certain beside the arc: over many seconds between measurements
    the few steps of a live descent may end beside it, and the extended filter or the batch estimate is to be preferred.
    """

    lag_s: Positive = Field(2.0, description="Time over which later measurements still correct a state [s]")
    iterations: int = Field(5, gt=0, le=100, description="Most steps of the descent at each time")

    def init(self, rng: Generator, time_s: float = math.nan) -> FixedLagState:
        """Return the belief before the first measurement; nothing is drawn."""
        mean, covariance = self.first()
        none, window = (np.empty(0), np.empty((0, len(mean))), np.empty((0, *covariance.shape))), None
        if self.prior is None and not math.isnan(time_s):
            window = Window(self.stretch([(time_s, None)]), anchored(mean, covariance), mean[None], covariance[None])
        return FixedLagState(time_s, mean, covariance, *none, window, self.prior is not None)

    def step(self, state: FixedLagState, time_s: float, measurement: Any | None, rng: Generator) -> FixedLagState:
        """Return the beliefs at a time and with its measurement; None: without.

        Raises
        ------
        DataError
            If a measurement cannot be used or its time is before the state's.
        """
        interval_s, window = interval_since(state.time_s, time_s), state.window
        if window is None:
            if self.prior is None and measurement is None:
                return state
            stretch = self.stretch([(time_s, measurement)])
            if self.prior is None:
                return self._start(stretch)
            mean, covariance = self.predicted(state.mean, state.covariance, interval_s)
            return self._settled(
                Window(stretch, anchored(mean, covariance), mean[None], covariance[None]), started=True
            )
        stretch = window.stretch.joined(time_s, measurement)
        if not state.started:
            return self._start(stretch)
        path, spreads = window.path, window.covariances
        if interval_s:
            ahead, spread = self.carried(state.mean, state.covariance, interval_s)
            path, spreads = np.concatenate([path, ahead[None]]), np.concatenate([spreads, spread[None]])
        return self._settled(Window(stretch, window.anchor, path, spreads), started=True)

    def track(self, measurements: Iterable[Any | None], times_s: Iterable[float] | None = None) -> LaggedPath:
        """Estimate each state from the measurements up to a lag later; arguments and errors as of :meth:`recorded`."""
        rng = np.random.default_rng(0)
        state, left, seen = self.init(rng), list[tuple[Array, Array, Array]](), False
        for measurement, time_s in timed(measurements, times_s):
            state = self.step(state, time_s, measurement, rng)
            seen |= state.window is not None and not state.window.stretch.empty
            left.append((state.left_times_s, state.left_means, state.left_covariances))
        if not seen or state.window is None:
            raise DataError("measurements: there is none; a path needs at least one.")
        left.append((state.window.stretch.times_s, state.window.path, state.window.covariances))
        return LaggedPath(*(np.concatenate(part) for part in zip(*left, strict=True)))

    def _start(self, stretch: Stretch) -> FixedLagState:
        found, placed = self.started(stretch)
        window = Window(stretch, self.anchor(), found.path, marginals(found.L, found.Y))
        return self._settled(window, started=placed)

    def _settled(self, window: Window, *, started: bool) -> FixedLagState:
        stretch, anchor, path, spreads = window
        found = stretch.settle(path, spreads, anchor, self.iterations, WINDOW_TOLERANCE)
        whole, covariances, times_s = found.path, marginals(found.L, found.Y), stretch.times_s
        now, gone = float(times_s[-1]), 0
        while started and gone + 1 < len(whole) and times_s[gone + 1] <= now - self.lag_s:
            anchor = stretch.summed_out(whole[gone:], covariances[gone:], anchor)
            stretch, gone = stretch.rest(), gone + 1
        window = Window(stretch, anchor, whole[gone:], covariances[gone:])
        left = times_s[:gone], whole[:gone], covariances[:gone]
        return FixedLagState(now, whole[-1], covariances[-1], *left, window, started)
