"""Compiled kernels of the extended and the iterated Kalman filter on bearings, and of the smoother behind them.

Bell and Cathey (1993), IEEE Trans. Automat. Contr. 38(2): the iterated update is Gauss-Newton. Angles come one by one,
since their noises are independent. A robust loss scales the gain, as Masreliez and Martin (1977), IEEE Trans. Automat.
Contr. 22(3), do. Rauch, Tung and Striebel (1965) for the smoother.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from elusive._kernels import add_product, add_rows, copy_row, copy_rows
from elusive._njit import njit
from elusive.contracts import Array, X, Y
from elusive.filters.gaussian._bearing_kernels import FRONT, HEIGHT, bearing_rows, curvature, loss_of, move
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
    low, high = table.first[time], table.first[time + 1]
    d, most = len(mean), 2 * (high - low)
    residual, H, noise, part = np.empty(most), np.empty((most, d)), np.empty(most), np.empty(most, np.intp)
    prior_mean, prior, at = mean.copy(), covariance.copy(), at.copy()
    log_density = 0.0
    for iteration in range(iterations):
        # how far the state may lie from where the bearings are linearised
        spread = covariance[X, X] + covariance[Y, Y]
        if transitions.solid:
            spread += covariance[HEIGHT, HEIGHT]
        copy_row(mean, prior_mean)
        copy_rows(covariance, prior)
        n = FRONT
        for row in range(low, high):
            count = bearing_rows(table, row, at, transitions, residual, H, n)
            variance = table.variance[row] + curvature(table, row, at, spread, transitions.solid) ** 2
            for i in range(n, n + count):
                noise[i], part[i] = variance, row
            n += count
        log_density = absorb(residual, H, noise, part, n, at, loss, iteration == 0, mean, covariance)
        if advance(at, mean, covariance, iteration):
            break
    return log_density


@njit(cache=True, nogil=True)
def absorb(
    residual: Array,
    H: Array,
    noise: Array,
    part: NDArray[np.intp],
    n: int,
    at: Array,
    loss: Loss,
    first: bool,
    mean: Array,
    covariance: Array,
) -> float:
    """Update a belief, in place, with n rows linearised at ``at``, of independent noise; return their log density.

    Rows of one ``part``, next to each other, share a robust weight; ``first`` says that ``at`` is the prediction.
    """
    d = len(mean)
    PH = np.empty(d)
    log_density, start = 0.0, 0
    while start < n:
        stop = start + 1
        while stop < n and (part[stop] == part[start] or not loss.kind):
            stop += 1
        weight = 1.0
        if loss.kind:
            squared = 0.0
            for r in range(start, stop):
                if first:
                    # as far as the belief may be wrong: later as far as the bearing itself, as in a descent
                    innovation, predicted = _expected(residual, H, r, at, mean, covariance, PH)
                    squared += innovation * innovation / (predicted + noise[r])
                else:
                    squared += residual[r] ** 2 / noise[r]
            weight = max(loss_of(squared, loss.kind, loss.k)[1], 1e-6)
        for r in range(start, stop):
            innovation, predicted = _expected(residual, H, r, at, mean, covariance, PH)
            # at first the whole gain is scaled: a vague belief would follow a stray of any larger noise
            variance = (noise[r] + predicted) / weight if first else noise[r] / weight + predicted
            information = 1.0 / variance
            for i in range(d):
                gain = PH[i] * information
                mean[i] += gain * innovation
                for j in range(i + 1):
                    covariance[i, j] -= gain * PH[j]
                    covariance[j, i] = covariance[i, j]
            log_density -= 0.5 * (innovation * innovation * information + math.log(variance) + LOG_TURN)
        start = stop
    return log_density


@njit(inline="always")  # a call costs as much as its work
def _expected(
    residual: Array, H: Array, r: int, at: Array, mean: Array, covariance: Array, PH: Array
) -> tuple[float, float]:
    """Innovation of row r and its variance without the noise; write the covariance's product with the row."""
    innovation, predicted = residual[r], 0.0
    for i in range(len(mean)):
        innovation += H[r, i] * (at[i] - mean[i])
        total = 0.0
        for j in range(len(mean)):
            total += covariance[i, j] * H[r, j]
        PH[i] = total
        predicted += H[r, i] * total
    return innovation, predicted


@njit(cache=True, nogil=True, inline="always")
def advance(at: Array, mean: Array, covariance: Array, iteration: int) -> bool:
    """Move the place of linearisation, in place, towards the updated mean; True: it is there already."""
    squared = 0.0
    for i in range(len(at)):
        squared += (mean[i] - at[i]) ** 2 / covariance[i, i]
    if squared < SETTLED:
        return True
    share = 1.0 if iteration < FULL_STEPS else 0.5
    for i in range(len(at)):
        at[i] += share * (mean[i] - at[i])
    return False


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
    started: int,
    means: Array,
    covariances: Array,
    log_densities: Array,
) -> None:
    """Filter from time ``started``, whose belief is given, to the last one, in place."""
    F = np.empty_like(covariances[0])
    for k in range(started + 1, len(means)):
        mean, covariance = predict(transitions, k - 1, means[k - 1], covariances[k - 1], F)
        log_densities[k] = update(table, k, transitions, loss, iterations, mean, mean, covariance)
        copy_row(means[k], mean)
        copy_rows(covariances[k], covariance)


@njit(cache=True, nogil=True)
def smoothed(transitions: Transitions, started: int, means: Array, covariances: Array) -> None:
    """Smooth filtered beliefs, in place, back to time ``started``."""
    F = np.empty_like(covariances[0])
    d = len(F)
    for k in range(len(means) - 2, started - 1, -1):
        mean, predicted = predict(transitions, k, means[k], covariances[k], F)
        root = predicted.copy()
        cholesky(root)
        gain = covariances[k] @ F.T
        for i in range(d):
            forward(root, gain[i])
            backward(root, gain[i])
        add_product(means[k], 1.0, gain @ (means[k + 1] - mean))
        add_rows(covariances[k], gain @ (covariances[k + 1] - predicted) @ gain.T)


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
        copy_row(means[k], path[k] + turned @ (means[k + 1] - path[k + 1]))
        copy_rows(covariances[k], alone[k] + turned @ (covariances[k + 1] - alone[k + 1]) @ gain)
