"""How a peak may move in its scene: at rest in several ways, or moving, side by side in every track."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.model import Model, NonNegative, Positive, Probability

# a point at rest is seen where it is, wanders about it, sways, or hops now and then between the parts of what it is a
# part of: jitter, hop and walk, in the units of the model's
RESTING = ((0.0, 0.0, 1.0), (0.0, 0.0, 6.0), (0.5, 0.0, 1.0), (1.5, 0.0, 1.0), (0.0, 2.0, 1.0), (0.7, 4.0, 1.0))


class PeakMotions(Model):
    """Ways of resting, and three of moving: steadily, in any manner, fast; times are frames, places in the scene."""

    walk: NonNegative = Field(0.02, description="Drift of what rests, by the registration's errors [px / frame^.5]")
    sway: Positive = Field(1.0, description="What rests sways and hops by this many times .5 to 4 px")
    steady_speed: Positive = Field(0.4, description="Deviation of a steady target's velocity at first [px / frame]")
    steady_q: NonNegative = Field(0.0003, description="Acceleration of a steady target, q [px^2 / frame^3]")
    agile_speed: Positive = Field(2.5, description="Deviation of another's velocity at first [px / frame]")
    agile_q: NonNegative = Field(0.03, description="Its acceleration, q [px^2 / frame^3]")
    fast_speed: Positive = Field(8.0, description="Deviation of a fast target's velocity at first [px / frame]")
    fast_q: NonNegative = Field(0.3, description="Its acceleration, q [px^2 / frame^3]")
    fast_odds: Positive = Field(
        0.3, le=1, description="A fast target is this many times as likely beforehand as another that moves"
    )
    uneven: NonNegative = Field(
        0.7, description="Where frames are dropped or repeated: deviation of the way made, in speeds times frames"
    )
    uneven_share: Probability = Field(0.2, description="Share of the frames in which it is so, or in which a peak hops")
    set_off: Probability = Field(0.005, description="Probability that what rests starts to move within a frame")
    change: Probability = Field(0.02, description="Probability that what moves changes how, within a frame")
    moving_share: Probability = Field(0.2, description="Share of what appears that moves at once")

    @cached_property
    def table(self) -> Array:
        """Jitter, walk, acceleration, starting speed, unevenness, hop of each motion, ``(M, 6)``."""
        still = [
            (self.sway * jitter, self.walk * wander, 0.0, 0.0, 0.0, self.sway * hop) for jitter, hop, wander in RESTING
        ]
        moving = [
            (0.0, 0.0, self.steady_q, self.steady_speed, 0.0, 0.0),
            (0.0, 0.0, self.agile_q, self.agile_speed, self.uneven, 0.0),
            (0.0, 0.0, self.fast_q, self.fast_speed, self.uneven, 0.0),
        ]
        return np.array(still + moving)

    @property
    def rests(self) -> NDArray[np.bool_]:
        """Which motions are at rest, ``(M,)``."""
        return np.asarray(self.table[:, 3] == 0)

    @cached_property
    def leash(self) -> Array:
        """Deviation of a place from where it began, in each way of resting, ``(R,)`` [px]."""
        jitter, hop = self.table[self.rests][:, 0], self.table[self.rests][:, 5]
        return np.asarray(np.sqrt(self.sway**2 + jitter**2 + hop**2))

    @property
    def _moving(self) -> Array:
        """Probability of each motion given that it moves, ``(M,)``."""
        odds = np.where(self.rests, 0.0, 1.0)
        odds[-1] = self.fast_odds
        return np.asarray(odds / odds.sum())

    @cached_property
    def switch(self) -> Array:
        """Probability of each motion, a row, being followed by each, a column, a frame later."""
        rests, moving = self.rests, self._moving
        others = np.where(np.eye(len(moving), dtype=bool), 0.0, moving)
        leaves = np.where(rests, self.set_off, self.change)
        return np.asarray(np.diag(1 - leaves) + leaves[:, None] * others / others.sum(axis=1, keepdims=True))

    @property
    def first_weights(self) -> Array:
        """Probability of each motion of what has just appeared, ``(M,)``."""
        resting = self.rests / self.rests.sum()
        return np.asarray((1 - self.moving_share) * resting + self.moving_share * self._moving)
