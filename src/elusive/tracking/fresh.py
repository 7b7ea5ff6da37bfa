"""Fresh evidence at a track's predicted place, which tells whether a target is there and whether it has gone.

Likelihood ratios of a mean against none: Wald (1945) for confirmation, Page's (1954) cumulative sum for the end.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Self

FLUCTUATION = 0.5  # deviation of a target's evidence in one frame, to its mean, before it is known


class Fresh(NamedTuple):
    """What a track's place has shown since its first peak, in deviations of the frames' evidence."""

    level: float  # mean while the target is there
    spread: float  # mean square about it, at least one
    weight: float  # frames that the level stands for
    favour: float  # log likelihood ratio of that level against none
    best: float  # its largest so far
    against: float  # of none against the level, since the level was last seen
    pending: tuple[float, float, int]  # sum, sum of squares and number of frames since then

    @classmethod
    def expecting(cls, score: float, smoothing: float, seen: int, lasting: int | None = None) -> Self:
        """Return the start: the level that gives an average over ``seen`` frames this score, in the latest of them.

        P_k of eq. 7 of Mazurek (2013) is ``(1 - a^n)`` times the mean of what its trajectory saw in ``lasting`` frames,
        n, and nothing before; by default in all of them.
        """
        past, present = smoothing**seen, smoothing ** (lasting or seen)
        level = score * math.sqrt((1 - smoothing) / (1 + smoothing) * (1 + past) * (1 - past)) / (1 - present)
        frames = (1 + smoothing) / (1 - smoothing) * (1 - present) / (1 + present)
        return cls(level, 1.0 + (FLUCTUATION * level) ** 2, frames, 0.0, 0.0, 0.0, (0.0, 0.0, 0))

    def after(self, value: float, smoothing: float) -> Self:
        """Return the test after one more frame."""
        step = self.level * (value - self.level / 2) / self.spread
        favour = self.favour + step
        against = max(0.0, self.against - step)
        total, squares, count = self.pending
        total, squares, count = total + value, squares + value**2, count + 1
        told = self._replace(favour=favour, best=max(self.best, favour), against=against)
        if against > 0:
            return told._replace(pending=(total, squares, count))
        # the frames up to here belong to the target: only now, so that its absence does not lower the level
        weight = smoothing**count * self.weight + count
        share = count / weight
        level = (1 - share) * self.level + share * total / count
        about = squares / count - 2 * level * total / count + level**2
        spread = max(1.0, (1 - share) * self.spread + share * about)
        return told._replace(level=max(level, 0.0), spread=spread, weight=weight, pending=(0.0, 0.0, 0))
