"""Sensors on a field that each report one sum: the power of all targets, falling off with the square of the distance.

Davies and Garcia-Fernandez (2024), IEEE Trans. Signal Process. 72, 607-620, section VI:
``z = sum a / (d^2 + b^2) + v``.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal

import numpy as np
from pydantic import Field

from elusive.contracts import Array, X, Y
from elusive.model import Positive
from elusive.sensors.additive import DenseAdditiveSensor


class FieldSensors(DenseAdditiveSensor):
    """Power received at places on a field."""

    kind: Literal["field"] = "field"
    positions_m: tuple[tuple[float, float], ...] = Field(min_length=1, description="x and y of each sensor [m]")
    power: Positive = Field(500.0, description="Power of a target, a [units of the reading times m^2]")
    core_m: Positive = Field(5.0, description="Distance under which the power no longer grows, b [m]")
    noise_sd: Positive = Field(1.0, description="Deviation of a reading's noise [units of the reading]")

    @cached_property
    def noise_variance(self) -> Array:
        """Variance of each reading's noise, ``(m,)``."""
        return np.full(len(self.positions_m), self.noise_sd**2)

    @cached_property
    def _axes(self) -> tuple[Array, Array]:
        x, y = np.array(self.positions_m).T
        return x.copy(), y.copy()

    def added(self, states: Array) -> Array:
        """Return what a target at each state adds to every reading, ``(N, d) -> (N, m)``."""
        from elusive.sensors._field_kernels import power_at

        return power_at(np.ascontiguousarray(states[:, [X, Y]]), *self._axes, self.power, self.core_m**2)
