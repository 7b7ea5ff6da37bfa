"""A sensor's field of view as a piece of knowledge: what it cannot see counts as absent."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

from elusive.contracts import Array, Knowledge
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
    """The field of view of a filter's own sensor: a target that leaves it is absent, and found anew if it comes back.

    A sensor without ``log_in_view`` has no edge.
    """

    kind: Literal["field_of_view"] = "field_of_view"

    def bind(self, sensor: Any) -> Knowledge | None:
        """Return the view of a sensor; None of a sensor without edges."""
        return View(sensor) if isinstance(sensor, SensorWithView) else None
