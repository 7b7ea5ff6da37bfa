"""Which targets of the tracker of detections go on: one of two tracks of one target, and beginnings that are likely."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array, X, Y
from elusive.tracking.detection_targets import CERTAIN, Target
from elusive.tracking.fixed_echoes import FixedEcho

PLACE = np.array([X, Y])
VAGUE = 10.0  # times as wide a belief of place: one that is lost, and would be the double of whatever appears


def merged(targets: list[Target], within: float, room: Array | None = None) -> list[Target]:
    """Make one of two tracks of one target, which is the confirmed, else the older, and exists if either does.

    ``room``, ``(T, 2, 2)``, is the covariance of place about the middle of each, where no other target can be.
    """
    if len(targets) < 2:
        return targets
    # a difference along an axis alone is never greater than that in all components: few pairs are left to look at
    means = np.array([target.mean[:4] for target in targets])
    covariances = np.array([target.covariance[:4, :4] for target in targets])
    if room is not None:
        covariances[:, PLACE[:, None], PLACE] += room
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    area = np.sqrt(np.linalg.det(covariances[:, PLACE[:, None], PLACE]).clip(0.0))
    first, second = _alike(means[:, None, X], means[:, X], variances[:, None, X], variances[:, X], within).nonzero()
    pairs = _alike(means[first], means[second], variances[first], variances[second], within).all(axis=-1)
    pairs &= (first != second) & (area[second] <= VAGUE**2 * area[first])
    would_become: dict[int, list[int]] = {}
    for number, other in zip(first[pairs].tolist(), second[pairs].tolist(), strict=True):
        would_become.setdefault(number, []).append(other)

    def apart(first: int, second: int) -> float:
        """Root mean square difference of place and velocity of two beliefs, in their deviations."""
        off = means[first] - means[second]
        total = covariances[first] + covariances[second]
        return math.sqrt(max(0.0, float(off @ np.linalg.lstsq(total, off)[0])) / 4)

    kept: dict[int, Target] = {}
    order = [(target.life.status != "confirmed", target.life.track is None, k) for k, target in enumerate(targets)]
    for number in sorted(range(len(targets)), key=order.__getitem__):
        target = targets[number]
        # of a pair it is known jointly that they are two
        with_it = -1 if target.pair is None else target.pair.track
        others = sorted(kept.keys() & would_become.get(number, ()), key=order.__getitem__)
        near = (other for other in others if targets[other].life.track != with_it)
        same = next((other for other in near if apart(number, other) < within), None)
        if same is None:
            kept[number] = target
        else:  # what one detection after the other may have begun is there once
            both = kept[same].existence + target.existence
            if target.detection < 0 and kept[same].detection < 0:  # or they are lost, and one is as likely anywhere
                both = max(kept[same].existence, target.existence)
            kept[same] = kept[same]._replace(existence=min(both, CERTAIN), echo=_likelier(target, kept[same], both))
    return [kept[number] for number in sorted(kept)]


def _alike(first: Array, second: Array, its: Array, others: Array, within: float) -> NDArray[np.bool_]:
    """Whether components, known with variances, differ by less than twice so many deviations."""
    return np.asarray((first - second) ** 2 <= 4 * within**2 * (its + others))


def kept_up(targets: Sequence[Target], undetected: float) -> tuple[list[Target], float, list[FixedEcho]]:
    """Give up beginnings that hardly exist: they go back to what was never detected, but for their fixed echoes."""
    kept, echoes = list[Target](), list[FixedEcho]()
    for target in targets:
        if target.life.track is None and target.existence < target.least_odds * (1 - target.existence):
            undetected += target.existence
            if target.echo is not None:
                echoes.append(target.echo)
        else:
            kept.append(target)
    return kept, undetected, echoes


def _likelier(first: Target, second: Target, existence: float) -> FixedEcho | None:
    """Return the likelier of two targets' echoes, beside a target of this existence."""
    echoes = [echo for echo in (first.echo, second.echo) if echo is not None]
    if not echoes:
        return None
    best = max(echoes, key=lambda echo: echo.existence)
    return best._replace(existence=min(best.existence, max(1 - existence, 0.0)))
