"""What a motion, a sensor, a piece of knowledge, a birth density and a filter must offer: small Protocols.

States are ``(N, d)`` float64 arrays, one row a particle. Every row begins ``x, vx, y, vy``; a model's own
components follow (accelerations, turn rate), and an intensity, where there is one, stands last.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Array = NDArray[np.float64]
X, VX, Y, VY, INTENSITY = 0, 1, 2, 3, -1

State = TypeVar("State")
Measurement = TypeVar("Measurement", contravariant=True)


@runtime_checkable
class Motion(Protocol):
    """How a state evolves over one step."""

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the ``d`` components."""

    def propagate(self, states: Array, rng: Generator) -> Array:
        """Draw the states one step later, ``(N, d) -> (N, d)``."""


@runtime_checkable
class Sensor(Protocol):
    """What a measurement says of a state."""

    def log_likelihood(self, states: Array, measurement: Any) -> Array:
        """Log likelihood of each state, ``(N, d) -> (N,)``; for a detector, of present against absent."""


@runtime_checkable
class Knowledge(Protocol):
    """What is known of where a target can be (a map, a lane, a floor plan)."""

    def log_probability(self, states: Array) -> Array:
        """Log probability that each state is allowed, ``(N, d) -> (N,)``."""


class Births(NamedTuple):
    """Newborn states and what their weights must carry for having been drawn from a proposal."""

    states: Array  # (N, d)
    log_ratio: Array  # (N,) log p_b / q_b


@runtime_checkable
class Birth(Protocol):
    """Where a target appears."""

    def draw(self, n: int, measurement: Any, sensor: Any, state_names: tuple[str, ...], rng: Generator) -> Births:
        """Draw ``n`` newborn states with these components; ``measurement`` is None where a frame is missing."""


class Filter(Protocol[State, Measurement]):
    """A recursion over measurements. A missing measurement is ``None``: predict, do not update."""

    def init(self, rng: Generator) -> State:
        """Return the belief before the first measurement."""

    def step(self, state: State, measurement: Measurement | None, rng: Generator) -> State:
        """Return the belief after one more measurement."""
