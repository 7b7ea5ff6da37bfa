"""Measurements of any sensor over a stretch of time and any motion between them: the most probable path, plainly.

Dellaert and Kaess (2017), Factor graphs for robot perception, chapters 2 and 3, and Sibley, Matthies and Sukhatme
(2010), J. Field Robotics 27(5), section 3: the algorithms of :mod:`elusive.filters.gaussian._map_kernels` and
:mod:`elusive.filters.gaussian._window_kernels` on whatever sensor and motion offer.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from elusive.contracts import Array
from elusive.filters.gaussian._bearing_kernels import loss_of
from elusive.filters.gaussian._block_kernels import factorise, solve
from elusive.filters.gaussian._map_kernels import LEAST_DAMPING, MOST_DAMPING, Anchor, Descent, Loss
from elusive.filters.gaussian.linearised import ResidualSensor, Rows, linearised
from elusive.filters.gaussian.moments import Moved
from elusive.filters.gaussian.robust import log_norm


class Linear(Protocol):
    """What carries a belief on and what it is updated with."""

    @property
    def sensor(self) -> ResidualSensor:
        """The sensor."""

    @property
    def robust(self) -> Loss:
        """Loss of a reading's whitened residual."""

    def moved(self, mean: Array, covariance: Array, interval_s: float) -> Moved:
        """Linearise the motion about a belief."""


class Terms(NamedTuple):
    """All that is linear about a path: the rows of each time, and each step."""

    rows: list[list[Rows]]  # K
    steps: list[Moved]  # K - 1


