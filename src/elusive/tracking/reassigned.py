"""Second thoughts on which target is which, once it is known who is newborn.

A known target is updated before anybody is looked for. If it leaps to who has just come, somebody is found where it
was, and no further sweep of updates takes them back: each is where the other leaves something over. So the other order
is tried, and the likelier is taken, as a move of a sampler over associations (Oh, Russell and Sastry, 2009, IEEE Trans.
Automatic Control 54(3), 481-497) would be.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeAlias

from elusive.contracts import Array, X, Y
from elusive.tracking.sought import LOUD, SUREST, Sought, Update

BESIDE = 0.5  # existence from which no other appears near by
SURER = 3.0  # log evidence by which a leap must be the less likely: particles are few
Seek: TypeAlias = Callable[[Sequence[Sought], float], Iterator[Sought]]  # newborn given others, of as much evidence


def told(targets: Sequence[Sought]) -> list[Any]:
    """Return what others are told that targets add."""
    return [target.effect for target in targets if target.existence > LOUD]


def places_of(targets: Sequence[Sought]) -> list[Array]:
    """Return the places ``(2,)`` near which no other appears."""
    return [near.weights @ near.particles[:, [X, Y]] for near in targets if near.existence >= BESIDE]


def exchanged(
    before: Sequence[Sought], found: Sequence[Sought], newborn: Sequence[Sought], update: Update, seek: Seek
) -> list[Sought]:
    """Let a newborn target be where a known one leapt to, and that one where it came from, where that is likelier.

    Both orders explain the measurement by as many; they differ by how likely the leap is.

    Parameters
    ----------
    before, found
        The known targets as they were predicted, and as they were updated while nobody was newborn.
    newborn
        Whom that leaves over; the surest stands first.
    update
        Of the measurement.
    seek
        Looks for a newborn target.
    """
    for k, leapt in enumerate(found):
        if leapt.existence <= BESIDE or leapt.placed is None:
            continue
        others = [*found[:k], *found[k + 1 :]]
        least = leapt.log_evidence + newborn[0].log_evidence + SURER
        for come in seek(others, -math.inf):
            stayed = update.of_one(before[k], [*told(others), come.effect])
            if come.log_evidence + stayed.log_evidence > least:
                return [*found[:k], stayed, *found[k + 1 :], come, *newborn[1:]]
    return [*found, *newborn]


def corrected(found: list[Sought], update: Update, seek: Seek, sweeps: int, existence: float) -> list[Sought]:
    """Put a newborn target in the place of the one that fits worst, where that is likelier.

    Parameters
    ----------
    found
        The targets.
    update, seek, sweeps
        As for :func:`exchanged`, and how often targets are updated at most.
    existence
        What is left of the one that it replaces.
    """
    sure = [k for k, target in enumerate(found) if target.existence > BESIDE and target.log_ratio is not None]
    if not sure:
        return found
    k = min(sure, key=lambda k: found[k].log_evidence)
    others, wrong = [*found[:k], *found[k + 1 :]], found[k]
    prior = min(wrong.prior, SUREST)  # after hours without a measurement somebody has come for sure
    against = wrong.log_evidence + math.log(prior) - math.log1p(-prior)
    for newborn in seek(others, against):
        return update.of([*others, newborn, wrong._replace(existence=existence)], sweeps)
    return found
