"""Linear motions: nearly constant velocity, coordinated turn, nearly constant acceleration.

Bar-Shalom, Li and Kirubarajan (2001), ch. 6 and 11.7; Amrouche et al. (2018), section 5.1.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field
from scipy.linalg import cholesky

from elusive.contracts import Array
from elusive.model import Model, NonNegative
from elusive.motion._arc import arc_excess, turn_chords

REMEMBERED = 8  # intervals whose matrices are kept: times that a clock has rounded give a few


class LinearModel(Model):
    """What every motion ``s' = F s + v`` with Gaussian ``v`` of covariance ``Q`` has, its fields aside."""

    def F(self, interval_s: float) -> Array:
        """Transition matrix over an interval, ``(d, d)``."""
        raise AttributeError(f"{type(self).__name__} defines no transition matrix F.")

    def Q(self, interval_s: float) -> Array:
        """Covariance of the process noise over an interval, ``(d, d)``."""
        raise AttributeError(f"{type(self).__name__} defines no process noise Q.")

    @cached_property
    def _steps(self) -> dict[float, tuple[Array, Array]]:
        """Transition and noise root of the last intervals asked for."""
        return {}

    def transition_root(self, interval_s: float) -> tuple[Array, Array]:
        """Transition matrix and lower-triangular root of the noise's covariance over an interval, ``(d, d)`` each."""
        step = self._steps.get(interval_s)
        if step is None:
            if len(self._steps) == REMEMBERED:
                self._steps.clear()
            root = square_root(self.Q(interval_s))
            step = self._steps[interval_s] = np.ascontiguousarray(self.F(interval_s)), np.ascontiguousarray(root)
        return step

    def propagate(self, states: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states an interval later, ``(N, d) -> (N, d)``; over 0 s they stay as they are."""
        if interval_s == 0:
            return states.copy(order="K")
        from elusive.motion._linear_kernels import propagate_linear

        return propagate_linear(states, *self.transition_root(interval_s), rng.random())


class LinearMotion(LinearModel):
    """A motion ``s' = F s + v`` with Gaussian ``v`` of covariance ``Q``, both a function of the interval alone."""

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return ("x", "vx", "y", "vy")


class ConstantVelocity(LinearMotion):
    """Nearly constant velocity: white acceleration on each axis."""

    kind: Literal["cv"] = "cv"
    q: NonNegative = Field(0.001, description="Power of the white acceleration, q1 [px^2 or m^2 / s^3]")

    def F(self, interval_s: float) -> Array:
        """Transition matrix, ``(4, 4)``."""
        T = interval_s
        return np.array([[1.0, T, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, T], [0.0, 0.0, 0.0, 1.0]])

    def Q(self, interval_s: float) -> Array:
        """Covariance of the process noise, ``(4, 4)``."""
        T = interval_s
        a, b = T**3 / 3, T**2 / 2
        return self.q * np.array([[a, b, 0.0, 0.0], [b, T, 0.0, 0.0], [0.0, 0.0, a, b], [0.0, 0.0, b, T]])


class CoordinatedTurn(LinearMotion):
    """A turn at a known constant rate; at rate zero it is constant velocity, without 0/0."""

    kind: Literal["ct"] = "ct"
    q: NonNegative = Field(0.001, description="Power of the white acceleration, q1 [px^2 or m^2 / s^3]")
    turn_rate_deg: float = Field(6.0, description="Turn rate Psi, from x towards y [degrees / s]")

    def F(self, interval_s: float) -> Array:
        """Transition matrix, ``(4, 4)``."""
        w, T = np.deg2rad(self.turn_rate_deg), interval_s
        sin, cos, along, across = turn_chords(w * T)
        f1, f2 = along * T, across * T
        return np.array([[1, f1, 0, -f2], [0, cos, 0, -sin], [0, f2, 1, f1], [0, sin, 0, cos]])

    def Q(self, interval_s: float) -> Array:
        """Covariance of the process noise, ``(4, 4)``."""
        T = interval_s
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

    def F(self, interval_s: float) -> Array:
        """Transition matrix, ``(6, 6)``."""
        T = interval_s
        return self._by_axis(np.array([[1, T, T**2 / 2], [0, 1, T], [0, 0, 1]]))

    def Q(self, interval_s: float) -> Array:
        """Covariance of the process noise, ``(6, 6)``."""
        T = interval_s
        axis = [[T**5 / 20, T**4 / 8, T**3 / 6], [T**4 / 8, T**3 / 3, T**2 / 2], [T**3 / 6, T**2 / 2, T]]
        return self.q * self._by_axis(np.array(axis))

    @staticmethod
    def _by_axis(block: Array) -> Array:
        """Put an axis' 3x3 block (position, velocity, acceleration) where the state keeps each axis."""
        whole = np.zeros((6, 6))
        for axis in ([0, 1, 4], [2, 3, 5]):
            whole[np.ix_(axis, axis)] = block
        return whole


def transition(motion: Any, interval_s: float) -> tuple[Array, Array] | None:
    """F and Q over an interval of any motion that is linear, a user's own too; None of one that is not."""
    try:
        return motion.F(interval_s), motion.Q(interval_s)
    except AttributeError:
        return None


def square_root(covariance: Array) -> Array:
    """Lower-triangular root of a covariance; rows of components without noise are zero."""
    noisy = np.flatnonzero(np.diag(covariance) > 0)
    root = np.zeros_like(covariance)
    if noisy.size:
        scale = np.sqrt(np.diag(covariance)[noisy])
        correlation = covariance[np.ix_(noisy, noisy)] / np.outer(scale, scale)
        root[np.ix_(noisy, noisy)] = scale[:, None] * cholesky(correlation, lower=True)
    return root
