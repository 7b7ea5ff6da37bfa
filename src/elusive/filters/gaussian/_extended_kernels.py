"""Compiled kernels of the extended and the iterated Kalman filter on bearings, and of the smoother behind them.

Bell and Cathey (1993), IEEE Trans. Automat. Contr. 38(2): the iterated update is Gauss-Newton. Angles come one by one,
since their noises are independent. A robust loss scales the gain, as Masreliez and Martin (1977), IEEE Trans. Automat.
Contr. 22(3), do. Rauch, Tung and Striebel (1965) for the smoother.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from elusive.contracts import Array, X, Y
from elusive.filters.gaussian._bearing_kernels import HEIGHT, bearing_rows, curvature, loss_of, move
from elusive.filters.gaussian._block_kernels import backward, cholesky, forward, marginals
from elusive.filters.gaussian._map_kernels import Loss
from elusive.filters.gaussian.transitions import Transitions
from elusive.sensors.bearing_table import BearingTable

LOG_TURN = math.log(2 * math.pi)
SETTLED = 1e-9  # squared length of the last step, in deviations, that ends the iteration
FULL_STEPS = 4  # after which the steps are halved: a Gauss-Newton step near a sensor may overshoot for ever


@njit(cache=True, nogil=True)
def update(
    table: BearingTable,
    time: int,
    transitions: Transitions,
    loss: Loss,
    iterations: int,
    at: Array,
    mean: Array,
    covariance: Array,
) -> float:
    """Update a belief, in place, with the bearings of a time, linearised first at ``at``; return their log density."""
    d = len(mean)
    residual, H, PH = np.empty(2), np.empty((2, d)), np.empty(d)
    prior_mean, prior, at = mean.copy(), covariance.copy(), at.copy()
    log_density = 0.0
    for iteration in range(iterations):
        # how far the state may lie from where the bearings are linearised
        spread = covariance[X, X] + covariance[Y, Y]
        if transitions.solid:
            spread += covariance[HEIGHT, HEIGHT]
        mean[:], covariance[:] = prior_mean, prior
        log_density = 0.0
        for row in range(table.first[time], table.first[time + 1]):
            count = bearing_rows(table, row, at, transitions, residual, H)
            noise = table.variance[row] + curvature(table, row, at, spread, transitions.solid) ** 2
            weight = 1.0
            if loss.kind:
                # at first as far as the belief may be wrong, then as far as the bearing itself
                if iteration == 0:
                    weight = _weight(residual, H, count, at, mean, covariance, noise, loss)
                else:
                    weight = _own_weight(residual, count, noise, loss)
            for r in range(count):
                innovation = residual[r]
                for i in range(d):
                    innovation += H[r, i] * (at[i] - mean[i])
                predicted = 0.0
                for i in range(d):
                    PH[i] = 0.0
                    for j in range(d):
                        PH[i] += covariance[i, j] * H[r, j]
                    predicted += H[r, i] * PH[i]
                # at first the whole gain is scaled: a vague belief would follow a stray of any larger noise
                variance = (noise + predicted) / weight if iteration == 0 else noise / weight + predicted
                for i in range(d):
                    mean[i] += PH[i] * innovation / variance
                    for j in range(i + 1):
                        covariance[i, j] -= PH[i] * PH[j] / variance
                        covariance[j, i] = covariance[i, j]
                log_density -= 0.5 * (innovation * innovation / variance + math.log(variance) + LOG_TURN)
        if _moved(at, mean, covariance) < SETTLED:
            break
        share = 1.0 if iteration < FULL_STEPS else 0.5
        for i in range(d):
            at[i] += share * (mean[i] - at[i])
    return log_density


@njit(cache=True, nogil=True)
def _weight(
    residual: Array, H: Array, count: int, at: Array, mean: Array, covariance: Array, noise: float, loss: Loss
) -> float:
    """Weight of a bearing that lies far from where the belief, as sure as it is, expects it."""
    squared = 0.0
    for r in range(count):
        innovation = residual[r] + H[r] @ (at - mean)
        squared += innovation * innovation / (H[r] @ covariance @ H[r] + noise)
    return max(loss_of(squared, loss.kind, loss.k)[1], 1e-6)


@njit(cache=True, nogil=True)
def _own_weight(residual: Array, count: int, noise: float, loss: Loss) -> float:
    """Weight of a bearing that lies far from the estimate of the last iteration, as in a descent."""
    squared = 0.0
    for r in range(count):
        squared += residual[r] ** 2 / noise
    return max(loss_of(squared, loss.kind, loss.k)[1], 1e-6)


@njit(cache=True, nogil=True)
def _moved(at: Array, mean: Array, covariance: Array) -> float:
    total = 0.0
    for i in range(len(at)):
        total += (mean[i] - at[i]) ** 2 / covariance[i, i]
    return total


@njit(cache=True, nogil=True)
def predict(transitions: Transitions, step: int, mean: Array, covariance: Array, F: Array) -> tuple[Array, Array]:
    """Carry a belief one step on; write the Jacobian of that."""
    moved, Q = np.empty_like(mean), np.empty_like(covariance)
    move(transitions, step, mean, moved, F, Q)
    return moved, F @ covariance @ F.T + Q


@njit(cache=True, nogil=True)
def filtered(
    table: BearingTable,
    transitions: Transitions,
    loss: Loss,
    iterations: int,
    begun: int,
    means: Array,
    covariances: Array,
    log_densities: Array,
) -> None:
    """Filter from time ``begun``, whose belief is given, to the last one, in place."""
    F = np.empty_like(covariances[0])
    for k in range(begun + 1, len(means)):
        mean, covariance = predict(transitions, k - 1, means[k - 1], covariances[k - 1], F)
        log_densities[k] = update(table, k, transitions, loss, iterations, mean, mean, covariance)
        means[k], covariances[k] = mean, covariance


@njit(cache=True, nogil=True)
def smoothed(transitions: Transitions, begun: int, means: Array, covariances: Array) -> None:
    """Smooth filtered beliefs, in place, back to time ``begun``."""
    F = np.empty_like(covariances[0])
    d = len(F)
    for k in range(len(means) - 2, begun - 1, -1):
        mean, predicted = predict(transitions, k, means[k], covariances[k], F)
        root = predicted.copy()
        cholesky(root)
        gain = covariances[k] @ F.T
        for i in range(d):
            forward(root, gain[i])
            backward(root, gain[i])
        means[k] += gain @ (means[k + 1] - mean)
        covariances[k] += gain @ (covariances[k + 1] - predicted) @ gain.T


@njit(cache=True, nogil=True)
def smoothed_start(path: Array, L: Array, Y: Array, means: Array, covariances: Array) -> None:
    """Carry what later bearings say of the last of the first states back to the others, in place."""
    alone = marginals(L, Y)
    for k in range(len(means) - 2, -1, -1):
        gain = -Y[k].T.copy()
        for column in range(len(gain)):
            # a row of the gain's transpose is a column of L^-T Y
            backward(L[k], gain[column])
        turned = gain.T.copy()
        means[k] = path[k] + turned @ (means[k + 1] - path[k + 1])
        covariances[k] = alone[k] + turned @ (covariances[k + 1] - alone[k + 1]) @ gain
