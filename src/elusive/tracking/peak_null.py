"""Which tracks move, and which stand out, against what this recording's own clutter does.

Local false-discovery rate (Efron, 2004, J. Am. Stat. Assoc. 99, 96-104): of a recording's tracks nearly all are parts
of the scene, so that what they reach is the null distribution, whatever the noise is. Its tail is a generalised Pareto
law above a high quantile (Pickands, 1975); two pieces of evidence are joined as in Fisher (1932).
"""

from __future__ import annotations

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
    level: Probability = Field(0.9, description="Quantile of the tracks' evidence of moving, above which the tail is")
    least: Positive = Field(3.0, description="Evidence of moving above which the tail is, at least [nats]")
    shape: Positive = Field(0.3, description="Exponent of the tail, xi: how far it is from exponential")
    supposed: Positive = Field(4.0, description="Median excess over the level that is supposed beforehand [nats]")
    supposed_tracks: int = Field(3, ge=0, description="How many tracks that supposition counts for")

    def moves(self, moved: Array, rate: Array, null_moved: Array, null_rate: Array) -> Array:
        """Probability that each track moves, ``(n,)``.

        A recording without clutter has few tracks, and most of them may be targets, which are no null. What is missing
        of one is supposed: that many tracks reached nothing, but for the share above the level.

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
        supposed = np.full(round((1 - self.level) * (count - own)), self.supposed)
        excess = np.append(reached[reached > level] - level, supposed)
        middle = quantile_of(np.append(excess, [self.supposed] * self.supposed_tracks), 0.5)
        width = middle * self.shape / (2**self.shape - 1)
        beyond = (1 + self.shape * np.maximum(moved - level, 0.0) / width) ** (-1 / self.shape)
        by_motion = np.where(moved > level, (len(excess) + 1) / (count + 1) * beyond, 1.0)
        by_rate = (own - np.searchsorted(np.sort(null_rate), rate, "left") + 1) / (count + 1)
        joint = by_motion * by_rate
        expected = (count + 1) * joint * (1 - np.log(joint))
        return np.asarray(1 - np.minimum(1.0, expected))
