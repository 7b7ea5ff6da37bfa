"""Compiled kernel of a sliding window: the first state is summed out, and what it said stays on the second.

Sibley, Matthies and Sukhatme (2010), J. Field Robotics 27(5), section 3: the Schur complement of the normal equations.
"""

from __future__ import annotations

import numpy as np

from elusive._njit import njit
from elusive.contracts import Array
from elusive.filters.gaussian._bearing_kernels import FRONT, bearing_rows, loss_of, move
from elusive.filters.gaussian._block_kernels import backward, cholesky, forward, inverse
from elusive.filters.gaussian._map_kernels import Anchor, Loss
from elusive.filters.gaussian.transitions import Transitions
from elusive.sensors.bearing_table import BearingTable


@njit(cache=True, nogil=True)
def summed_out(path: Array, table: BearingTable, T: Transitions, W: Array, anchor: Anchor, loss: Loss) -> Anchor:
    """Return what the bearings of the first time, and all before, say of the second state, linearised at the path."""
    d = path.shape[1]
    moved, F, Q, residual, H = np.empty(d), np.empty((d, d)), np.empty((d, d)), np.empty(2), np.empty((2, d))
    move(T, 0, path[0], moved, F, Q)
    noise = W[T.which[0]]
    if T.turn >= 0:
        cholesky(Q)
        noise = inverse(Q)
    pushed = noise @ F
    error = noise @ (path[1] - moved)
    A = anchor.information + F.T @ pushed
    g = anchor.pull - anchor.information @ (path[0] - anchor.at) + F.T @ error
    for row in range(table.first[0], table.first[1]):
        count = bearing_rows(table, row, path[0], T, residual, H, FRONT)
        squared = 0.0
        for i in range(count):
            squared += residual[i] ** 2 / table.variance[row]
        weight = loss_of(squared, loss.kind, loss.k)[1] / table.variance[row]
        for r in range(count):
            g += weight * residual[r] * H[r]
            A += weight * np.outer(H[r], H[r])
    cholesky(A)
    for i in range(d):
        forward(A, pushed[i])
        backward(A, pushed[i])
    # pushed is now W F A^-1
    return Anchor(path[1].copy(), noise - pushed @ F.T @ noise, pushed @ g - error)