class PlainStretch(NamedTuple):
    """Any measurements, several of a time or none, and the times they are of."""

    problem: Linear
    times_s: Array  # (K,)
    measurements: tuple[tuple[Any, ...], ...]  # K

    @property
    def empty(self) -> bool:
        """Whether there is no measurement at all."""
        return not any(self.measurements)

    def settle(self, path: Array, spreads: Array, anchor: Anchor, iterations: int, tolerance: float) -> Descent:
        """Descend from a path to one of least cost, as the compiled ``optimise``; ``spreads`` are of its states."""
        path, (K, d) = path.copy(), path.shape
        L, Y = np.empty((K, d, d)), np.empty((K - 1, d, d))
        terms = self._terms(path, spreads)
        weights = _inverse_noises(terms, d)
        cost, damping, taken, settled = self._cost(path, terms, weights, anchor), 0.0, 0, False
        while taken < iterations and not settled and damping < MOST_DAMPING:
            taken += 1
            A, B, g = self._normal(path, terms, weights, anchor)
            while damping < MOST_DAMPING:
                if factorise(A, B, damping, L, Y):
                    step = solve(L, Y, g)
                    length2 = float((step * g).sum())
                    settled = length2 < tolerance * tolerance
                    if settled:
                        path, cost = path + step, cost - 0.5 * length2
                        break
                    ahead = self._terms(path + step, spreads)
                    trial = self._cost(path + step, ahead, weights, anchor)
                    if trial <= cost:
                        damping = damping / 10 if damping > LEAST_DAMPING else 0.0
                        path, cost, terms = path + step, trial, ahead
                        break
                damping = max(damping * 10, 1e-6)
            if not settled:
                # a noise may move with the path
                weights = _inverse_noises(terms, d)
                cost = self._cost(path, terms, weights, anchor)
        if not settled:
            A, B, g = self._normal(path, terms, weights, anchor)
        if not settled or damping > 0.0:
            factorise(A, B, 0.0, L, Y)
        return Descent(path, L, Y, cost, taken, settled)

    def summed_out(self, path: Array, spreads: Array, anchor: Anchor) -> Anchor:
        """Return what the first time's measurements, and all before, say of the second state."""
        first = self._replace(times_s=self.times_s[:2], measurements=(self.measurements[0], ()))
        terms = first._terms(path[:2], spreads[:2])
        weights = _inverse_noises(terms, path.shape[1])
        A, B, g = first._normal(path[:2], terms, weights, anchor)
        gain = np.linalg.solve(A[0], B[0].T).T
        return Anchor(path[1].copy(), A[1] - gain @ B[0].T, g[1] - gain @ g[0])

    def rest(self) -> PlainStretch:
        """Return the stretch without its first time."""
        return self._replace(times_s=self.times_s[1:], measurements=self.measurements[1:])

    def joined(self, time_s: float, measurement: Any | None) -> PlainStretch:
        """Return the stretch with a measurement more, at its last time or at a later one."""
        new = () if measurement is None else (measurement,)
        if len(self.times_s) and time_s == self.times_s[-1]:
            return self._replace(measurements=(*self.measurements[:-1], self.measurements[-1] + new))
        return self._replace(times_s=np.append(self.times_s, time_s), measurements=(*self.measurements, new))

    def log_scale(self, path: Array, spreads: Array) -> float:
        """Logarithm of the steps' and the readings' densities where their residuals are nought, as compiled."""
        terms, loss = self._terms(path, spreads), self.problem.robust
        total = -0.5 * sum(float(np.linalg.slogdet(step.Q)[1]) for step in terms.steps)
        for rows in (rows for time in terms.rows for rows in time):
            sizes = np.unique(rows.part, return_counts=True)[1]
            total += rows.log_scale - sum(log_norm(loss, int(size)) for size in sizes)
        return total

    def _terms(self, path: Array, spreads: Array) -> Terms:
        sensor, moved = self.problem.sensor, self.problem.moved
        rows = [
            [linearised(sensor, state, m) for m in time] for state, time in zip(path, self.measurements, strict=True)
        ]
        steps = [moved(path[k], spreads[k], float(T)) for k, T in enumerate(np.diff(self.times_s))]
        return Terms(rows, steps)

    def _cost(self, path: Array, terms: Terms, weights: Array, anchor: Anchor) -> float:
        shift = path[0] - anchor.at
        cost = 0.5 * shift @ anchor.information @ shift - anchor.pull @ shift
        for rows in (rows for time in terms.rows for rows in time):
            cost += sum(loss for loss, _, _ in _readings(rows, self.problem.robust))
        for k, step in enumerate(terms.steps):
            error = path[k + 1] - step.mean
            cost += 0.5 * error @ weights[k] @ error
        return float(cost)

    def _normal(self, path: Array, terms: Terms, weights: Array, anchor: Anchor) -> tuple[Array, Array, Array]:
        """Blocks of the normal equations on the diagonal and below it, and minus the gradient."""
        K, d = path.shape
        A, B, g = np.zeros((K, d, d)), np.zeros((K - 1, d, d)), np.zeros((K, d))
        A[0] += anchor.information
        g[0] += anchor.pull - anchor.information @ (path[0] - anchor.at)
        for k, time in enumerate(terms.rows):
            for rows in time:
                for _, weight, own in _readings(rows, self.problem.robust):
                    A[k] += weight * rows.H[own].T @ rows.H[own]
                    g[k] += weight * rows.H[own].T @ rows.residual[own]
        for k, step in enumerate(terms.steps):
            pushed, error = weights[k] @ step.F, weights[k] @ (path[k + 1] - step.mean)
            A[k] += step.F.T @ pushed
            A[k + 1] += weights[k]
            B[k] = -pushed
            g[k] += step.F.T @ error
            g[k + 1] -= error
        return A, B, g


def _readings(rows: Rows, loss: Loss) -> list[tuple[float, float, Array]]:
    """Half the loss of each reading, the weight of its rows, and which these are."""
    found = []
    for part in np.unique(rows.part):
        own = rows.part == part
        found.append((*loss_of(float(rows.residual[own] @ rows.residual[own]), loss.kind, loss.k), own))
    return found


def _inverse_noises(terms: Terms, d: int) -> Array:
    return np.array([np.linalg.inv(step.Q) for step in terms.steps]).reshape(-1, d, d)
