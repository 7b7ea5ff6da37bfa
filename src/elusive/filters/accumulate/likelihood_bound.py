"""Alarms from accumulated log likelihood ratios: how probable one so high is without a target, at most.

Without a target a likelihood ratio is one on the mean given all earlier frames, and so is, at most, the product of
ratios to powers from zero to one: by Markov's inequality a sum L of weighted log ratios reaches l with probability
``exp(-l)`` at most, however heavy the noise's tail (Wald (1945), section 3.1, for a single test). Over many
trajectories the bounds add up. It is as good as the noise model that the ratio comes from, and no better.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class LikelihoodBound(NamedTuple):
    """Bound on the score of a target-free map; has the methods of an extreme-value law."""

    trajectories: int  # cells times velocities
    gain: float  # weight of the newest frame, 1 - alpha
    deviation: float  # accumulated evidence is the score times this, plus the offset
    offset: float  # accumulated mean that was taken from the log ratios

    def threshold(self, probability: float) -> float:
        """Return a score that the largest of a target-free map exceeds with at most this probability."""
        return (self.gain * math.log(self.trajectories / probability) - self.offset) / self.deviation

    def probability(self, score: float) -> float:
        """Return the probability that the largest score of a target-free map exceeds this one, at most."""
        ratio = (score * self.deviation + self.offset) / self.gain
        return math.exp(min(0.0, math.log(self.trajectories) - ratio))
