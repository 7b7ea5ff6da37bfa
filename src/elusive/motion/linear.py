"""Linear motions: nearly constant velocity, coordinated turn, nearly constant acceleration.

Bar-Shalom, Li and Kirubarajan (2001), ch. 6 and 11.7; Amrouche et al. (2018), section 5.1.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field
from scipy.linalg import block_diag, cholesky

from elusive.contracts import Array
from elusive.model import Model, NonNegative, Positive
from elusive.motion._arc import arc_excess, turn_chords


class LinearMotion(Model):
    """A motion ``s' = F s + v`` with Gaussian ``v`` of covariance ``Q``, both constant."""

    interval_s: Positive = Field(1.0, description="Time between two steps, T [s]")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return ("x", "vx", "y", "vy")

    @property
    def F(self) -> Array:
        """Transition matrix, ``(d, d)``."""
        raise AttributeError(f"{type(self).__name__} defines no transition matrix F.")

    @property
    def Q(self) -> Array:
        """Covariance of the process noise, ``(d, d)``."""
        raise AttributeError(f"{type(self).__name__} defines no process noise Q.")

    @cached_property
    def _step(self) -> tuple[Array, Array]:
        return np.ascontiguousarray(self.F), np.ascontiguousarray(square_root(self.Q))

    def propagate(self, states: Array, rng: Generator) -> Array:
        """Draw the states one interval later, ``(N, d) -> (N, d)``."""
        from elusive._kernels import propagate_linear

        return propagate_linear(states, *self._step, rng)


class ConstantVelocity(LinearMotion):
    """Nearly constant velocity: white acceleration on each axis."""

    kind: Literal["cv"] = "cv"
    q: NonNegative = Field(0.001, description="Power of the white acceleration, q1 [px^2 or m^2 / s^3]")

    @property
    def F(self) -> Array:
        """Transition matrix, ``(4, 4)``."""
        axis = np.array([[1.0, self.interval_s], [0.0, 1.0]])
        return np.asarray(block_diag(axis, axis))

    @property
    def Q(self) -> Array:
        """Covariance of the process noise, ``(4, 4)``."""
        T = self.interval_s
        axis = self.q * np.array([[T**3 / 3, T**2 / 2], [T**2 / 2, T]])
        return np.asarray(block_diag(axis, axis))


class CoordinatedTurn(LinearMotion):
    """A turn at a known constant rate; at rate zero it is constant velocity, without 0/0."""

    kind: Literal["ct"] = "ct"
    q: NonNegative = Field(0.001, description="Power of the white acceleration, q1 [px^2 or m^2 / s^3]")
    turn_rate_deg: float = Field(6.0, description="Turn rate Psi, from x towards y [degrees / s]")

    @property
    def F(self) -> Array:
        """Transition matrix, ``(4, 4)``."""
        w, T = np.deg2rad(self.turn_rate_deg), self.interval_s
        sin, cos, along, across = turn_chords(w * T)
        f1, f2 = along * T, across * T
        return np.array([[1, f1, 0, -f2], [0, cos, 0, -sin], [0, f2, 1, f1], [0, sin, 0, cos]])

    @property
    def Q(self) -> Array:
        """Covariance of the process noise, ``(4, 4)``."""
        T = self.interval_s
        turn = float(np.deg2rad(self.turn_rate_deg)) * T
        lost = arc_excess(turn)
        q1, q2, q3 = 2 * T**3 * lost, T**2 / 2 * np.sinc(turn / (2 * np.pi)) ** 2, T**2 * turn * lost
        return self.q * np.array([[q1, q2, 0, q3], [q2, T, -q3, 0], [0, -q3, q1, q2], [q3, 0, q2, T]])


class ConstantAcceleration(LinearMotion):
    """Nearly constant acceleration: white jerk on each axis."""

    kind: Literal["ca"] = "ca"
    q: NonNegative = Field(0.001, description="Power of the white jerk [px^2 or m^2 / s^5]")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return ("x", "vx", "y", "vy", "ax", "ay")

    @property
    def F(self) -> Array:
        """Transition matrix, ``(6, 6)``."""
        T = self.interval_s
        return self._by_axis(np.array([[1, T, T**2 / 2], [0, 1, T], [0, 0, 1]]))

    @property
    def Q(self) -> Array:
        """Covariance of the process noise, ``(6, 6)``."""
        T = self.interval_s
        axis = [[T**5 / 20, T**4 / 8, T**3 / 6], [T**4 / 8, T**3 / 3, T**2 / 2], [T**3 / 6, T**2 / 2, T]]
        return self.q * self._by_axis(np.array(axis))

    @staticmethod
    def _by_axis(block: Array) -> Array:
        """Put an axis' 3x3 block (position, velocity, acceleration) where the state keeps each axis."""
        whole = np.zeros((6, 6))
        for axis in ([0, 1, 4], [2, 3, 5]):
            whole[np.ix_(axis, axis)] = block
        return whole


def square_root(covariance: Array) -> Array:
    """Lower-triangular root of a covariance; rows of components without noise are zero."""
    noisy = np.flatnonzero(np.diag(covariance) > 0)
    root = np.zeros_like(covariance)
    if noisy.size:
        scale = np.sqrt(np.diag(covariance)[noisy])
        correlation = covariance[np.ix_(noisy, noisy)] / np.outer(scale, scale)
        root[np.ix_(noisy, noisy)] = scale[:, None] * cholesky(correlation, lower=True)
    return root
