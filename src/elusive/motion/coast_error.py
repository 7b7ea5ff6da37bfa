"""Any motion with the error of the charted coast at the target: a Gauss-Markov process along the target's way.

Bootsveld (2012), section 8.2, draws the coast's error anew at every step; here it stays while the target does (Gelb,
1974, section 3.8, for the process).
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.random import Generator
from pydantic import ConfigDict, Field, SerializeAsAny

from elusive.contracts import Array, Motion, X, Y
from elusive.model import Model, Positive, or_own


class WithCoastError(Model):
    """A motion and, as the two last components, how far the charted coast stands off there, in deviations.

    ``coast_u`` (east) and ``coast_v`` (north) are standard normal at any time. Over any time each keeps the share
    ``exp(-distance / correlation_m)`` of what it was.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    kind: Literal["coast_error"] = "coast_error"
    motion: Annotated[SerializeAsAny[Motion], or_own(Motion)] = Field(description="How the target moves")
    correlation_m: Positive = Field(200.0, description="Distance over which the error's correlation falls to 1/e [m]")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return (*self.motion.state_names, "coast_u", "coast_v")

    def propagate(self, states: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states an interval later, ``(N, d) -> (N, d)``; over 0 s they stay as they are."""
        if interval_s == 0:
            return states.copy(order="K")
        moved = np.empty(states.shape[::-1]).T
        moved[:, :-2] = self.motion.propagate(states[:, :-2], interval_s, rng)
        faded = np.hypot(moved[:, X] - states[:, X], moved[:, Y] - states[:, Y]) / self.correlation_m
        kept, fresh = np.exp(-faded), np.sqrt(-np.expm1(-2.0 * faded))
        noise = rng.standard_normal((2, len(states)))
        for column in (-2, -1):
            moved[:, column] = kept * states[:, column] + fresh * noise[column]
        return moved
