"""How alike the readings of a link err: learned from what the levels are under the people who are tracked.

Were readings independent, a link's scores would be uncorrelated; where a site differs from the model, all channels and
both directions of a link err together. The correlation tempers the likelihood, one over the design effect (Kish, 1965,
Survey sampling, section 5.4; of a composite likelihood: Varin, Reid and Firth, 2011, Statistica Sinica 21, 5-42), and
tells how far the places are bent that the model finds: a bias, which no residual shows by itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.sensors.radio_network import Indices

ALIKE = 0.25  # correlation within a link in a real basement: there its readings count for one
GREATEST = 4.0
PRIOR_FRAMES = 0.2  # that what is expected before any frame counts for
MEMORY_FRAMES = 1000.0


class Likeness(NamedTuple):
    """Sums over frames, a frame's readings having a weight of one."""

    alike: float = ALIKE * PRIOR_FRAMES
    weight: float = PRIOR_FRAMES

    @property
    def misfit(self) -> float:
        """How far the site is off the model: 0 it holds, 1 as far as a real basement."""
        return min(max(self.alike / self.weight, 0.0) / ALIKE, GREATEST)

    def after(self, standardised: Array, degrees: float, ways: Indices) -> Likeness:
        """Return the sums after a frame.

        Parameters
        ----------
        standardised
            ``(D, C)`` what each reading differs from what is expected, in its deviations; NaN where missing.
        degrees
            Of freedom of Student's t.
        ways
            ``(L, 2)`` rows of both directions of each link.
        """
        square = standardised**2
        scores = ((degrees + 1) * square / (degrees + square) - 1)[ways].reshape(len(ways), -1)
        heard = np.isfinite(scores)
        scores = np.where(heard, scores, 0.0)
        own = (scores**2).sum(axis=1)
        pairs = float(np.maximum(heard.sum(axis=1) - 1, 0) @ own)
        if pairs <= 0:
            return self
        together = float((scores.sum(axis=1) ** 2 - own).sum()) / pairs
        kept = min(1.0, MEMORY_FRAMES / (self.weight + 1.0))
        return Likeness(kept * (self.alike + together), kept * (self.weight + 1.0))
