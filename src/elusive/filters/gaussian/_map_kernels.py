"""Compiled kernels of maximum a posteriori paths: cost, normal equations, Gauss-Newton with Levenberg's damping.

Dellaert and Kaess (2017), Factor graphs for robot perception, chapters 2 and 3; Nocedal and Wright (2006), 10.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from elusive._kernels import add_product, add_rows, copy_rows
from elusive._njit import njit
from elusive.contracts import Array
from elusive.filters.gaussian._bearing_kernels import FRONT, bearing_rows, line_rows, loss_of, move
from elusive.filters.gaussian._block_kernels import cholesky, factorise, inverse, solve
from elusive.filters.gaussian.transitions import Transitions
from elusive.sensors.bearing_table import BearingTable

LEAST_DAMPING, MOST_DAMPING = 1e-12, 1e12
NO_RANGES = np.empty(0)  # of bearings that are angles; inside a kernel a global array would be another type


class Anchor(NamedTuple):
    """What is known of the first state beside the bearings: ``(s - at)' information (s - at) / 2 - pull' (s - at)``."""

    at: Array  # (d,)
    information: Array  # (d, d)
    pull: Array  # (d,)


class Loss(NamedTuple):
    """Robust loss of a bearing's whitened residual, both its angles together."""

    kind: int  # 0 squares, 1 Cauchy, 2 Huber
    k: float


class Descent(NamedTuple):
    """A path of least cost, and Cholesky's factor of its normal equations."""

    path: Array  # (K, d)
    L: Array  # (K, d, d)
    Y: Array  # (K - 1, d, d)
    cost: float
    iterations: int
    converged: bool


@njit(cache=True, nogil=True)
def inverse_noise(transitions: Transitions) -> Array:
    """Inverse of each Q of the tables, ``(U, d, d)``."""
    W = transitions.Q.copy()
    for which in range(len(W)):
        cholesky(W[which])
        copy_rows(W[which], inverse(W[which]))
    return W


@njit(cache=True, nogil=True)
def cost_of(
    path: Array, at: Array, table: BearingTable, ranges: Array, T: Transitions, W: Array, anchor: Anchor, loss: Loss
) -> float:
    """Half the sum of squares of a path, its bearings' robust; the noise of a turn is that at the path ``at``."""
    d = path.shape[1]
    moved, F, Q, residual, H = np.empty(d), np.empty((d, d)), np.empty((d, d)), np.empty(2), np.empty((2, d))
    shift = path[0] - anchor.at
    cost = 0.5 * shift @ anchor.information @ shift - anchor.pull @ shift
    for k in range(len(path)):
        for row in range(table.first[k], table.first[k + 1]):
            if len(ranges):
                count = line_rows(table, row, path[k], T, ranges[row], residual, H)
            else:
                count = bearing_rows(table, row, path[k], T, residual, H, FRONT)
            squared = 0.0
            for i in range(count):
                squared += residual[i] ** 2 / table.variance[row]
            cost += loss_of(squared, loss.kind, loss.k)[0]
        if k + 1 < len(path):
            weight = W[T.which[k]]
            if T.turn >= 0:
                move(T, k, at[k], moved, F, Q)
                cholesky(Q)
                weight = inverse(Q)
            move(T, k, path[k], moved, F, Q)
            for i in range(d):
                for j in range(d):
                    cost += 0.5 * (path[k + 1, i] - moved[i]) * weight[i, j] * (path[k + 1, j] - moved[j])
    return float(cost)


