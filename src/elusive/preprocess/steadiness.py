"""Whether levels keep to themselves from one second to the next: an analysis of variance of blocks of frames.

Fisher (1925), Statistical methods for research workers, chapter 7. Where nothing goes on from block to block, the means
of blocks differ as much as the readings within them let expect, however much these vary: the ratio is one. What goes to
and fro in less than a block has such a ratio too. Where somebody walks, levels differ everywhere: what they do
elsewhere is taken off, between blocks, and within them too, lest it hide what wanders.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array

BLOCK_S, BLOCK_FRAMES = 2.0, 2  # of a block, at least


class Steadiness(NamedTuple):
    """Sums over the readings ``(D, C)`` of blocks."""

    began_s: float  # of the block that goes on
    frames: int
    block: Array  # (3, D, C): times heard, their sum and sum of squares
    blocks: int
    whole: (
        Array  # (7, D, C): blocks heard, sum of means and of their squares, readings, squares within, weights, others
    )
    block_s: float = BLOCK_S

    @classmethod
    def none(cls, time_s: float, shape: tuple[int, ...], block_s: float = BLOCK_S) -> Steadiness:
        """Return the sums before the first frame, of blocks of so many seconds at least."""
        return cls(time_s, 0, np.zeros((3, *shape)), 0, np.zeros((7, *shape)), block_s)

    def after(self, time_s: float, levels: Array, weights: Array, others: Array) -> Steadiness:
        """Return the sums after a frame's levels, NaN where missing, each of a weight beside a place, and elsewhere.

        All are ``(D, C)``.
        """
        heard = np.isfinite(levels)
        known = np.where(heard, levels, 0.0)
        block, frames = self.block + np.array([heard, known, known**2]), self.frames + 1
        if time_s - self.began_s < self.block_s or frames < BLOCK_FRAMES:
            return self._replace(frames=frames, block=block)
        count = np.where(block[0] >= BLOCK_FRAMES, block[0], 0.0)
        told = count > 0
        mean = np.where(told, block[1] / np.maximum(count, 1.0), 0.0)
        within = np.where(told, block[2] - block[1] * mean, 0.0)
        shares = np.where(told, weights, 0.0), np.where(told, others, 0.0)
        whole = self.whole + np.array([told, mean, mean**2, count, within, *shares])
        return Steadiness(time_s, 0, np.zeros_like(block), self.blocks + 1, whole, self.block_s)

    @property
    def mean(self) -> Array:
        """Mean over blocks, ``(D, C)``; NaN where less than half of them heard anything."""
        blocks, means = self.whole[:2]
        return np.where(blocks > 0.5 * self.blocks, means / np.maximum(blocks, 1.0), np.nan)

    @property
    def within(self) -> Array:
        """Variance within blocks, ``(D, C)``; NaN where it is not known."""
        blocks, _, _, readings, squares = self.whole[:5]
        return np.where(readings > blocks, squares / np.maximum(readings - blocks, 1.0), np.nan)

    def ratio(self, expected: Array) -> tuple[float, float]:
        """Return the variance between blocks over that within them, and that within over what is expected.

        Of both, what there is elsewhere is taken off.

        Parameters
        ----------
        expected
            ``(D, C)`` variance of a reading.
        """
        blocks, means, squares, readings, _, weights, others = self.whole
        within = self.within
        told = (blocks > 0.5 * self.blocks) & (blocks > 1) & np.isfinite(within)
        n = np.maximum(blocks, 2.0)
        between = readings / n * (squares - means**2 / n) / (n - 1)

        def of(weights: Array) -> tuple[float, float]:
            share = np.where(told, weights, 0.0)
            usual = float((share * np.where(told, expected, 0.0)).sum())
            if usual <= 0:
                return math.nan, math.nan
            sums = [float((share * np.where(told, one, 0.0)).sum()) / usual for one in (between, within)]
            return sums[0], sums[1]

        beside, inside = of(weights)
        if not inside > 0:
            return math.nan, math.nan
        elsewhere, inside_there = of(others)
        if not inside_there > 0:
            return beside / inside, inside
        own = min(inside_there, 1.0) + max(inside - inside_there, 0.0)
        return 1 + (beside - inside - max(elsewhere - inside_there, 0.0)) / own, inside
