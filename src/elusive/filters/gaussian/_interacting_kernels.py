"""Compiled kernel of interacting multiple models: mixing, a bank of extended filters, probabilities of the models.

Blom and Bar-Shalom (1988), IEEE Trans. Automat. Contr. 33(8). What a model lacks in its state is taken from the model
that it is mixed into: Granstrom, Willett and Bar-Shalom (2015), IEEE Trans. Aerosp. Electron. Syst. 51(4).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array
from elusive.filters.gaussian._extended_kernels import predict, update
from elusive.filters.gaussian._map_kernels import Loss
from elusive.filters.gaussian.transitions import Transitions
from elusive.sensors.bearing_table import BearingTable


class Bank(NamedTuple):
    """A belief for each of m models over all components that some model has, U of them."""

    probabilities: Array  # (m,)
    means: Array  # (m, U)
    covariances: Array  # (m, U, U)


@njit(cache=True, nogil=True)
def mixed(bank: Bank, columns: NDArray[np.intp], sizes: NDArray[np.intp], stays: float) -> Bank:
    """Return the beliefs that the models start a step from, and the probabilities that they do.

    ``columns[j]`` begins with the ``sizes[j]`` components that model j has.
    """
    m, whole = bank.means.shape
    if m == 1:
        stays = 1.0
    has = np.zeros((m, whole), np.bool_)
    for j in range(m):
        has[j, columns[j, : sizes[j]]] = True
    leaves = (1.0 - stays) / max(m - 1, 1)  # each other model is as likely
    probabilities = np.zeros(m)
    means, covariances = np.zeros_like(bank.means), np.zeros_like(bank.covariances)
    for j in range(m):
        for i in range(m):
            probabilities[j] += bank.probabilities[i] * (stays if i == j else leaves)
        each = np.zeros((m, whole))
        for i in range(m):
            share = bank.probabilities[i] * (stays if i == j else leaves) / probabilities[j]
            for c in range(whole):
                each[i, c] = bank.means[i, c] if has[i, c] else bank.means[j, c]
                means[j, c] += share * each[i, c]
        for i in range(m):
            share = bank.probabilities[i] * (stays if i == j else leaves) / probabilities[j]
            for c in columns[j, : sizes[j]]:
                for e in columns[j, : sizes[j]]:
                    spread = (each[i, c] - means[j, c]) * (each[i, e] - means[j, e])
                    if has[i, c] and has[i, e]:
                        spread += bank.covariances[i, c, e]
                    elif not has[i, c] and not has[i, e]:
                        spread += bank.covariances[j, c, e]
                    covariances[j, c, e] += share * spread
    return Bank(probabilities, means, covariances)


@njit(cache=True, nogil=True)
def advanced(
    bank: Bank,
    table: BearingTable,
    time: int,
    step: int,
    models: tuple[Transitions, ...],
    columns: NDArray[np.intp],
    sizes: NDArray[np.intp],
    memory_s: float,
    loss: Loss,
    iterations: int,
) -> tuple[Bank, float]:
    """Return the beliefs after a step and the measurements at its end, and the log density of these."""
    started = mixed(bank, columns, sizes, math.exp(-models[0].interval_s[step] / memory_s))
    m = len(sizes)
    log_evidence = np.empty(m)
    for j in range(m):
        d = sizes[j]
        mean, covariance, F = np.empty(d), np.empty((d, d)), np.empty((d, d))
        for c in range(d):
            mean[c] = started.means[j, columns[j, c]]
            for e in range(d):
                covariance[c, e] = started.covariances[j, columns[j, c], columns[j, e]]
        mean, covariance = predict(models[j], step, mean, covariance, F)
        log_evidence[j] = update(table, time, models[j], loss, iterations, mean, mean, covariance)
        for c in range(d):
            started.means[j, columns[j, c]] = mean[c]
            for e in range(d):
                started.covariances[j, columns[j, c], columns[j, e]] = covariance[c, e]
    most = log_evidence.max()
    weight = started.probabilities * np.exp(log_evidence - most)
    total = weight.sum()
    return Bank(weight / total, started.means, started.covariances), most + math.log(total)


@njit(cache=True, nogil=True)
def combined(bank: Bank, common: NDArray[np.intp]) -> tuple[Array, Array]:
    """Mean and covariance of the components that all models have."""
    n = len(common)
    mean, covariance = np.zeros(n), np.zeros((n, n))
    for j in range(len(bank.means)):
        mean += bank.probabilities[j] * bank.means[j][common]
    for j in range(len(bank.means)):
        away = bank.means[j][common] - mean
        for c in range(n):
            for e in range(n):
                spread = bank.covariances[j, common[c], common[e]] + away[c] * away[e]
                covariance[c, e] += bank.probabilities[j] * spread
    return mean, covariance
