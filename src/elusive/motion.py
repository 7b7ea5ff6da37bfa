"""How targets move: constant velocity, coordinated turn, constant acceleration, CTRV, and a random-walk intensity.

Bar-Shalom, Li and Kirubarajan (2001), ch. 6 and 11.7; Amrouche et al. (2018), sections 5.1 and 5.2.
"""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field
from scipy.linalg import block_diag, cholesky

from elusive.contracts import VX, VY, Array, X, Y
from elusive.model import Model, NonNegative, Positive

SERIES_BELOW = 0.2  # angle under which (a - sin a) / a^3 loses digits to cancellation


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
        sin, cos, along, across = _turn(w * T)
        f1, f2 = along * T, across * T
        return np.array([[1, f1, 0, -f2], [0, cos, 0, -sin], [0, f2, 1, f1], [0, sin, 0, cos]])

    @property
    def Q(self) -> Array:
        """Covariance of the process noise, ``(4, 4)``."""
        T = self.interval_s
        turn = float(np.deg2rad(self.turn_rate_deg)) * T
        lost = _arc_excess(turn)
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


class ConstantTurnRateVelocity(Model):
    """CTRV: constant speed on a circle whose turn rate is part of the state, both disturbed by white noise.

    The state is ``x, vx, y, vy, turn_rate`` (the last in rad/s), so that every sensor finds position and
    velocity where it expects them. The mean moves along the exact arc; the noise enters as a change of
    speed and of turn rate that is constant over the interval.
    """

    kind: Literal["ctrv"] = "ctrv"
    interval_s: Positive = Field(1.0, description="Time between two steps, T [s]")
    q_speed: NonNegative = Field(0.001, description="Variance of the along-track acceleration [px^2 or m^2 / s^4]")
    q_turn: NonNegative = Field(1e-4, description="Variance of the angular acceleration [rad^2 / s^4]")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return ("x", "vx", "y", "vy", "turn_rate")

    def propagate(self, states: Array, rng: Generator) -> Array:
        """Draw the states one interval later, ``(N, 5) -> (N, 5)``."""
        T = self.interval_s
        noise = rng.standard_normal((len(states), 2)) * np.sqrt([self.q_speed, self.q_turn])
        return self._flow(states, T, noise)

    def _flow(self, states: Array, T: float, noise: Array) -> Array:
        vx, vy, rate = states[:, VX], states[:, VY], states[:, 4]
        sin, cos, along, across = _turn(rate * T)
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


def square_root(covariance: Array) -> Array:
    """Lower-triangular root of a covariance; rows of components without noise are zero."""
    noisy = np.flatnonzero(np.diag(covariance) > 0)
    root = np.zeros_like(covariance)
    if noisy.size:
        scale = np.sqrt(np.diag(covariance)[noisy])
        correlation = covariance[np.ix_(noisy, noisy)] / np.outer(scale, scale)
        root[np.ix_(noisy, noisy)] = scale[:, None] * cholesky(correlation, lower=True)
    return root


def _turn(angle: Array | float) -> tuple[Array, Array, Array, Array]:
    """Sine, cosine, and the chord along (sin a / a) and across ((1 - cos a) / a) of a unit arc, finite at zero."""
    a = np.asarray(angle, dtype=np.float64)
    # 1 - cos a = 2 sin^2(a / 2) loses no digits near zero
    return np.sin(a), np.cos(a), np.sinc(a / np.pi), np.sin(a / 2) * np.sinc(a / (2 * np.pi))


def _arc_excess(angle: float) -> float:
    """Return ``(a - sin a) / a^3``, by its series where the difference would lose digits."""
    if abs(angle) > SERIES_BELOW:
        return float((angle - np.sin(angle)) / angle**3)
    a2 = angle**2
    return 1 / 6 - a2 / 120 * (1 - a2 / 42 * (1 - a2 / 72 * (1 - a2 / 110)))
