"""What people do to the links of a radio network, and what a filter for several of them needs of a sensor.

Effects add up over people: Thouin, Nannuru and Coates (2011), "Multi-target tracking for measurement models with
additive contributions", Proc. Fusion 2011; Nannuru, Li, Zeng, Coates and Yang (2013), "Radio-frequency tomography for
passive indoor multitarget tracking", IEEE Trans. Mobile Computing 12(12).
"""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

from numpy.random import Generator

from elusive.contracts import Array


class Effect(NamedTuple):
    """What people do to each reading: what it is expected to change by, and the variance that this adds."""

    mean: Array
    variance: Array

    def plus(self, other: Effect) -> Effect:
        """Effect of both."""
        return Effect(self.mean + other.mean, self.variance + other.variance)

    def minus(self, other: Effect) -> Effect:
        """Effect without the other's."""
        return Effect(self.mean - other.mean, self.variance - other.variance)


@runtime_checkable
class AdditiveSensor(Protocol):
    """A sensor of several targets whose effects add up."""

    @property
    def area(self) -> tuple[float, float, float, float]:
        """Where a target can be: least and greatest x, least and greatest y [m]."""

    def nobody(self) -> Effect:
        """Effect of nobody."""

    def effect(self, places: Array, existence: float) -> Effect:
        """Return the expected effect of a target that exists with a probability, at one of the places ``(N, 2)``."""

    def log_ratio(self, places: Array, measurement: Array, others: Effect) -> Array:
        """Log likelihood of one more target at each place, less that of the others alone, ``(N, 2) -> (N,)``."""

    def simulate(self, states: Array, rng: Generator) -> Array:
        """Draw a measurement of targets, a row of ``x, vx, y, vy`` each."""
