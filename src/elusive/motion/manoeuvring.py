"""Nearly constant velocity with manoeuvres: now and then the acceleration is far stronger than it mostly is.

Tukey (1960), A survey of sampling from contaminated distributions: a normal, and with a small probability a wider one.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array
from elusive.model import Probability
from elusive.motion.linear import ConstantVelocity


class ManoeuvringVelocity(ConstantVelocity):
    """White acceleration on each axis, whose power over an interval is one of two; ``q`` is their mean.

    Particles hold both: a target that flies straight is followed closely, and not lost where it turns. Gaussian filters
    take the mean.
    """

    kind: Literal["manoeuvring"] = "manoeuvring"  # type: ignore[assignment]
    share: Probability = Field(0.1, description="Probability that the target manoeuvres over an interval")
    times: float = Field(30.0, ge=1, description="Power of the acceleration then, in that of otherwise")

    def propagate(self, states: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states an interval later, ``(N, 4) -> (N, 4)``; over 0 s they stay as they are."""
        if interval_s == 0:
            return states.copy(order="K")
        F, root = self.transition_root(interval_s)
        calm = 1 / (1 + self.share * (self.times - 1))
        power = np.where(rng.random(len(states)) < self.share, calm * self.times, calm)
        noise = root @ rng.standard_normal((4, len(states)))
        return np.asarray((F @ states.T + np.sqrt(power) * noise).T)
