"""Constant turn rate and velocity (CTRV): a circle whose turn rate is part of the state.

Bar-Shalom, Li and Kirubarajan (2001), section 11.7.
"""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import VX, VY, Array, X, Y
from elusive.model import Model, NonNegative
from elusive.motion._arc import turn_chords


class ConstantTurnRateVelocity(Model):
    """CTRV: constant speed on a circle whose turn rate is part of the state, both disturbed by white noise.

    The state is ``x, vx, y, vy, turn_rate`` (the last in rad/s), so that every sensor finds position and
    velocity where it expects them. The mean moves along the exact arc; the noise enters as a change of
    speed and of turn rate that is constant over the interval.
    """

    kind: Literal["ctrv"] = "ctrv"
    q_speed: NonNegative = Field(0.001, description="Variance of the along-track acceleration [px^2 or m^2 / s^4]")
    q_turn: NonNegative = Field(1e-4, description="Variance of the angular acceleration [rad^2 / s^4]")

    state_names: ClassVar[tuple[str, ...]] = ("x", "vx", "y", "vy", "turn_rate")

    def propagate(self, states: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states an interval later, ``(N, 5) -> (N, 5)``; over 0 s they stay as they are."""
        if interval_s == 0:
            return states.copy(order="K")
        T = interval_s
        noise = rng.standard_normal((len(states), 2)) * np.sqrt([self.q_speed, self.q_turn])
        vx, vy, rate = states[:, VX], states[:, VY], states[:, 4]
        sin, cos, along, across = turn_chords(rate * T)
        moved = np.empty_like(states)
        moved[:, X] = states[:, X] + T * (along * vx - across * vy)
        moved[:, Y] = states[:, Y] + T * (across * vx + along * vy)
        speed = np.hypot(vx, vy)
        still = speed == 0.0
        heading_x, heading_y = np.where(still, 1.0, vx) / np.where(still, 1.0, speed), vy / np.where(still, 1.0, speed)
        ahead_x, ahead_y = cos * heading_x - sin * heading_y, sin * heading_x + cos * heading_y
        moved[:, X] += T**2 / 2 * noise[:, 0] * heading_x
        moved[:, Y] += T**2 / 2 * noise[:, 0] * heading_y
        moved[:, VX] = (speed + T * noise[:, 0]) * ahead_x
        moved[:, VY] = (speed + T * noise[:, 0]) * ahead_y
        moved[:, 4] = rate + T * noise[:, 1]
        return moved