@njit(cache=True, nogil=True)
def linearise(
    path: Array,
    table: BearingTable,
    ranges: Array,
    T: Transitions,
    W: Array,
    anchor: Anchor,
    loss: Loss,
    A: Array,
    B: Array,
    g: Array,
) -> None:
    """Write the normal equations of a path: blocks of the diagonal, blocks below it, and minus the gradient."""
    d = path.shape[1]
    moved, F, Q, residual, H = np.empty(d), np.empty((d, d)), np.empty((d, d)), np.empty(2), np.empty((2, d))
    error = np.empty(d)
    A[:] = 0.0
    g[:] = 0.0
    add_rows(A[0], anchor.information)
    add_product(g[0], 1.0, anchor.pull - anchor.information @ (path[0] - anchor.at))
    for k in range(len(path)):
        for row in range(table.first[k], table.first[k + 1]):
            if len(ranges):
                count = line_rows(table, row, path[k], T, ranges[row], residual, H)
            else:
                count = bearing_rows(table, row, path[k], T, residual, H, FRONT)
            squared = 0.0
            for i in range(count):
                squared += residual[i] ** 2 / table.variance[row]
            weight = loss_of(squared, loss.kind, loss.k)[1] / table.variance[row]
            for r in range(count):
                for i in range(d):
                    if H[r, i] != 0.0:
                        g[k, i] += weight * H[r, i] * residual[r]
                        for j in range(d):
                            A[k, i, j] += weight * H[r, i] * H[r, j]
        if k + 1 < len(path):
            move(T, k, path[k], moved, F, Q)
            noise = W[T.which[k]]
            if T.turn >= 0:
                cholesky(Q)
                noise = inverse(Q)
            for i in range(d):
                for j in range(d):
                    total = 0.0
                    for m in range(d):
                        total += noise[i, m] * F[m, j]
                    B[k, i, j] = -total
                    A[k + 1, i, j] += noise[i, j]
            for i in range(d):
                total = 0.0
                for m in range(d):
                    total += noise[i, m] * (path[k + 1, m] - moved[m])
                error[i] = total
                g[k + 1, i] -= total
            for i in range(d):
                for m in range(d):
                    if F[m, i] != 0.0:
                        g[k, i] += F[m, i] * error[m]
                        for j in range(d):
                            A[k, i, j] -= F[m, i] * B[k, m, j]


@njit(cache=True, nogil=True)
def optimise(
    path: Array,
    table: BearingTable,
    ranges: Array,
    T: Transitions,
    W: Array,
    anchor: Anchor,
    loss: Loss,
    iterations: int,
    tolerance: float,
    L: Array,
    Y: Array,
) -> tuple[float, int, bool]:
    """Descend from a path, in place, to one of least cost; leave the factor of the least damped equations there.

    Returns the cost, the iterations taken and whether the last step was smaller than ``tolerance`` of the state's
    deviation.
    """
    A, B, g = np.empty_like(L), np.empty_like(Y), np.empty_like(path)
    damping, taken, settled = 0.0, 0, False
    cost = cost_of(path, path, table, ranges, T, W, anchor, loss)
    while taken < iterations and not settled and damping < MOST_DAMPING:
        taken += 1
        linearise(path, table, ranges, T, W, anchor, loss, A, B, g)
        while damping < MOST_DAMPING:
            if factorise(A, B, damping, L, Y):
                step = solve(L, Y, g)
                # the square of the step's length in deviations
                length2 = (step * g).sum()
                settled = length2 < tolerance * tolerance
                if settled:
                    # so short a step follows the parabola, and the curvature stays
                    path += step
                    cost -= 0.5 * length2
                    break
                trial = cost_of(path + step, path, table, ranges, T, W, anchor, loss)
                if trial <= cost:
                    damping = damping / 10 if damping > LEAST_DAMPING else 0.0
                    path += step
                    cost = trial
                    break
            damping = max(damping * 10, 1e-6)
        if T.turn >= 0 and not settled:
            # the noise of a turn moves with the path
            cost = cost_of(path, path, table, ranges, T, W, anchor, loss)
    if not settled:
        linearise(path, table, ranges, T, W, anchor, loss, A, B, g)
    if not settled or damping > 0.0:
        damping = 0.0
        # where hardly any noise moves a state between times, rounding makes the equations singular
        while not factorise(A, B, damping, L, Y) and damping < MOST_DAMPING:
            damping = max(damping * 10, LEAST_DAMPING)
    return cost, taken, settled
