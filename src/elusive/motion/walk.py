"""People's walk in continuous time: straight on, turns, and rare long steps; with many turns a random walk.

Mendieta (2017), section 3.3.3: stretches straight on, turns, standing still. Here turns come at a rate, each to a new
velocity: a velocity jump process (Othmer, Dunbar and Alt, 1988, J. Math. Biol. 26, 263-298). Over any interval the
state is drawn from three Gaussians: of who did not turn, of who did, and of who took a long step. Their moments are
the process's own, so that many short intervals and a long one have the same mean and covariance. Long steps let a
belief that has gone to the wrong place come back, where a single Gaussian would be sure of it: West (1981), J. Roy.
Stat. Soc. B 43(2), 157-166, on heavy tails.
"""

from __future__ import annotations

import math
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import VX, VY, Array, X, Y
from elusive.model import Model, NonNegative, Positive

LEAST_SHARE = 1e-6  # of the variance of a new velocity's way: where turns are rarest, what rounding leaves of it


class _Ways(NamedTuple):
    """Ways from the states, by kind: straight on, turned to each speed, long; and velocities at their ends."""

    log_share: Array  # (K,)
    mean: Array  # (K, N, 2) [m]
    variance: Array  # (K, N, 2)
    velocity: Array  # (K, N, 2) mean at the end [m/s]
    covariance: Array  # (K, N, 2) of way and velocity, on an axis
    velocity_variance: Array  # (K, N, 2)

    def log_density(self, way: Array) -> Array:
        """Log density of ways ``(N, 2)`` by kind, ``(K, N)``."""
        squared = (way - self.mean) ** 2 / self.variance + np.log(self.variance)
        density: Array = self.log_share[:, None] - math.log(2 * math.pi) - 0.5 * squared.sum(axis=2)
        return density


class Walk(Model):
    """A person keeps a velocity, with a little noise, until they turn to a new one."""

    kind: Literal["walk"] = "walk"
    speeds_mps: tuple[Positive, ...] = Field(
        (0.1, 0.3, 0.6, 1.2),
        min_length=1,
        description="Deviations of a new velocity on each axis, each as likely as the others [m/s]",
    )
    turn_rate_hz: float = Field(1.0, ge=1e-3, description="Turns to a new velocity; many: a random walk [1/s]")
    straight_q: NonNegative = Field(0.2, description="Power of the white acceleration between turns [m^2 / s^3]")
    long_step_m: Positive = Field(1.0, description="Deviation of a long step, each axis [m]")
    long_rate_hz: Positive = Field(0.008, description="Long steps [1/s]")

    state_names: ClassVar[tuple[str, ...]] = ("x", "vx", "y", "vy")

    @property
    def speed_sd_mps(self) -> float:
        """Deviation of a velocity on each axis, whatever its speed [m/s]."""
        return math.sqrt(sum(speed**2 for speed in self.speeds_mps) / len(self.speeds_mps))

    def moments(self, interval_s: float) -> tuple[Array, Array]:
        """Return the mean's matrix and the covariance of what is added, ``(4, 4)`` each, of all ways together.

        The covariance is that of velocities as they are in the long run.
        """
        rate, t = self.turn_rate_hz, interval_s
        kept, way = math.exp(-rate * t), -math.expm1(-rate * t) / rate
        spread = self.speed_sd_mps**2 + self.straight_q / rate
        added = spread * np.array([[2 * (t - way) / rate - way**2, way - way * kept], [way - way * kept, 1 - kept**2]])
        added[0, 0] += self.long_step_m**2 * self.long_rate_hz * t
        mean: Array = np.kron(np.eye(2), np.array([[1.0, way], [0.0, kept]]))
        covariance: Array = np.kron(np.eye(2), added).astype(np.float64)
        return mean, covariance

    def propagate(self, states: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states an interval later, ``(N, 4) -> (N, 4)``."""
        if interval_s == 0:
            return states
        ways = self._ways(states[:, [VX, VY]], interval_s)
        kind, rows = rng.choice(len(ways.log_share), len(states), p=np.exp(ways.log_share)), np.arange(len(states))
        noise = rng.standard_normal((len(states), 2))
        places = states[:, [X, Y]] + ways.mean[kind, rows] + np.sqrt(ways.variance[kind, rows]) * noise
        return self.arrived(states, places, interval_s, rng)

    def arrived(self, before: Array, places: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states ``(N, 4)`` of who was in the states ``before`` and is at the places ``(N, 2)`` now."""
        states = before.copy()
        states[:, [X, Y]] = places
        if interval_s == 0:
            return states
        ways, way = self._ways(before[:, [VX, VY]], interval_s), places - before[:, [X, Y]]
        share = ways.log_density(way)
        share = np.exp(share - share.max(axis=0)).cumsum(axis=0)
        kind, rows = (share < share[-1] * rng.random(len(way))).sum(axis=0), np.arange(len(way))
        gain = ways.covariance[kind, rows] / ways.variance[kind, rows]
        mean = ways.velocity[kind, rows] + gain * (way - ways.mean[kind, rows])
        left = np.maximum(ways.velocity_variance[kind, rows] - gain * ways.covariance[kind, rows], 0.0)
        states[:, [VX, VY]] = mean + np.sqrt(left) * rng.standard_normal(way.shape)
        return states

    def log_density(self, before: Array, places: Array, interval_s: float) -> Array:
        """Log density of the places ``(N, 2)`` an interval after the states ``(N, 4)`` [log 1/m^2], ``(N,)``."""
        density: Array = np.logaddexp.reduce(
            self._ways(before[:, [VX, VY]], interval_s).log_density(places - before[:, [X, Y]]), axis=0
        )
        return density

    def _ways(self, velocity: Array, t: float) -> _Ways:
        """Moments of the ways of an interval, from velocities ``(N, 2)``.

        Those of all ways solve the process's moment equations; those of who turned are what is left of them without
        who did not.
        """
        rate, q, squared = self.turn_rate_hz, self.straight_q, velocity**2
        kept, turned = math.exp(-rate * t), -math.expm1(-rate * t)
        straight = np.stack(
            [t * velocity, squared * t**2 + q * t**3 / 3, velocity, squared * t + q * t**2 / 2, squared + q * t]
        )

        def everybody(speed_sd_mps: float) -> Array:
            spread = speed_sd_mps**2 + q / rate  # variance of a velocity in the long run
            excess = squared - spread
            way2 = 2 * spread * (t - turned / rate) / rate + 2 * excess * (turned / rate - t * kept) / rate
            product = spread * turned / rate + excess * t * kept
            return np.stack([velocity * turned / rate, way2, velocity * kept, product, spread + excess * kept])

        others = [(everybody(speed) - kept * straight) / turned for speed in self.speeds_mps]
        way, way2, end, product, end2 = np.stack([straight, *others, everybody(self.speed_sd_mps)], axis=1)
        least = np.square([self.speed_sd_mps, *self.speeds_mps, self.speed_sd_mps])[:, None, None] * t**2
        variance = np.maximum(way2 - way**2, LEAST_SHARE * (least + q * t**3))
        steps = self.long_rate_hz * t
        long = -math.expm1(-steps)
        variance[-1] += self.long_step_m**2 * steps / long  # of as many long steps as there are on average
        speeds = len(self.speeds_mps)
        shares = np.array([(1 - long) * kept, *[(1 - long) * turned / speeds] * speeds, long])
        with np.errstate(divide="ignore"):  # nobody keeps a velocity for so long
            return _Ways(np.log(shares), way, variance, end, product - way * end, end2 - end**2)
