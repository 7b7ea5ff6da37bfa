"""What people do to the links of a radio network; it adds up.

Effects add up over people: Thouin, Nannuru and Coates (2011), "Multi-target tracking for measurement models with
additive contributions", Proc. Fusion 2011; Nannuru, Li, Zeng, Coates and Yang (2013), "Radio-frequency tomography for
passive indoor multitarget tracking", IEEE Trans. Mobile Computing 12(12).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from elusive.contracts import Array, X, Y


class Effect(NamedTuple):
    """What a person does to each reading: what it is expected to change by, and the variance that this adds."""

    mean: Array
    variance: Array
    existence: float = 1.0  # of the person


def total(people: Sequence[Effect], noise: Array) -> tuple[Array | float, Array]:
    """Sum of what people do, and of their variances and the noise's."""
    mean: Array | float = sum(person.mean for person in people)
    return mean, noise + sum(person.variance for person in people)


def people_of(effects: Sequence[Effect]) -> float:
    """Return how many people there are expected to be."""
    return sum(effect.existence for effect in effects)


class LinkSensor(ABC):
    """What links change by with people about, as a sensor of the state of one more person."""

    @abstractmethod
    def expected_at(self, places: Array) -> Array:
        """Return what is expected of a person at each place ``(N, 2)``, as the other methods take it."""

    @abstractmethod
    def given(self, measurement: Any, others: Sequence[Effect]) -> Callable[[Array], Array]:
        """Return :meth:`log_ratio` as a function of what is expected: the rest is worked out once."""

    def expected(self, states: Array) -> Array:
        """Return :meth:`expected_at` of the places of states ``(N, d)``."""
        return self.expected_at(states[:, [X, Y]])

    def log_ratio(self, expected: Array, measurement: Any, others: Sequence[Effect]) -> Array:
        """Log likelihood of one more person at each state less that of the others alone, ``(N,)``, tempered."""
        return self.given(measurement, others)(expected)

    def log_likelihood(self, states: Array, measurement: Any) -> Array:
        """Log likelihood ratio of one person at each state against nobody, ``(N, d) -> (N,)``, tempered."""
        return self.log_ratio(self.expected(states), measurement, ())
