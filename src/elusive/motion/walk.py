"""People's steps: straight on as before, or in a new direction, or not at all; at one extreme a random walk.

Mendieta (2017), section 3.3.3: stretches straight on, turns, standing still. Rare long steps let a belief that has
gone to the wrong place come back, where a single Gaussian would be sure of it: West (1981), "Robust sequential
approximate Bayesian estimation", J. Roy. Stat. Soc. B 43(2), 157-166, on heavy tails.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import VX, VY, Array, X, Y
from elusive.model import Model, Positive, Probability


class Walk(Model):
    """A step is the last one with a little noise, or, with some probability, a new one about nought, rarely a long one.

    The velocity is the last step, in metres a frame.
    """

    kind: Literal["walk"] = "walk"
    step_m: Positive = Field(0.2, description="Deviation of a new step, each axis [m a frame]")
    straight_sd_m: Positive = Field(0.05, description="Deviation of a step from the last, straight on, each axis [m]")
    turn_probability: Probability = Field(1.0, description="Probability of a new step; 1: a random walk")
    long_step_m: Positive = Field(1.0, description="Deviation of a long step, each axis [m a frame]")
    long_probability: Probability = Field(0.005, description="Probability of a long step")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return "x", "vx", "y", "vy"

    @property
    def _shares(self) -> tuple[float, float, float]:
        """Probabilities of a long step, a new one and one straight on."""
        usual = 1 - self.long_probability
        return self.long_probability, usual * self.turn_probability, usual * (1 - self.turn_probability)

    def propagate(self, states: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states a frame later, ``(N, 4) -> (N, 4)``, however long it lasts; over 0 s they stay."""
        if interval_s == 0:
            return states.copy(order="K")
        long, new, _ = self._shares
        chance = rng.random((len(states), 1))
        noise = rng.standard_normal((len(states), 2))
        usual = np.where(chance < long + new, self.step_m * noise, states[:, [VX, VY]] + self.straight_sd_m * noise)
        return self.arrived(states, states[:, [X, Y]] + np.where(chance < long, self.long_step_m * noise, usual))

    def arrived(self, before: Array, places: Array) -> Array:
        """Return the states ``(N, 4)`` of who was in the states ``before`` and is at the places ``(N, 2)`` now."""
        states = np.empty((len(places), 4))
        states[:, [X, Y]] = places
        states[:, [VX, VY]] = places - before[:, [X, Y]]
        return states

    def log_density(self, before: Array, places: Array) -> Array:
        """Log density of the places ``(N, 2)`` a frame after the states ``(N, 4)`` [log 1/m^2], ``(N,)``."""
        long, new, straight = self._shares
        steps = places - before[:, [X, Y]]
        density = _log_normal(steps, self.long_step_m, long)
        density = np.logaddexp(density, _log_normal(steps, self.step_m, new))
        return np.logaddexp(density, _log_normal(steps - before[:, [VX, VY]], self.straight_sd_m, straight))


def _log_normal(steps: Array, sd: float, share: float) -> Array:
    if share == 0:
        return np.full(len(steps), -math.inf)
    squared: Array = np.einsum("ij,ij->i", steps, steps)
    return math.log(share / (2 * math.pi * sd**2)) - 0.5 / sd**2 * squared
