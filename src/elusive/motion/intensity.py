"""Any motion with an intensity that walks at random: Amrouche et al. (2018), section 5.2."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field
from scipy.linalg import block_diag

from elusive.contracts import Array
from elusive.model import NonNegative
from elusive.motion.ctrv import ConstantTurnRateVelocity
from elusive.motion.linear import ConstantAcceleration, ConstantVelocity, CoordinatedTurn, LinearModel, LinearMotion

KinematicMotion = Annotated[
    ConstantVelocity | CoordinatedTurn | ConstantAcceleration | ConstantTurnRateVelocity, Field(discriminator="kind")
]


class WithIntensity(LinearModel):
    """Any motion with an intensity that walks at random, added as the last component."""

    kind: Literal["intensity"] = "intensity"
    motion: KinematicMotion = Field(ConstantVelocity(), description="How the target moves")
    q_intensity: NonNegative = Field(0.01, description="Power of the intensity's random walk, q2 [I^2 / s]")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return (*self.motion.state_names, "intensity")

    @cached_property
    def is_linear(self) -> bool:
        """Whether it has a transition matrix."""
        return isinstance(self.motion, LinearMotion)

    def F(self, interval_s: float) -> Array:
        """Transition matrix of motion and intensity, ``(d, d)``; only where the motion is linear."""
        return np.asarray(block_diag(self._kinematic.F(interval_s), np.eye(1)))

    def Q(self, interval_s: float) -> Array:
        """Covariance of the process noise, ``(d, d)``; only where the motion is linear."""
        return np.asarray(block_diag(self._kinematic.Q(interval_s), self.q_intensity * interval_s * np.eye(1)))

    @property
    def _kinematic(self) -> LinearMotion:
        if isinstance(self.motion, LinearMotion):
            return self.motion
        raise AttributeError(f"{type(self.motion).__name__} is not linear: it has no F and Q.")

    def propagate(self, states: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states an interval later, ``(N, d) -> (N, d)``; over 0 s they stay as they are."""
        if self.is_linear or interval_s == 0:
            return super().propagate(states, interval_s, rng)
        kinematic = self.motion.propagate(states[:, :-1], interval_s, rng)
        step = np.sqrt(self.q_intensity * interval_s)
        return np.column_stack([kinematic, states[:, -1] + step * rng.standard_normal(len(states))])
