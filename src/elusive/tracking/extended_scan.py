"""What a scan makes of targets that may make several detections each: which are whose, by messages.

Meyer and Williams (2021), IEEE Trans. Signal Process. 69, 6283-6298: each detection is one target's, new or false, and
a target makes any number. A target that is detected makes one detection and a Poisson number of further ones, nu, so
that with a_j the density of detection j to its competitors' the likelihood of all is

    1 - P_D + P_D exp(-nu) prod_j (1 + nu a_j) sum_j a_j / (1 + nu a_j),

which for nu = 0 is that of Williams and Lau (2014) for a single detection.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.filters.particle import _kernels
from elusive.filters.particle.resampling import resample
from elusive.tracking.detection_targets import CERTAIN, Evidence, Expected, Target, log_odds_of
from elusive.tracking.fixed_echoes import EchoEvidence, EchoScan, FixedEcho, echo_after, echo_evidence

ROUNDS, TOLERANCE = 12, 1e-3
LEAST = 1e-300


@runtime_checkable
class ExtendedSensor(Protocol):
    """A :class:`~elusive.contracts.DetectionSensor` of targets that make several detections each."""

    def further_detections(self, states: Array) -> Array:
        """Mean number of detections beside the first of a target that is detected, ``(N, d) -> (N,)``."""

    def room(self, means: Array) -> Array:
        """Covariance of place about the middle of each target, ``(T, d) -> (T, 2, 2)``: where no other can be."""

    def one_body(self, means: Array, covariances: Array) -> bool:
        """Whether two targets, ``(2, d), (2, d, d)``, are parts of one."""

    def extended(self, states: Array, rng: Generator) -> Array:
        """Append to places and velocities of new targets ``(N, 4)`` what extent they may have."""

    def union(self, first: Array, second: Array) -> Array:
        """Join targets to one that reaches as far as both, ``(N, d), (N, d) -> (N, d)``."""


class _Explained(NamedTuple):
    """A target's share of its detections, their competitors known."""

    messages: Array  # (k,) density of each as the target's, given the others
    likelihood: Array  # (N,) of each particle, but for a scale
    shares: tuple[float, float, Array]  # that the target is there; that its echo is there unseen, or made each


def associated_extended(
    alive: Sequence[Expected], found: Sequence[Evidence], echoes: Sequence[FixedEcho],
    within: Sequence[NDArray[np.int64]], fixed: EchoScan | None, log_new: Array, sensor: ExtendedSensor,
) -> tuple[list[Target], list[FixedEcho], Array]:  # fmt: skip
    """Return targets and echoes after the scan, and the probability that each detection is none of theirs."""
    of_echoes = list[EchoEvidence]()
    if fixed is not None:
        rows = enumerate(zip(echoes, within[len(alive) :], strict=True), len(alive))
        of_echoes = [echo_evidence(echo.existence, *fixed.of_row(row, which)) for row, (echo, which) in rows]
    further = [sensor.further_detections(one.particles) for one in alive]
    n, asked = len(alive), np.zeros(len(log_new), dtype=np.int64)
    for which in within:
        asked[which] += 1
    messages = [np.zeros(len(which)) for which in within]
    total = np.exp(log_new)  # density of each detection, whoever made it
    for _ in range(ROUNDS):
        change, fresh = 0.0, total.copy()
        for row, which in enumerate(within):
            others = np.maximum(fresh[which] - messages[row], LEAST)
            if row < n:
                after = _explained(found[row], further[row], others).messages
            else:
                after = _of_echo(of_echoes[row - n], others)
            moved = np.abs(np.log((after + others) / (messages[row] + others)))[asked[which] > 1]
            change = max(change, float(moved.max(initial=0.0)))
            fresh[which] += after - messages[row]
            messages[row] = after
        total = fresh
        if change < TOLERANCE:
            break
    # what was told last is asked once more, so that all answer to the same
    targets, new = list[Target](), None if fixed is None else fixed.new
    for row, (one, said) in enumerate(zip(alive, found, strict=True)):
        others = np.maximum(total[said.which] - messages[row], LEAST)
        targets.append(_after(one, said, _explained(said, further[row], others), others, fixed))
    left = list[FixedEcho]()
    if new is not None:
        for number, (echo, seen) in enumerate(zip(echoes, of_echoes, strict=True), n):
            which = within[number]
            made = np.exp(seen.log_made) / np.maximum(total[which] - messages[number], LEAST)
            unseen, absent = seen.existence * seen.missed, max(1 - seen.existence, 1 - CERTAIN)
            whole = absent + unseen + float(made.sum())
            left.append(echo_after(echo, unseen / whole, made / whole, new, which))
    return targets, left, np.exp(log_new) / np.maximum(total, LEAST)


