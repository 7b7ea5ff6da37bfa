"""What goes by too fast for a velocity to be found from one frame to the next: it begins with three peaks on a line.

The likelihood ratio of a target against clutter, of three peaks that nothing claims: the first as of any newborn, the
second with a velocity that is uniform up to the fastest, the third where even motion brings it (Bar-Shalom, Willett
and Tian, 2011, Tracking and Data Fusion, section 3.3, of initiation by differences, with a posterior for the gate).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.tracking._pair_kernels import HEAVY, STUDENT
from elusive.tracking.peak_motions import PeakMotions
from elusive.tracking.peak_targets import PeakTargets

UNEVEN = 0.05  # deviation of a way from the one before it, share of it
LEAST_ODDS = -12.0  # logarithm, below which three peaks are no guess


class Unclaimed(NamedTuple):
    """The m rarest peaks of a frame that no target claims, the rarest first."""

    place: Array  # (m, 2) in the scene
    variance: Array  # (m,) of a place
    level: Array  # (m,) logarithm of the contrast
    bright: NDArray[np.bool_]  # (m,)
    log_density: Array  # (m,) of peaks as strong hereabouts [1 / px^2]
    strength: Array  # (m,) [deviations]
    scale: Array  # (m,) [px]
    news: Array  # (m,) 1 of what stands out against earlier frames, else 0
    share: Array  # (m,) of it that none claims

    def rarest(self, most: int) -> Self:
        """Return the first of them."""
        fields: dict[str, Any] = {name: values[:most] for name, values in self._asdict().items()}
        return self._replace(**fields)


class Swift(NamedTuple):
    """S targets that begin with three peaks."""

    third: NDArray[np.int64]  # (S,) the last, among its frame's unclaimed
    place: Array  # (S, 3, 2) of the three, in the scene
    variance: Array  # (S, 3)
    evidence: Array  # (S,) log likelihood ratio of the second and the third against clutter
    log_odds: Array  # (S,)

    @classmethod
    def none(cls) -> Self:
        """Return no targets."""
        return cls(np.zeros(0, np.int64), np.zeros((0, 3, 2)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))


class Ways(NamedTuple):
    """How fast what is swift goes, and how it is seen."""

    least_px: float  # way in a frame: what is slower is found as any newborn
    most_px: float
    q: float  # acceleration [px^2 / frame^3]
    appear: float  # such targets a frame [1 / px^2]
    detected: float
    level_spread: float
    tail: float


def swift(ways: Ways, first: Unclaimed, second: Unclaimed, third: Unclaimed) -> Swift:
    """Return what begins with a peak of each of three frames, each peak once, the likeliest first."""
    way = second.place[None] - first.place[:, None]
    length = np.hypot(way[..., 0], way[..., 1])
    one, other = np.nonzero(
        (first.bright[:, None] == second.bright) & (length > ways.least_px) & (length < ways.most_px)
    )
    if not len(one) or not len(third.place):
        return Swift.none()
    off = third.place[None] - second.place[other, None] - way[one, other][:, None]
    variance = first.variance[one] + 4 * second.variance[other] + 2 / 3 * ways.q + (UNEVEN * length[one, other]) ** 2
    spread = variance[:, None] + third.variance
    alike = _log_alike(ways, first, second)[one, other] - math.log(math.pi * ways.most_px**2)
    evidence = alike[:, None] + _log_alike(ways, second, third)[other]
    evidence += -0.5 * (off**2).sum(axis=2) / spread - np.log(2 * math.pi * spread)
    evidence[second.bright[other, None] != third.bright] = -np.inf
    log_odds = math.log(ways.appear) - first.log_density[one, None] + evidence
    rows, last = np.nonzero(log_odds > LEAST_ODDS)
    chosen, taken = [], set[tuple[int, int]]()
    for k in np.argsort(-log_odds[rows, last], kind="stable"):
        peaks = {(0, int(one[rows[k]])), (1, int(other[rows[k]])), (2, int(last[k]))}
        if not peaks & taken:
            taken |= peaks
            chosen.append(k)
    rows, last = rows[chosen], last[chosen]
    parts = (first, one[rows]), (second, other[rows]), (third, last)
    return Swift(
        last,
        np.stack([peaks.place[which] for peaks, which in parts], axis=1),
        np.stack([peaks.variance[which] for peaks, which in parts], axis=1),
        evidence[rows, last],
        log_odds[rows, last],
    )


def _log_alike(ways: Ways, some: Unclaimed, others: Unclaimed) -> Array:
    """Log likelihood ratio that others are the same target's, wherever they are, against clutter, ``(n, m)`` [px^2]."""
    change = (others.level - some.level[:, None]) / ways.level_spread
    rarity = math.log(ways.detected / (STUDENT * ways.level_spread * ways.tail)) - others.log_density
    found: Array = rarity - 2 * np.log1p(change**2 / HEAVY)
    return found


def under_way(targets: PeakTargets, begun: Swift, motions: PeakMotions, detected: float) -> PeakTargets:
    """Return newborn targets, the last of which are swift, with what their three peaks tell."""
    count = len(begun.third)
    if not count:
        return targets
    which, moving = slice(len(targets.number) - count, None), ~motions.rests
    first, second, third = np.moveaxis(begun.place, 1, 0)
    new = {name: getattr(targets, name).copy() for name in targets._fields}
    new["age"][which] = 2
    new["velocity"][which, moving] = ((third - first) / 2)[:, None]
    spread = np.stack(
        [begun.variance[:, 2], begun.variance[:, 2] / 2, begun.variance[:, [0, 2]].sum(axis=1) / 4], axis=1
    )
    spread[:, 2] += motions.fast_q
    new["variance"][which, moving] = spread[:, None]
    new["weight"][which] = np.where(moving, motions.first_weights, 0.0)
    new["weight"][which] /= new["weight"][which].sum(axis=1, keepdims=True)
    new["visible"][which] = 1 / (1 + np.exp(-begun.log_odds))
    new["evidence"][which] = begun.evidence
    new["resting"][which] = 2 * math.log1p(-detected)
    new["origin"][which] = first
    new["farthest"][which] = new["hop"][which] = np.hypot(*(third - first).T)
    new["lately"][which] = first[:, None]
    new["lately"][which, -2], new["lately"][which, -1] = second, third
    return PeakTargets(**new)
