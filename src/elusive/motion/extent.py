"""A straight motion with what a ship's hull carries: its length, and how many echoes it makes, which hardly change."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field
from scipy.linalg import block_diag

from elusive.contracts import Array
from elusive.model import NonNegative
from elusive.motion.linear import ConstantVelocity, LinearModel


class WithExtent(LinearModel):
    """Nearly constant velocity with, as the last components, the logarithms of a length [m] and of a rate of echoes."""

    kind: Literal["extent"] = "extent"
    motion: ConstantVelocity = Field(ConstantVelocity(), description="How the ship moves")
    q_extent: NonNegative = Field(1e-4, description="Power of the random walk of both logarithms [1 / s]")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return (*self.motion.state_names, "log_length", "log_echoes")

    def F(self, interval_s: float) -> Array:
        """Transition matrix, ``(6, 6)``."""
        return np.asarray(block_diag(self.motion.F(interval_s), np.eye(2)))

    def Q(self, interval_s: float) -> Array:
        """Covariance of the process noise, ``(6, 6)``."""
        return np.asarray(block_diag(self.motion.Q(interval_s), self.q_extent * interval_s * np.eye(2)))
