"""A bank of velocities: the straight trajectories that evidence is accumulated along, Mazurek (2013), eq. 7.

A trajectory of velocity v stands at cell ``p0 + rint(k v)`` in frame k, so that velocities may be fractional.
"""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.model import FROM_RECORDING, Model, Positive


class VelocityBank(Model):
    """A box of velocities, or any set of them, and what the border of the frame does."""

    max_velocity: float = Field(5.0, description="Largest velocity along each axis [samples / s]")
    min_velocity: float | None = Field(None, description="Smallest; by default minus the largest [samples / s]")
    velocity_step: Positive | None = Field(
        None, description="Step between velocities [samples / s]; none: 1, or as small as the object sought asks"
    )
    velocities: tuple[tuple[float, ...], ...] | None = Field(
        None,
        min_length=1,
        description="Velocities (vx,) or (vx, vy) instead of a box [samples / s]",
        json_schema_extra=FROM_RECORDING,
    )
    border: Literal["circular", "bounded"] = Field(
        "circular", description="What leaves the frame comes back at the other side, or is gone"
    )

    @model_validator(mode="after")
    def _makes_a_bank(self) -> Self:
        name = type(self).__name__
        if self.velocities is None:
            if self._lowest > self.max_velocity:
                raise ParameterError(
                    f"{name}.min_velocity: is {self._lowest:g}, above max_velocity {self.max_velocity:g}; "
                    "give a smaller one."
                )
        elif {len(vector) for vector in self.velocities} not in ({1}, {2}):
            raise ParameterError(f"{name}.velocities: must all be (vx,) or all be (vx, vy).")
        return self

    @property
    def step_between(self) -> float:
        """Step between velocities, one where none is given [samples / s]."""
        return self.velocity_step or 1.0

    @property
    def _lowest(self) -> float:
        return -self.max_velocity if self.min_velocity is None else self.min_velocity

    @property
    def _steps(self) -> tuple[int, int]:
        """Velocities of the box along one axis below the one it is counted from, and above."""
        room = 1e-9  # of a step, for rounding
        above = math.floor((self.max_velocity - (self.min_velocity or 0.0)) / self.step_between + room)
        return (above if self.min_velocity is None else 0), above

    def _axis(self) -> Array:
        """Velocities of the box along one axis; it holds zero unless a smallest one was given."""
        below, above = self._steps
        return (self.min_velocity or 0.0) + self.step_between * np.arange(-below, above + 1, dtype=np.float64)

    def count(self, ndim: int) -> int:
        """Return the number of velocities for frames of ``ndim`` axes."""
        return (sum(self._steps) + 1) ** ndim if self.velocities is None else len(self.velocities)

    def motion_vectors(self, ndim: int) -> Array:
        """Velocities of the bank for frames of ``ndim`` axes.

        Returns
        -------
        Array
            ``(V, ndim)`` in the order x[, y], samples a frame; ``state.velocity`` counts its rows.

        Raises
        ------
        DataError
            If ``velocities`` have another dimension.
        """
        if self.velocities is not None:
            if len(self.velocities[0]) != ndim:
                raise DataError(
                    f"velocities: have {len(self.velocities[0])} components, but the evidence has {ndim} axes; "
                    "give one component an axis."
                )
            return np.array(self.velocities, dtype=np.float64)
        axis = self._axis()
        if ndim == 1:
            return axis[:, None]
        # equal vx side by side: such planes are compared in one pass
        vx, vy = np.meshgrid(axis, axis, indexing="ij")
        return np.column_stack([vx.ravel(), vy.ravel()])


def step_for(length: float, smoothing: float) -> float:
    """Return a step between velocities that loses no object [samples a frame].

    The nearest velocity strays from an object's path by a quarter of its length over the filter's memory of
    ``1 / (1 - alpha)`` frames; the step is one at most.
    """
    return min(1.0, round(length * (1 - smoothing) / 2, 6))
