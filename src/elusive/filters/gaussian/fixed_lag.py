"""Fixed-lag maximum a posteriori from bearings: the most probable path of the last seconds, again at every step.

Sibley, Matthies and Sukhatme (2010), J. Field Robotics 27(5): what leaves the window is summed out, not forgotten.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian._map_kernels import NO_RANGES, Anchor, inverse_noise, optimise
from elusive.filters.gaussian._window_kernels import summed_out
from elusive.filters.gaussian.bearing_problem import BearingProblem
from elusive.filters.gaussian.transitions import Transitions
from elusive.model import Positive
from elusive.sensors.bearing_table import BearingTable, PlaceSet, tabulated

WINDOW_TOLERANCE = 1e-3


class Window(NamedTuple):
    """The last times, their bearings, the steps between them, and what is known from before."""

    table: BearingTable
    transitions: Transitions
    weights: Array  # (n - 1, d, d) inverse of each step's noise
    anchor: Anchor


class FixedLagState(NamedTuple):
    """The belief now, and those of the times that leave the window with it, smoothed over the lag."""

    time_s: float  # NaN before the first bearing
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    left_times_s: Array  # (j,), mostly one
    left_means: Array  # (j, d)
    left_covariances: Array  # (j, d, d)
    path: Array  # (n, d) most probable states of the window
    window: Window | None  # None before the first bearing
    begun: bool  # whether the bearings have told a place; nothing leaves the window before


class LaggedPath(NamedTuple):
    """A state at each time, given all bearings up to a lag later."""

    times_s: Array  # (K,)
    states: Array  # (K, d)
    covariances: Array  # (K, d, d)


class FixedLagSmoother(BearingProblem):
    """The most probable path of a sliding window: live, and nearly as good as that of all bearings at once."""

    lag_s: Positive = Field(2.0, description="Time over which later bearings still correct a state [s]")
    iterations: int = Field(5, gt=0, le=100, description="Most steps of the descent at each time")

    def init(self, rng: Generator, time_s: float = np.nan) -> FixedLagState:
        """Return the belief before the first bearing; nothing is drawn."""
        at, information, _ = self.anchor()
        wide = np.asarray(np.linalg.inv(information))
        none = np.empty((0, len(at)))
        return FixedLagState(np.nan, at, wide, np.empty(0), none, np.empty((0, *wide.shape)), none, None, False)

    def step(self, state: FixedLagState, time_s: float, measurement: PlaceSet | None, rng: Generator) -> FixedLagState:
        """Return the beliefs at the time of the bearings; None: the prediction.

        Raises
        ------
        DataError
            If a bearing cannot be used or its time is not after the state's.
        """
        window = state.window
        if measurement is None:
            if window is None:
                return state
            measurement = self.sensor.nothing(time_s)
        if window is None:
            return self._begun(tabulated((measurement,), self.sensor))
        if measurement.time_s <= state.time_s:
            raise DataError(f"bearings at {measurement.time_s:g} s: come after {state.time_s:g} s; sort them by time.")
        table = window.table.joined(tabulated((measurement,), self.sensor))
        if not state.begun:
            return self._begun(table)
        step = self.stepped(measurement.time_s - state.time_s)
        transitions = _joined(window.transitions, step)
        weights = np.concatenate([window.weights, inverse_noise(step)])
        path = np.concatenate([state.path, state.path[-1:] @ step.F[0].T])
        return self._settled(path, Window(table, transitions, weights, window.anchor))

    def track(self, sets: Iterable[PlaceSet]) -> LaggedPath:
        """Estimate each state from the bearings up to a lag later.

        Raises
        ------
        DataError
            If a bearing cannot be used, times do not go forwards, or there is no bearing at all.
        """
        rng = np.random.default_rng(0)
        state, left, bearings = self.init(rng), list[tuple[Array, Array, Array]](), 0
        for measurement in sets:
            state = self.step(state, measurement.time_s, measurement, rng)
            bearings += int(state.window is not None and state.window.table.first[-1] > 0)
            left.append((state.left_times_s, state.left_means, state.left_covariances))
        if not bearings or state.window is None:
            raise DataError("bearings: there is none; a path needs at least one.")
        left.append((state.window.table.times_s, *self._factor(state.path, state.window)))
        return LaggedPath(*(np.concatenate(part) for part in zip(*left, strict=True)))

    def _begun(self, table: BearingTable) -> FixedLagState:
        found, told = self.begin(table)
        T = self.transitions(table.times_s)
        each = np.arange(len(T.which))
        transitions = T._replace(which=each, F=T.F[T.which], Q=T.Q[T.which])
        window = Window(table, transitions, found.weights[T.which], self.anchor())
        return self._settled(found.path, window, begun=told)

    def _settled(self, path: Array, window: Window, *, begun: bool = True) -> FixedLagState:
        path, covariances = self._factor(path, window)
        table, whole, times_s = window.table, path, window.table.times_s
        now, gone = float(table.times_s[-1]), 0
        while begun and len(path) > 1 and table.times_s[1] <= now - self.lag_s:
            anchor = summed_out(path, table, window.transitions, window.weights, window.anchor, self.robust)
            path, table, gone = path[1:], table.between(1, len(table.times_s)), gone + 1
            window = Window(table, _rest(window.transitions), window.weights[1:], anchor)
        return FixedLagState(
            now, path[-1], covariances[-1], times_s[:gone], whole[:gone], covariances[:gone], path, window, begun
        )

    def _factor(self, path: Array, window: Window) -> tuple[Array, Array]:
        """Descend from a path; return the path and the covariances of its states."""
        path, n, d = path.copy(), *path.shape
        L, Y = np.empty((n, d, d)), np.empty((n - 1, d, d))
        table, T, weights, anchor = window
        optimise(path, table, NO_RANGES, T, weights, anchor, self.robust, self.iterations, WINDOW_TOLERANCE, L, Y)
        return path, marginals(L, Y)


def _joined(window: Transitions, step: Transitions) -> Transitions:
    return window._replace(
        interval_s=np.concatenate([window.interval_s, step.interval_s]),
        which=np.arange(len(window.which) + 1),
        F=np.concatenate([window.F, step.F]),
        Q=np.concatenate([window.Q, step.Q]),
    )


def _rest(window: Transitions) -> Transitions:
    return window._replace(interval_s=window.interval_s[1:], which=window.which[:-1], F=window.F[1:], Q=window.Q[1:])