def joined(targets: list[Target], sensor: ExtendedSensor, rng: Generator) -> list[Target]:
    """Make one of confirmed targets that are parts of one, which is the older."""
    sure = [number for number, target in enumerate(targets) if target.life.status == "confirmed"]
    gone = set[int]()
    for k, first in enumerate(sure):
        for second in sure[k + 1 :]:
            pair = targets[first], targets[second]
            if gone & {first, second} or not sensor.one_body(
                np.array([one.mean for one in pair]), np.array([one.covariance for one in pair])
            ):
                continue
            older, newer = sorted((first, second), key=lambda number: targets[number].life.track or 0)
            targets[older] = _united(targets[older], targets[newer], sensor, rng)
            gone.add(newer)
    return [target for number, target in enumerate(targets) if number not in gone]


def _united(first: Target, second: Target, sensor: ExtendedSensor, rng: Generator) -> Target:
    n = len(first.weights)
    drawn = [_kernels.gather(one.particles, resample(one.weights, n, rng), n) for one in (first, second)]
    particles = np.asfortranarray(sensor.union(drawn[0], drawn[1][rng.permutation(n)]))
    even = np.full(n, 1 / n)
    moments = _kernels.moments(particles, even)
    existence = max(first.existence, second.existence)
    return first._replace(
        existence=existence, particles=particles, weights=even, mean=moments[0], covariance=moments[1], predicted=even
    )


def _explained(found: Evidence, further: Array, others: Array) -> _Explained:
    """Ask how well a target explains its detections, against what else does."""
    missed = found.likely[0]
    k = len(found.which)
    seen = np.maximum(1 - missed, LEAST)
    scale = np.exp(np.minimum(found.scale[1:], 600.0))
    ratios = found.likely[1:] / seen * (scale / others)[:, None]  # (k, N) the a_j
    each = 1 + further * ratios
    log_all = np.log(each).sum(axis=0) - further
    parts = ratios / each
    summed = parts.sum(axis=0)
    top = max(float(log_all.max(initial=0.0)), 0.0)
    whole = np.exp(log_all - top)
    r, weights = found.existence, found.weights
    likelihood = missed * math.exp(-top) + seen * whole * summed
    there = r * float(weights @ likelihood)
    absent = max(1 - r, 1 - CERTAIN)
    echo_unseen, echo_made = 0.0, np.zeros(k)
    if found.echo is not None:
        absent = max(1 - r - found.echo.existence, 1 - CERTAIN)
        echo_unseen = found.echo.existence * found.echo.missed * math.exp(-top)
        echo_made = np.exp(found.echo.log_made) / others * math.exp(-top)
    absent *= math.exp(-top)
    messages = np.zeros(k)
    for j in range(k):
        without = missed * math.exp(-top) + seen * whole / each[j] * np.maximum(summed - parts[j], 0.0)
        rest = r * float(weights @ without) + absent + echo_unseen + float(echo_made.sum() - echo_made[j])
        gained = r * float(weights @ (likelihood - without)) + echo_made[j]
        messages[j] = max(gained, 0.0) / max(rest, LEAST) * others[j]
    total = there + absent + echo_unseen + float(echo_made.sum())
    shares = there / total, echo_unseen / total, echo_made / total
    return _Explained(messages, likelihood, shares)


def _of_echo(seen: EchoEvidence, others: Array) -> Array:
    """Density of each detection as a fixed echo's, which makes one at most, given its other ones."""
    made = np.exp(seen.log_made) / others
    none = math.exp(seen.log_missed)
    return np.asarray(made / (none + made.sum() - made) * others)


def _after(one: Expected, found: Evidence, its: _Explained, others: Array, fixed: EchoScan | None) -> Target:
    """Return the target after the scan."""
    existence, unseen, made = its.shares
    weights = found.weights * its.likelihood
    whole = weights.sum()
    weights = weights / whole if whole > 0 else found.weights
    echo = one.target.echo
    if echo is not None and fixed is not None:
        echo = echo_after(echo, unseen, made, fixed.new, found.which)
    existence = min(existence, CERTAIN)
    share = its.messages / (its.messages + others) if len(others) else its.messages
    best = int(share.argmax()) if len(share) else -1
    detection = int(found.which[best]) if best >= 0 and share[best] > 0.5 else -1
    gained = log_odds_of(existence) - log_odds_of(one.existence) if 0 < one.existence < 1 else 0.0
    return Target(
        one.target.life, existence, one.particles, weights, *_kernels.moments(one.particles, weights),
        one.weights, detection, gained, found.allowed, found.forbidden, one.target.least_odds, echo,
    )  # fmt: skip
