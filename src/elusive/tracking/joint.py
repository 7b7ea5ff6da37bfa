"""Targets that overlap, weighed together.

Updates in turn (:mod:`elusive.tracking.sought`) tell a target what is believed of the others with the measurement
already taken in: where they overlap it is counted twice, and places are too sure. Such targets are sampled jointly
(Kreucher, Kastella and Hero (2005), IEEE Trans. Aerosp. Electron. Syst. 41(4), 1396-1414): the others are drawn from
their own particles, there or not, and each particle of the target has its prior times the mean over these draws of

    p(others) / q(others) p(z | others, it),

importance sampling of the joint posterior, exact over the target itself (Robert and Casella, 2004, Monte Carlo
statistical methods, section 4.2). A marginal of the joint posterior is kept of each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import AdditiveSensor, Array
from elusive.filters.particle import _kernels
from elusive.filters.particle.parts import posterior
from elusive.tracking.reassigned import told
from elusive.tracking.sought import LOUD, PROBES, SETTLED, SUREST, Sought, Update

DRAWS = 64  # of the others
EVEN = 0.5  # of the draws: evenly from the particles, which reach farther than the posterior
LEAST_DOUBT = 0.02  # share of the draws in which a target is there, or is not, at least


@runtime_checkable
class PairSensor(AdditiveSensor, Protocol):
    """A sensor that tells how much of what two targets add is the same."""

    def overlap(self, first: Any, second: Any, measurement: Any, others: Sequence[Any]) -> Array | None:
        """By how much two targets' log ratio is less than the sum of their own, ``(N, M)`` for N and M states.

        Both are expected beside others, as in ``log_ratio``. None where that is not how they add up.
        """


class _Drawn(NamedTuple):
    """A target in draws of several."""

    expected: Any  # what it adds in each, (M,)
    there: NDArray[np.bool_]  # (M,)
    log_weight: Array  # (M,) prior over proposal, times the likelihood ratio where nobody else of its group is there


def jointly(found: Sequence[Sought], update: Update) -> list[Sought]:
    """Weigh targets that overlap together; leave those alone as they are, and all where a sensor cannot tell."""
    weighed = list(found)
    if not isinstance(update.sensor, PairSensor):
        return weighed
    sensor, measurement = update.sensor, update.measurement
    for group in _groups(found, sensor, measurement):
        far = told([target for k, target in enumerate(found) if k not in group])
        ratios = {k: sensor.log_ratio(found[k].expected, measurement, far) for k in group}
        drawn = {k: _drawn(found[k], ratios[k], update) for k in group}
        pairs = dict[tuple[int, int], Array]()  # each once: a hundred targets have half a million triples

        def both(first: Any, second: _Drawn, far: Sequence[Any] = far) -> Array:
            less = sensor.overlap(first, second.expected, measurement, far)
            assert less is not None
            return np.where(second.there, less, 0.0)

        for before, j in combinations(group, 2):
            pairs[before, j] = np.where(drawn[j].there, np.diagonal(both(drawn[j].expected, drawn[before])), 0.0)
        for k in group:
            others = [j for j in group if j != k]
            log_draw = np.sum([drawn[j].log_weight for j in others], axis=0)
            for pair in combinations(others, 2):
                log_draw -= pairs[pair]
            level = ratios[k][:, None] - sum(both(found[k].expected, drawn[j]) for j in others)
            weighed[k] = _weighed(found[k], level, log_draw, sensor)
            if weighed[k].destitute and not found[k].destitute:
                # hardly one of the draws is likely: what is known of the target by itself says more
                weighed[k] = found[k]
    return weighed


def _groups(found: Sequence[Sought], sensor: PairSensor, measurement: Any) -> list[list[int]]:
    """Return which targets overlap, directly or by others."""
    left = [k for k, target in enumerate(found) if target.existence > LOUD and target.log_ratio is not None]
    if len(left) < 2:
        return []
    probes = {
        k: sensor.expected(found[k].particles[_kernels.systematic(found[k].weights, 1.0, PROBES, 0.5)]) for k in left
    }

    def overlap(k: int, j: int) -> bool:
        less = sensor.overlap(probes[k], probes[j], measurement, ())
        return less is not None and float(less.max()) > SETTLED

    groups = []
    while left:
        group, left = [left[0]], left[1:]
        for k in group:
            near = [j for j in left if overlap(k, j)]
            group += near
            left = [j for j in left if j not in near]
        if len(group) > 1:
            groups.append(group)
    return groups


def _drawn(target: Sought, log_ratio: Array, update: Update) -> _Drawn:
    """Draw a target from its particles, there or not."""
    rng = update.rng
    share = EVEN / len(target.weights) + (1 - EVEN) * target.weights
    chosen = rng.permutation(_kernels.systematic(share, 1.0, DRAWS, rng.random()))
    shown = min(max(target.existence, LEAST_DOUBT), 1 - LEAST_DOUBT)
    there = rng.permutation(np.arange(DRAWS) + rng.random() < shown * DRAWS)
    log_there = math.log(target.prior / shown) + target.log_prior[chosen] - np.log(share[chosen]) + log_ratio[chosen]
    log_absent = math.log1p(-target.prior) - math.log1p(-shown)
    return _Drawn(update.sensor.expected(target.particles[chosen]), there, np.where(there, log_there, log_absent))


def _weighed(target: Sought, level: Array, log_draw: Array, sensor: AdditiveSensor) -> Sought:
    """Weigh a target's particles by their log ratios ``(N, M)`` beside draws of the others."""
    log_weight = level + log_draw
    log_weight += target.log_prior[:, None]
    top = float(log_weight.max())
    if top == -math.inf:
        return target
    weights = np.exp(log_weight - top).sum(axis=1)
    total = float(weights.sum())
    weights /= total
    log_evidence = top + math.log(total) - _kernels.weigh(log_draw)[1]
    existence = min(posterior(target.prior, log_evidence), SUREST)
    effect = sensor.effect(target.expected, weights, existence)
    return target._replace(weights=weights, existence=existence, effect=effect)
