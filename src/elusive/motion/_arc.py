"""Arithmetic of a circular arc that loses no digits near a straight line.

Bar-Shalom, Li and Kirubarajan (2001), section 11.7.
"""

from __future__ import annotations

import numpy as np

from elusive.contracts import Array

SERIES_BELOW = 0.2  # angle under which (a - sin a) / a^3 loses digits to cancellation


def turn_chords(angle: Array | float) -> tuple[Array, Array, Array, Array]:
    """Sine, cosine, and the chord along (sin a / a) and across ((1 - cos a) / a) of a unit arc, finite at zero."""
    a = np.asarray(angle, dtype=np.float64)
    # 1 - cos a = 2 sin^2(a / 2) loses no digits near zero
    return np.sin(a), np.cos(a), np.sinc(a / np.pi), np.sin(a / 2) * np.sinc(a / (2 * np.pi))


def arc_excess(angle: float) -> float:
    """Return ``(a - sin a) / a^3``, by its series where the difference would lose digits."""
    if abs(angle) > SERIES_BELOW:
        return float((angle - np.sin(angle)) / angle**3)
    a2 = angle**2
    return 1 / 6 - a2 / 120 * (1 - a2 / 42 * (1 - a2 / 72 * (1 - a2 / 110)))
