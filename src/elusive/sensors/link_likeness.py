"""How alike the readings of a link err: learned from what the levels are under the people who are tracked.

Were readings independent, a link's scores would be uncorrelated; where a site differs from the model, all channels and
both directions of a link err together. The correlation tempers the likelihood, one over the design effect (Kish, 1965,
Survey sampling, section 5.4; of a composite likelihood: Varin, Reid and Firth, 2011, Statistica Sinica 21, 5-42), and
tells how far the places are bent that the model finds: a bias, which no residual shows by itself.

They err alike from frame to frame too. A filter that keeps a share a of its error until the next frame averages errors
whose correlation with the frame before is r; were they independent, its error's variance would be less by
(1 + a r) / (1 - a r), as of a first-order autoregression (Bartlett, 1946, J. Roy. Stat. Soc. Suppl. 8, 27-41).

What a site lets err beside a person goes on for seconds, and a second person fitted to it gains as somebody would. Of
what is fitted to the very errors it is judged by the log likelihood is too great by the design effect for each number
fitted: the trace of Takeuchi's criterion (Takeuchi, 1976, Suri Kagaku 153, 12-18; of a composite likelihood: Varin,
Reid and Firth, 2011). Errors that last are that; those made anew each frame are not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.sensors.radio_network import Indices

ALIKE = 0.25  # correlation within a link in a real basement: there its readings count for one
PERSISTENT = 0.85  # of that correlation, what there is with the frame before, there
GREATEST = 4.0
PRIOR_FRAMES = 0.2  # that what is expected before any frame counts for
MEMORY_FRAMES = 1000.0
PLACE = 2  # dimensions in which somebody's place is fitted
MOST_KEPT = 0.95  # beyond it, the frames of minutes would count for one


class Likeness(NamedTuple):
    """Sums over frames, a frame's readings having a weight of one."""

    alike: float = ALIKE * PRIOR_FRAMES
    weight: float = PRIOR_FRAMES
    later: float = PERSISTENT * ALIKE * PRIOR_FRAMES  # correlations with the frame before
    pairs: float = PRIOR_FRAMES  # of frames
    last: Array | None = None  # (L, 2) sum of the scores of each link in the frame before, and how many

    @property
    def misfit(self) -> float:
        """How far the site is off the model: 0 it holds, 1 as far as a real basement."""
        return min(max(self.alike / self.weight, 0.0) / ALIKE, GREATEST)

    @property
    def persistence(self) -> float:
        """How much of what a frame's readings err alike the next frame's do too, 0 to 1."""
        alike = self.alike / self.weight
        return min(max(self.later / self.pairs / alike, 0.0), 1.0) if alike > 0 else 0.0

    def over(self, kept: float) -> float:
        """Return how many frames count for one, if a share of the error is kept from one to the next."""
        together = min(kept * self.persistence, MOST_KEPT)
        return (1 + together) / (1 - together)

    def optimism(self, readings: float) -> float:
        """Log likelihood that somebody beside a person gains a frame from errors that the frames before have shown.

        Parameters
        ----------
        readings
            Of a link.

        Returns
        -------
        float
            Not tempered; 0 where readings err independently.
        """
        return PLACE * self.persistence * (readings - 1) * self.misfit

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
        own, many, sums = (scores**2).sum(axis=1), heard.sum(axis=1), scores.sum(axis=1)
        chances = float(np.maximum(many - 1, 0) @ own)
        if chances <= 0:
            return self._replace(last=None)
        kept = min(1.0, MEMORY_FRAMES / (self.weight + 1.0))
        together = float((sums**2 - own).sum()) / chances
        later, pairs = self.later, self.pairs
        if self.last is not None and (before := float(self.last[:, 1] @ own)) > 0:
            later, pairs = later + float(self.last[:, 0] @ sums) / before, pairs + 1.0
        last = np.column_stack([sums, many])
        return Likeness(kept * (self.alike + together), kept * (self.weight + 1.0), kept * later, kept * pairs, last)
