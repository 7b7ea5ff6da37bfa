"""P(allowed) of a position between two imprecise bounds: a straight canal.

Bootsveld (2012), eq. 4.8: Phi = Phi_a(c - a) [1 - Phi_b(c - b)], the errors of the two bounds independent and Gaussian.
"""

from __future__ import annotations

from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from elusive.charts.constraints import log_between
from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError
from elusive.model import Model, NonNegative


class IntervalWater(Model):
    """Water between two parallel banks, each with its own error: a piece of knowledge that needs no chart."""

    kind: Literal["interval"] = "interval"
    lower_m: float = Field(-25.0, description="Lower bound as charted, a [m]")
    upper_m: float = Field(25.0, description="Upper bound as charted, b [m]")
    sigma_m: NonNegative = Field(7.0, description="Deviation of the lower bound's error; 0: a hard constraint [m]")
    upper_sigma_m: NonNegative | None = Field(
        None, description="Deviation of the upper bound's error [m]; None: as the lower's"
    )
    component: Literal["x", "y"] = Field("x", description="Component of the position that is bounded")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.lower_m < self.upper_m:
            raise ParameterError(
                f"IntervalWater.lower_m: must lie below upper_m (got {self.lower_m:g} and {self.upper_m:g})."
            )
        return self

    def probability(self, points: ArrayLike) -> Array:
        """P(allowed) at each of ``(N, 2)`` points [m], ``(N,)``."""
        return np.exp(self._log(np.asarray(points, dtype=np.float64)[:, 0 if self.component == "x" else 1]))

    def log_probability(self, states: Array) -> Array:
        """Log P(allowed) of ``(N, d)`` states x, vx, y, vy, ... [m], ``(N,)``; minus infinity beyond a hard bound."""
        return self._log(states[:, X if self.component == "x" else Y])

    def _log(self, at: Array) -> Array:
        upper = self.sigma_m if self.upper_sigma_m is None else self.upper_sigma_m
        return log_between(at, (self.lower_m, self.upper_m), self.sigma_m, upper)
