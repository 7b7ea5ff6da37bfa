"""Any motion with an intensity that walks at random: Amrouche et al. (2018), section 5.2."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.random import Generator
from pydantic import Field
from scipy.linalg import block_diag

from elusive.contracts import Array
from elusive.model import Model, NonNegative
from elusive.motion.ctrv import ConstantTurnRateVelocity
from elusive.motion.linear import (
    ConstantAcceleration,
    ConstantVelocity,
    CoordinatedTurn,
    LinearMotion,
    square_root,
)

KinematicMotion = Annotated[
    ConstantVelocity | CoordinatedTurn | ConstantAcceleration | ConstantTurnRateVelocity, Field(discriminator="kind")
]


class WithIntensity(Model):
    """Any motion with an intensity that walks at random, added as the last component."""

    motion: KinematicMotion = Field(ConstantVelocity(), description="How the target moves")
    q_intensity: NonNegative = Field(0.01, description="Power of the intensity's random walk, q2 [I^2 / s]")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return (*self.motion.state_names, "intensity")

    @cached_property
    def _step(self) -> tuple[Array, Array] | None:
        if not isinstance(self.motion, LinearMotion):
            return None
        return np.ascontiguousarray(self.F), np.ascontiguousarray(square_root(self.Q))

    @property
    def F(self) -> Array:
        """Transition matrix of motion and intensity, ``(d, d)``; only where the motion is linear."""
        return np.asarray(block_diag(self._kinematic.F, np.eye(1)))

    @property
    def Q(self) -> Array:
        """Covariance of the process noise, ``(d, d)``; only where the motion is linear."""
        return np.asarray(block_diag(self._kinematic.Q, self.q_intensity * self.motion.interval_s * np.eye(1)))

    @property
    def _kinematic(self) -> LinearMotion:
        if isinstance(self.motion, LinearMotion):
            return self.motion
        raise AttributeError(f"{type(self.motion).__name__} is not linear: it has no F and Q.")

    def propagate(self, states: Array, rng: Generator) -> Array:
        """Draw the states one interval later, ``(N, d) -> (N, d)``."""
        if self._step is not None:
            from elusive._kernels import propagate_linear

            return propagate_linear(states, *self._step, rng)
        kinematic = self.motion.propagate(states[:, :-1], rng)
        step = np.sqrt(self.q_intensity * self.motion.interval_s)
        return np.column_stack([kinematic, states[:, -1] + step * rng.standard_normal(len(states))])
