"""What people do to the links of a radio network; it adds up.

Effects add up over people: Thouin, Nannuru and Coates (2011), "Multi-target tracking for measurement models with
additive contributions", Proc. Fusion 2011; Nannuru, Li, Zeng, Coates and Yang (2013), "Radio-frequency tomography for
passive indoor multitarget tracking", IEEE Trans. Mobile Computing 12(12).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from elusive.contracts import Array


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
