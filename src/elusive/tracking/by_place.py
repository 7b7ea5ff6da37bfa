"""Particles of a target that a sensor sees by its place alone: the place is drawn with the measurement in view.

Annealed from where the motion may have taken it, under the motion's own density of places, and the rest of the state
drawn given the place: the optimal proposal of Doucet, Godsill and Andrieu (2000), Statistics and Computing 10, 197-208,
by stages (:mod:`elusive.filters.particle.annealed`). A sharp measurement then needs hundreds of particles, not
millions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

from numpy.random import Generator

from elusive.contracts import AdditiveSensor, Array, X, Y
from elusive.filters.particle.annealed import anneal
from elusive.filters.particle.resampling import Indices

PLACE = [X, Y]


@runtime_checkable
class PlaceSensor(AdditiveSensor, Protocol):
    """A sensor to which nothing of a state but its place matters."""

    def expected_at(self, places: Array) -> Any:
        """Return what a target at each place ``(N, 2)`` adds: ``expected`` of its state."""

    def given(self, measurement: Any, others: Sequence[Any]) -> Callable[[Any], Array]:
        """Return ``log_ratio`` as a function of what is expected, for many calls."""


@runtime_checkable
class PlaceMotion(Protocol):
    """A motion whose places have a density, and whose states can be drawn given the place."""

    def log_density(self, before: Array, places: Array, interval_s: float) -> Array:
        """Log density of places ``(N, 2)`` an interval after states ``(N, d)``, ``(N,)``."""

    def arrived(self, before: Array, places: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states ``(N, d)`` of who was in the states ``before`` and is at the places ``(N, 2)`` now."""


class Placed(NamedTuple):
    """Particles whose places have been drawn, and not yet the rest of their states."""

    before: Array  # (N, d) states at the measurement before that the places come from
    places: Array  # (N, 2)
    interval_s: float
    log_evidence: float = 0.0  # of a target there against none
    ratio: Callable[[Any], Array] | None = None  # log likelihood ratio by which they were drawn; None before


class ByPlace(NamedTuple):
    """What places are drawn with."""

    motion: PlaceMotion
    sensor: PlaceSensor
    log_allowed: Callable[[Array], Array]  # of states (N, d), by all that is known: (N,)
    effective: float  # share of the particles that stays effective in a stage

    def update(self, placed: Placed, measurement: Any, others: Sequence[Any], rng: Generator) -> Placed:
        """Draw places from the prediction or, the second time, from the update given other effects of others.

        What is known of a place is asked with the other components as they were before.
        """
        expected, ratio = _once(self.sensor.expected_at), self.sensor.given(measurement, others)

        def level_before(places: Array) -> Array | float:
            return 0.0 if placed.ratio is None else placed.ratio(expected(places))

        earlier = _once(level_before)

        def log_prior(places: Array, origin: Indices) -> Array:
            before = placed.before[origin]
            density = self.motion.log_density(before, places, placed.interval_s) + earlier(places)
            before[:, PLACE] = places
            total: Array = density + self.log_allowed(before)
            return total

        def log_likelihood(places: Array) -> Array:
            gain: Array = ratio(expected(places)) - earlier(places)
            return gain

        after = anneal(placed.places, log_prior, log_likelihood, rng, effective=self.effective)
        log_evidence = placed.log_evidence + after.log_evidence
        return Placed(placed.before[after.origin], after.states, placed.interval_s, log_evidence, ratio)

    def arrived(self, placed: Placed, rng: Generator) -> Array:
        """Draw the states ``(N, d)`` given the places."""
        return self.motion.arrived(placed.before, placed.places, placed.interval_s, rng)


def _once(function: Callable[[Array], Any]) -> Callable[[Array], Any]:
    """Keep a function's latest value, for it is asked twice in a row for the same places."""
    latest: list[Any] = [None, None]

    def kept(places: Array) -> Any:
        if latest[0] is not places:
            latest[:] = places, function(places)
        return latest[1]

    return kept
