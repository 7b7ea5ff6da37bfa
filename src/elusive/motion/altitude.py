"""Height beside any motion in the plane: nearly constant vertical velocity, independent of the rest.

Bar-Shalom, Li and Kirubarajan (2001), section 6.2.2. The state begins x, vx, y, vy, z, vz; the plane's own components
follow.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from elusive.contracts import Array
from elusive.model import NonNegative
from elusive.motion.linear import ConstantAcceleration, ConstantVelocity, CoordinatedTurn, LinearMotion

PLANE = Field(discriminator="kind", description="How the target moves over the ground")


class WithAltitude(LinearMotion):
    """A linear motion in the plane, and white vertical acceleration."""

    kind: Literal["altitude"] = "altitude"
    motion: ConstantVelocity | ConstantAcceleration | CoordinatedTurn = PLANE
    q_vertical: NonNegative = Field(0.001, description="Power of the white vertical acceleration [m^2 / s^3]")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        plane = self.motion.state_names
        return (*plane[:4], "z", "vz", *plane[4:])

    def F(self, interval_s: float) -> Array:
        """Transition matrix, ``(d, d)``."""
        return self._with(self.motion.F(interval_s), np.array([[1.0, interval_s], [0.0, 1.0]]))

    def Q(self, interval_s: float) -> Array:
        """Covariance of the process noise, ``(d, d)``."""
        T = interval_s
        return self._with(self.motion.Q(T), self.q_vertical * np.array([[T**3 / 3, T**2 / 2], [T**2 / 2, T]]))

    def _with(self, plane: Array, vertical: Array) -> Array:
        d = len(plane) + 2
        whole = np.zeros((d, d))
        kept = np.r_[0:4, 6:d]
        whole[np.ix_(kept, kept)] = plane
        whole[4:6, 4:6] = vertical
        return whole
