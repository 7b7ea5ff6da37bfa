"""Bearings and arrivals over a stretch of time as tables, and the motion between: the most probable path, compiled."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from elusive.contracts import Array
from elusive.filters.gaussian._bearing_kernels import move
from elusive.filters.gaussian._map_kernels import NO_RANGES, Anchor, Descent, Loss, inverse_noise, optimise
from elusive.filters.gaussian._window_kernels import summed_out
from elusive.filters.gaussian.robust import log_norm
from elusive.filters.gaussian.transitions import STEP_DIGITS, Transitions
from elusive.sensors.bearing_table import BearingTable, PlaceSensor, PlaceSet, tabulated


class Tabled(Protocol):
    """What tables are made by."""

    @property
    def sensor(self) -> PlaceSensor:
        """Where bearings or arrivals are taken."""

    @property
    def robust(self) -> Loss:
        """Loss of a bearing's whitened residual."""

    def stepped(self, interval_s: float) -> Transitions:
        """Tables of the motion over a step."""


class BearingStretch(NamedTuple):
    """Times, their bearings, and the steps between them."""

    problem: Tabled
    table: BearingTable
    transitions: Transitions
    weights: Array  # (U, d, d) inverse of the noises of the transitions' tables

    @property
    def times_s(self) -> Array:
        """Times, ``(K,)`` [s]."""
        return self.table.times_s

    @property
    def empty(self) -> bool:
        """Whether there is no bearing at all."""
        return not len(self.table.sensor)

    def settle(self, path: Array, spreads: Array, anchor: Anchor, iterations: int, tolerance: float) -> Descent:
        """Descend from a path to one of least cost."""
        path, (K, d) = path.copy(), path.shape
        L, Y = np.empty((K, d, d)), np.empty((K - 1, d, d))
        table, T, W, loss = self.table, self.transitions, self.weights, self.problem.robust
        found = optimise(path, table, NO_RANGES, T, W, anchor, loss, iterations, tolerance, L, Y)
        return Descent(path, L, Y, *found)

    def log_scale(self, path: Array, spreads: Array) -> float:
        """Logarithm of the steps' and the bearings' densities where their residuals are nought, 2 pi of steps aside."""
        T, d = self.transitions, path.shape[1]
        log_weights = np.linalg.slogdet(self.weights)[1][T.which].sum()
        if T.turn >= 0:
            ahead, F, Q = np.empty(d), np.empty((d, d)), np.empty((len(path) - 1, d, d))
            for k in range(len(path) - 1):
                move(T, k, path[k], ahead, F, Q[k])
            log_weights = -np.linalg.slogdet(Q)[1].sum()
        solid = np.isfinite(self.table.elevation_rad) & (self.problem.sensor.dimensions == 3)
        plane, line = (log_norm(self.problem.robust, components) for components in (2, 1))
        norms = np.where(solid, plane, line) + np.where(solid, 1.0, 0.5) * np.log(self.table.variance)
        return float(0.5 * log_weights - norms.sum())

    def summed_out(self, path: Array, spreads: Array, anchor: Anchor) -> Anchor:
        """Return what the bearings of the first time, and all before, say of the second state."""
        return summed_out(path, self.table, self.transitions, self.weights, anchor, self.problem.robust)

    def until(self, count: int) -> BearingStretch:
        """Return the first times."""
        T = self.transitions
        first = T._replace(interval_s=T.interval_s[: count - 1], which=T.which[: count - 1])
        return self._replace(table=self.table.between(0, count), transitions=first)

    def rest(self) -> BearingStretch:
        """Return the stretch without its first time."""
        T = self.transitions
        later = T._replace(interval_s=T.interval_s[1:], which=T.which[1:])
        return self._replace(table=self.table.between(1, len(self.times_s)), transitions=later)

    def joined(self, time_s: float, measurement: PlaceSet | None) -> BearingStretch:
        """Return the stretch with a measurement more, at its last time or at a later one."""
        new = tabulated((measurement,), self.problem.sensor, (time_s,))
        before, T = float(self.times_s[-1]), self.transitions
        if time_s == before:
            return self._replace(table=self.table.joined(new))
        step, table = self.problem.stepped(time_s - before), self.table.joined(new)
        interval_s = np.concatenate([T.interval_s, step.interval_s])
        if len(T.which) and round(float(T.interval_s[-1]), STEP_DIGITS) == step.interval_s[0]:
            # as long as the step before: its tables serve
            longer = T._replace(interval_s=interval_s, which=np.concatenate([T.which, T.which[-1:]]))
            return self._replace(table=table, transitions=longer)
        longer = T._replace(
            interval_s=interval_s,
            which=np.arange(len(T.which) + 1),
            F=np.concatenate([T.F[T.which], step.F]),
            Q=np.concatenate([T.Q[T.which], step.Q]),
        )
        weights = np.concatenate([self.weights[T.which], inverse_noise(step)])
        return self._replace(table=table, transitions=longer, weights=weights)
