"""What people do to the links of a radio network; it adds up.

Effects add up over people: Thouin, Nannuru and Coates (2011), "Multi-target tracking for measurement models with
additive contributions", Proc. Fusion 2011; Nannuru, Li, Zeng, Coates and Yang (2013), "Radio-frequency tomography for
passive indoor multitarget tracking", IEEE Trans. Mobile Computing 12(12).
"""

from __future__ import annotations

from typing import NamedTuple

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
