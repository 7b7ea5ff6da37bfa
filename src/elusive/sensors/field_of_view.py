"""A sensor's field of view as a piece of knowledge: what it cannot see counts as absent."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

from pydantic import Field

from elusive.contracts import Array, Knowledge
from elusive.geometry.areas import Area
from elusive.model import Model


@runtime_checkable
class SensorWithView(Protocol):
    """A sensor that says which states it can see."""

    def log_in_view(self, states: Array) -> Array:
        """0 of a state that a measurement can show, minus infinity of any other, ``(N, d) -> (N,)``."""


class View(NamedTuple):
    """The field of view of a sensor."""

    sensor: SensorWithView

    def log_probability(self, states: Array) -> Array:
        """Log probability that each state is in view, ``(N, d) -> (N,)``."""
        return self.sensor.log_in_view(states)


class FieldOfView(Model):
    """What a filter's sensor can see: a target that leaves it is absent, and found anew if it comes back.

    Without an area it is the sensor's own; a sensor without ``log_in_view`` has no edge.
    """

    kind: Literal["field_of_view"] = "field_of_view"
    area: Area | None = Field(None, description="Where targets are watched; none: what the sensor says it sees")

    def bind(self, sensor: Any) -> Knowledge | None:
        """Return the area, or the view of a sensor; None of a sensor without edges."""
        if self.area is not None:
            return self.area
        return View(sensor) if isinstance(sensor, SensorWithView) else None
