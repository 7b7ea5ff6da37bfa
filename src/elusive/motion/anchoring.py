"""A target that moves or lies at anchor: a Markov switch a particle, the velocity at anchor an Ornstein-Uhlenbeck one.

Blom and Bar-Shalom (1988) for the switch; Uhlenbeck and Ornstein (1930) for the swing. Bootsveld (2012), section 8.3,
leaves targets at anchor open.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import VX, VY, Array, X, Y
from elusive.model import Model, NonNegative, Positive
from elusive.motion.linear import REMEMBERED, ConstantVelocity, square_root

SERIES_BELOW = 0.5  # interval over swing time under which the variance of the way loses digits to cancellation
TERMS = 18  # of its series: the next is below the rounding there


class MovingOrAnchored(Model):
    """Nearly constant velocity while it moves; at anchor it slows down and swings.

    The state is ``x, vx, y, vy, anchored``, the last 1 at anchor and 0 otherwise: the weighted mean of that column is
    the probability that the target lies at anchor.
    """

    kind: Literal["anchoring"] = "anchoring"
    q: NonNegative = Field(0.001, description="Power of the white acceleration while it moves, q1 [m^2 / s^3]")
    mean_moving_s: Positive = Field(3600.0, description="Mean time until a moving target anchors [s]")
    mean_anchored_s: Positive = Field(3600.0, description="Mean time that a target lies at anchor [s]")
    swing_mps: NonNegative = Field(0.1, description="Deviation of the velocity at anchor on each axis [m/s]")
    swing_s: Positive = Field(20.0, description="Time in which the velocity at anchor forgets what it was [s]")

    state_names: ClassVar[tuple[str, ...]] = ("x", "vx", "y", "vy", "anchored")

    @property
    def anchored_share(self) -> float:
        """Share of time at anchor in the long run: the probability before anything is measured."""
        return self.mean_anchored_s / (self.mean_anchored_s + self.mean_moving_s)

    def switching(self, interval_s: float) -> tuple[float, float]:
        """Probabilities that a moving target lies at anchor an interval later, and one at anchor moves."""
        settled = -math.expm1(-interval_s * (1 / self.mean_moving_s + 1 / self.mean_anchored_s))
        return self.anchored_share * settled, (1.0 - self.anchored_share) * settled

    @cached_property
    def _known(self) -> dict[float, tuple[tuple[Array, Array], tuple[Array, Array]]]:
        """The axes of the last intervals asked for."""
        return {}

    def _axes(self, interval_s: float) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Transition and noise root of one axis while moving and at anchor, ``(2, 2)`` each."""
        axes = self._known.get(interval_s)
        if axes is None:
            if len(self._known) == REMEMBERED:
                self._known.clear()
            moving = ConstantVelocity(q=self.q)
            F, Q = moving.F(interval_s)[:2, :2], moving.Q(interval_s)[:2, :2]
            F_anchor, Q_anchor = swing(interval_s, self.swing_mps, self.swing_s)
            axes = self._known[interval_s] = (F, square_root(Q)), (F_anchor, square_root(Q_anchor))
        return axes

    def propagate(self, states: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states an interval later, ``(N, 5) -> (N, 5)``: first whether it lies at anchor, then its way."""
        if interval_s == 0:
            return states.copy(order="K")
        stops, leaves = self.switching(interval_s)
        drawn, noise = rng.random(len(states)), rng.standard_normal((4, len(states)))
        anchored = np.where(states[:, 4] > 0.5, drawn >= leaves, drawn < stops)
        (F, root), (F_anchor, root_anchor) = self._axes(interval_s)
        moved = np.empty((5, len(states)))
        moved[4] = anchored
        for place, speed, (first, second) in ((X, VX, noise[:2]), (Y, VY, noise[2:])):
            p, v = states[:, place], states[:, speed]
            moved[place] = np.where(
                anchored,
                p + F_anchor[0, 1] * v + root_anchor[0, 0] * first,
                p + F[0, 1] * v + root[0, 0] * first,
            )
            moved[speed] = np.where(
                anchored,
                F_anchor[1, 1] * v + root_anchor[1, 0] * first + root_anchor[1, 1] * second,
                v + root[1, 0] * first + root[1, 1] * second,
            )
        return moved.T


def swing(interval_s: float, deviation: float, time_s: float) -> tuple[Array, Array]:
    """Transition and covariance of place and velocity, where the velocity is an Ornstein-Uhlenbeck process.

    Parameters
    ----------
    interval_s
        Time over which it moves [s].
    deviation
        Of the velocity in the long run [m/s].
    time_s
        In which the velocity's correlation falls to 1/e [s].

    Returns
    -------
    F, Q
        ``(2, 2)`` each.
    """
    x = interval_s / time_s
    lost = -math.expm1(-x)
    if x < SERIES_BELOW:
        way = sum((-x) ** n * (2.0 - 2.0 ** (n - 1)) / math.factorial(n) for n in range(3, TERMS))
    else:
        way = x - 2.0 * lost - 0.5 * math.expm1(-2.0 * x)
    F = np.array([[1.0, time_s * lost], [0.0, 1.0 - lost]])
    Q = deviation**2 * np.array([[2.0 * time_s**2 * way, time_s * lost**2], [time_s * lost**2, -math.expm1(-2.0 * x)]])
    return F, Q
