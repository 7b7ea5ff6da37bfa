"""Two targets that contest a detection keep one joint belief: which of them made it is the other's matter, too.

Marginal association (:mod:`elusive.tracking.association`) forgets after each scan that what the one made the other did
not. Two targets that are in one line for long then each take both ways on to be open, and may both end on the other's
detections, sure and wrong. Their particles are therefore paired, one of each to a joint sample, and weighed by all
joint associations: the joint particle filter of Vermaak, Godsill and Perez (2005, IEEE Trans. Aerosp. Electron. Syst.
41(1), 309-332, section IV), of two at a time. They part when nothing has been contested for a few scans.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array
from elusive.filters.particle import _kernels, _particle_kernels
from elusive.filters.particle.informed import smoothed
from elusive.filters.particle.resampling import resample
from elusive.tracking.detection_targets import Evidence, Expected, Pair, Target, has_one_mode, kernel_of

SURE = 0.9  # existence of targets that are paired
CONTESTED = 0.25  # probability of a detection for each of two targets, from which they contest it
QUIET = 4  # scans without a contest after which a pair parts
LEAST_FREE = 1e-4  # probability that no other target made a detection
MOST_ODDS = 300.0  # logarithm; the product of two stays a number


class Paired(NamedTuple):
    """Targets before a scan, of pairs with their particles row by row, and what the scan makes of these."""

    alive: list[Expected]
    found: list[Evidence]
    after: dict[int, tuple[Array, Pair]]  # weights after the scan, (N,), and the other, of each that is paired


def paired(
    alive: Sequence[Expected], found: Sequence[Evidence], made: Sequence[Array], log_new: Array, rng: Generator
) -> Paired:
    """Weigh pairs of targets that contest a detection jointly.

    Parameters
    ----------
    alive, found
        Targets, and what the scan says of each.
    made
        Marginal probabilities that each made each of its detections, ``(k,)``.
    log_new
        ``(m,)`` logarithm of the intensity of each detection as nothing's that is known.
    rng
        Source of the joint samples of targets that meet.
    """
    joint = Paired(list(alive), list(found), {})
    shares = np.zeros((len(alive), len(log_new)))
    for row, (its, pairs) in enumerate(zip(found, made, strict=True)):
        shares[row, its.which] = pairs
    held = _held([(one.target, one.weights) for one in alive])
    for (first, second), quiet in _contests(alive, shares, held).items():
        if (first, second) not in held:
            for row in (first, second):
                _shuffle(joint, row, rng)
        others = np.delete(shares, [first, second], axis=0).sum(axis=0)
        log_else = log_new - np.log(1 - others.clip(max=1 - LEAST_FREE))
        weights = _weighed(joint, first, second, log_else)
        total = weights.sum()
        if not (np.isfinite(total) and total > 0):
            continue
        for row, other in ((first, second), (second, first)):
            joint.after[row] = weights / total, Pair(alive[other].target.life.track or 0, quiet)
    return joint


def redrawn(targets: list[Target], resample_below: float, kernel_width: float, rng: Generator) -> list[Target]:
    """Resample pairs whose joint samples hardly count any more, both alike, as one target is."""
    after = list(targets)
    for rows in _held([(target, target.weights) for target in targets]):
        weights = targets[rows[0]].weights
        n, counting = len(weights), _particle_kernels.effective_size(weights)
        if counting >= resample_below * n:
            continue
        states = np.asfortranarray(np.concatenate([targets[row].particles for row in rows], axis=1))
        if kernel_width and all(has_one_mode(targets[row]) for row in rows):
            states = smoothed(states, weights, n, kernel_of(kernel_width, states.shape[1], counting), rng)
        else:
            states = _kernels.gather(states, resample(weights, n, rng), n)
        for row, particles in zip(rows, np.split(states, 2, axis=1), strict=True):
            after[row] = targets[row]._replace(particles=np.asfortranarray(particles), weights=np.full(n, 1 / n))
    return after


def _held(targets: Sequence[tuple[Target, Array]]) -> list[tuple[int, int]]:
    """Return the rows of each pair; of different weights, as one has that was told more by itself, they are none."""
    row_of = {target.life.track: row for row, (target, _) in enumerate(targets) if target.pair is not None}
    found = []
    for row, (target, weights) in enumerate(targets):
        other = None if target.pair is None else row_of.get(target.pair.track)
        if other is not None and row < other and np.array_equal(weights, targets[other][1]):
            found.append((row, other))
    return found


def _contests(alive: Sequence[Expected], shares: Array, held: Sequence[tuple[int, int]]) -> dict[tuple[int, int], int]:
    """Return the pairs of this scan, and for how many they have contested nothing; each target is in one at most."""
    sure = [
        row
        for row, one in enumerate(alive)
        if one.target.life.status == "confirmed" and one.existence > SURE and one.target.echo is None
    ]
    worth = {
        (first, second): float(np.minimum(shares[first], shares[second]).max(initial=0.0))
        for place, first in enumerate(sure)
        for second in sure[place + 1 :]
    }
    quiet, taken = dict[tuple[int, int], int](), set[int]()
    for pair in held:
        before = alive[pair[0]].target.pair
        count = 0 if before is None or worth.get(pair, 0.0) > CONTESTED else before.quiet + 1
        if count <= QUIET:
            quiet[pair] = count
            taken.update(pair)
    for pair in sorted(worth, key=lambda pair: -worth[pair]):
        if worth[pair] > CONTESTED and not taken.intersection(pair):
            quiet[pair] = 0
            taken.update(pair)
    return quiet


def _shuffle(joint: Paired, row: int, rng: Generator) -> None:
    """Draw a target's particles anew, of equal weight and in any order, independent of all others."""
    one, its, n = joint.alive[row], joint.found[row], len(joint.alive[row].weights)
    drawn = rng.permutation(resample(one.weights, n, rng))
    known = _known(one, its)[drawn]
    joint.found[row] = its._replace(weights=known / known.sum(), likely=its.likely[:, drawn])
    joint.alive[row] = one._replace(particles=_kernels.gather(one.particles, drawn, n), weights=np.full(n, 1 / n))


def _known(one: Expected, its: Evidence) -> Array:
    """By how much what is known of places changes each weight, ``(N,)``."""
    return np.divide(its.weights, one.weights, out=np.zeros_like(one.weights), where=one.weights > 0)


def _weighed(joint: Paired, first: int, second: int, log_else: Array) -> Array:
    """Return weights of joint samples, not normalised: prior times the sum over all joint associations, ``(N,)``."""
    weights, sums = joint.alive[first].weights, list[tuple[Array, Array]]()
    for row in (first, second):
        its = joint.found[row]
        weights = weights * _known(joint.alive[row], its)
        odds = np.zeros((len(log_else), len(weights)))
        odds[its.which] = np.exp((its.scale[1:] - log_else[its.which]).clip(max=MOST_ODDS))[:, None] * its.likely[1:]
        sums.append((its.likely[0], odds))
    (missed, made), (other_missed, other_made) = sums
    # a detection is of one of them: the other missed, or made one before or after it
    rest = np.zeros_like(other_made)
    rest[1:] = np.cumsum(other_made[:-1], axis=0)
    rest[:-1] += np.cumsum(other_made[:0:-1], axis=0)[::-1]
    return np.asarray(
        weights * (missed * (other_missed + other_made.sum(axis=0)) + (made * (other_missed + rest)).sum(axis=0))
    )
