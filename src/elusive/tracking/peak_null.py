"""Which tracks move, and which stand out, against what this recording's own clutter does.

Local false-discovery rate (Efron, 2004, J. Am. Stat. Assoc. 99, 96-104): of a recording's tracks nearly all are parts
of the scene, so that what they reach is the null distribution, whatever the noise is. Its tail is a generalised Pareto
law above a high quantile (Pickands, 1975) by two quantiles of its own (Castillo and Hadi, 1997, J. Am. Stat. Assoc.
92, 1609-1620), which targets among the tracks hardly move; two pieces of evidence are joined as in Fisher (1932).
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from elusive.contracts import Array
from elusive.model import Model, Positive, Probability
from elusive.preprocess.scales import quantile_of


class EmpiricalNull(Model):
    """How what the recording's tracks reach is made a distribution."""

    least_tracks: int = Field(
        100, ge=1, description="Tracks that a null distribution takes; those that a clean recording lacks are supposed"
    )
    weak: Positive = Field(3.0, description="Evidence of moving that shows nothing, however rare it is, up to [nats]")
    level: Probability = Field(0.9, description="Quantile of the tracks' evidence of moving, above which the tail is")
    least: Positive = Field(1.0, description="Evidence of moving above which the tail is, at least [nats]")
    shape: Positive = Field(0.3, description="Exponent of the tail, xi, at least: how far it is from exponential")
    shape_tracks: int = Field(
        10, ge=1, description="Tracks over the level of that exponent that are supposed beside the recording's own"
    )
    supposed: Positive = Field(3.5, description="Median excess over the level that is supposed beforehand [nats]")
    supposed_tracks: int = Field(3, ge=0, description="How many tracks that supposition counts for")
    supposed_share: Probability = Field(
        0.15, description="Share over the level of the tracks that a clean recording lacks"
    )

    def moves(self, moved: Array, rate: Array, null_moved: Array, null_rate: Array) -> Array:
        """Probability that each track moves, ``(n,)``.

        A recording without clutter has few tracks, and most of them may be targets, which are no null. What is missing
        of one is supposed: that many tracks reached nothing, but for a share above the level. Evidence against which
        the odds are 20 is strong (Kass and Raftery, 1995, J. Am. Stat. Assoc. 90, 773-795): less moves nothing.

        Parameters
        ----------
        moved, rate
            ``(n,)`` of each track: log evidence of moving against resting, and its log evidence a frame.
        null_moved, null_rate
            ``(N,)`` the same of the recording's tracks so far.
        """
        own, count = len(null_moved), max(len(null_moved), self.least_tracks)
        reached = np.append(null_moved, np.zeros(count - own))
        level = max(self.least, quantile_of(reached, self.level))
        excess = reached[reached > level] - level
        missing = round(self.supposed_share * (count - own))
        shape, width = self._tail(excess, missing)
        beyond = (1 + shape * np.maximum(moved - level, 0.0) / width) ** (-1 / shape)
        by_motion = np.where(moved > max(level, self.weak), (len(excess) + missing + 1) / (count + 1) * beyond, 1.0)
        by_rate = (own - np.searchsorted(np.sort(null_rate), rate, "left") + 1) / (count + 1)
        joint = by_motion * by_rate
        expected = (count + 1) * joint * (1 - np.log(joint))
        return np.asarray(1 - np.minimum(1.0, expected))

    def _tail(self, excess: Array, missing: int) -> tuple[float, float]:
        """Exponent and width of the tail, by the excesses over the level and how many of them are missing.

        A clean recording's own few tell no exponent, and may be targets: in units of their median they are laid among
        as many quantiles of the exponent that is supposed.
        """
        shape = self.shape
        if len(excess):
            upper = 1 - (np.arange(self.shape_tracks) + 0.5) / self.shape_tracks
            usual = (upper**-shape - 1) / (2**shape - 1)
            shape = max(shape, exponent_of(np.append(excess / quantile_of(excess, 0.5), usual)))
        middle = quantile_of(np.append(excess, [self.supposed] * (missing + self.supposed_tracks)), 0.5)
        return shape, middle * shape / (2**shape - 1)


def exponent_of(excess: Array) -> float:
    """Exponent xi of a generalised Pareto law, 0 (exponential) at least.

    What one in ``2^k`` exceed is proportional to ``2^(k xi) - 1``: the upper eighth begins ``1 + 2^xi + 4^xi`` times as
    far out as the upper half.

    Parameters
    ----------
    excess
        ``(n,)`` what has it, positive.
    """
    ratio = quantile_of(excess, 0.875) / quantile_of(excess, 0.5)
    return math.log2((math.sqrt(4 * max(ratio, 3.0) - 3) - 1) / 2)
