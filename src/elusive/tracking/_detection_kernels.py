"""Compiled kernels of the tracker of detections: marginal association, and what detections say of particles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._kernels import exponentiate
from elusive._njit import njit
from elusive.contracts import Array

GREATEST = 600.0  # logarithm up to which odds of an association are told apart


@njit(cache=True, nogil=True, error_model="numpy")
def associate(
    target: NDArray[np.int64],
    detection: NDArray[np.int64],
    log_odds: Array,
    targets: int,
    detections: int,
    tolerance: float,
    most: int,
) -> tuple[Array, Array, Array]:
    """Marginal probabilities of association, by loopy belief propagation: Williams and Lau (2014), figure 4.

    Pair e joins ``target[e]`` and ``detection[e]`` with odds ``exp(log_odds[e])`` against a missed target and a
    detection of nothing known. Returns the probability of each pair, that each target was missed, ``(targets,)``, and
    that each detection is of none of them, ``(detections,)``. Ends where no message changes by more than the tolerance.
    """
    pairs = len(log_odds)
    odds, greatest = np.empty(pairs), np.full(detections, -np.inf)
    for e in range(pairs):
        greatest[detection[e]] = max(greatest[detection[e]], log_odds[e])
    for e in range(pairs):
        odds[e] = np.exp(log_odds[e] - max(0.0, greatest[detection[e]] - GREATEST))
    to_target, to_detection = np.ones(pairs), np.empty(pairs)
    by_target, by_detection = np.empty(targets), np.empty(detections)
    for _ in range(most):
        by_target[:] = 1.0
        for e in range(pairs):
            by_target[target[e]] += odds[e] * to_target[e]
        by_detection[:] = 1.0
        for e in range(pairs):
            to_detection[e] = odds[e] / max(by_target[target[e]] - odds[e] * to_target[e], 1.0)
            by_detection[detection[e]] += to_detection[e]
        smallest = largest = 1.0
        for e in range(pairs):
            after = 1.0 / max(by_detection[detection[e]] - to_detection[e], 1.0)
            change = after / to_target[e]
            smallest, largest = min(smallest, change), max(largest, change)
            to_target[e] = after
        if max(-np.log(smallest), np.log(largest)) <= tolerance:
            break
    by_target[:] = 1.0
    for e in range(pairs):
        by_target[target[e]] += odds[e] * to_target[e]
    share = np.empty(pairs)
    for e in range(pairs):
        share[e] = odds[e] * to_target[e] / by_target[target[e]]
    by_detection[:] = 1.0
    for e in range(pairs):
        by_detection[detection[e]] += to_detection[e]
    return share, 1.0 / by_target, 1.0 / by_detection


@njit(cache=True, nogil=True, error_model="numpy")
def associate_few(
    target: NDArray[np.int64], detection: NDArray[np.int64], log_odds: Array, targets: int, detections: int
) -> tuple[Array, Array, Array, bool]:
    """Marginal probabilities as of :func:`associate`, exact, by a sum over the sets of detections that are taken.

    Pairs come in the order of their targets. Time and memory grow as ``2^detections``; the last value tells whether
    the numbers stayed in range.
    """
    pairs, sets = len(log_odds), 1 << detections
    starts = np.zeros(targets + 1, np.int64)
    for e in range(pairs):
        starts[target[e] + 1] += 1
    for i in range(targets):
        starts[i + 1] += starts[i]
    made, none = np.empty(pairs), np.empty(targets)
    for i in range(targets):
        best = 0.0
        for e in range(starts[i], starts[i + 1]):
            best = max(best, log_odds[e])
        none[i] = np.exp(-best)
        for e in range(starts[i], starts[i + 1]):
            made[e] = np.exp(log_odds[e] - best)
    before, after = np.zeros((targets + 1, sets)), np.zeros((targets + 1, sets))
    before[0, 0] = 1.0
    for i in range(targets):
        for taken in range(sets):
            here = before[i, taken]
            if here == 0.0:
                continue
            before[i + 1, taken] += here * none[i]
            for e in range(starts[i], starts[i + 1]):
                bit = 1 << detection[e]
                if taken & bit == 0:
                    before[i + 1, taken | bit] += here * made[e]
    after[targets, :] = 1.0
    share, missed, unclaimed = np.zeros(pairs), np.zeros(targets), np.zeros(detections)
    total = before[targets].sum()
    for i in range(targets - 1, -1, -1):
        for taken in range(sets):
            later = none[i] * after[i + 1, taken]
            missed[i] += before[i, taken] * later / total
            for e in range(starts[i], starts[i + 1]):
                bit = 1 << detection[e]
                if taken & bit == 0:
                    part = made[e] * after[i + 1, taken | bit]
                    share[e] += before[i, taken] * part / total
                    later += part
            after[i, taken] = later
    for taken in range(sets):
        for j in range(detections):
            if taken & (1 << j) == 0:
                unclaimed[j] += before[targets, taken] / total
    return share, missed, unclaimed, total > 1e-280


@njit(cache=True, nogil=True, error_model="numpy")
def clusters(
    target: NDArray[np.int64], detection: NDArray[np.int64], targets: int, detections: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the cluster of each target and each detection: what pairs join, directly or through others."""
    root = np.arange(targets + detections)
    for e in range(len(target)):
        a, b = target[e], targets + detection[e]
        while root[a] != a:
            a = root[a]
        while root[b] != b:
            b = root[b]
        root[max(a, b)] = min(a, b)
    for k in range(len(root)):  # a root stands before all that it stands for
        root[k] = root[root[k]]
    return root[:targets], root[targets:]


@njit(cache=True, nogil=True, error_model="numpy")
def explanations(log_densities: Array, detected: Array) -> tuple[Array, Array]:
    """Likelihood of each particle, ``(k + 1, N)``, if its target was missed, and if it made each detection.

    ``log_densities`` is ``(N, k)``. The rows of detections are scaled by their greatest; the other has the
    scales' logarithms, ``(k + 1,)``: minus infinity where no particle explains a detection, NaN where a density is
    NaN or infinite.
    """
    n, k = log_densities.shape
    likely, scale = np.empty((k + 1, n)), np.zeros(k + 1)
    for i in range(n):
        likely[0, i] = 1.0 - detected[i]
    for j in range(k):
        best, total = -np.inf, 0.0
        for i in range(n):
            best = max(best, log_densities[i, j])
            total += log_densities[i, j]
        scale[j + 1] = best if total < np.inf else np.nan
        row = likely[j + 1]
        if best == -np.inf:
            row[:] = 0.0
            continue
        for i in range(n):
            row[i] = log_densities[i, j] - best
        exponentiate(row)
        for i in range(n):
            row[i] *= detected[i]
    return likely, scale
