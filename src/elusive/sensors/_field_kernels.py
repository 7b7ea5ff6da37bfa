"""Compiled kernel of the field's sensors: the power of a target at each state, at every sensor."""

from __future__ import annotations

import numpy as np

from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def power_at(places: Array, x: Array, y: Array, power: float, core2: float) -> Array:
    """Return ``power / (d^2 + core2)`` for each place ``(N, 2)`` and sensor ``(m,)``, ``(N, m)``."""
    found = np.empty((len(places), len(x)))
    for i in range(len(places)):
        px, py = places[i, 0], places[i, 1]
        row = found[i]
        for j in range(len(x)):
            dx, dy = px - x[j], py - y[j]
            row[j] = power / (dx * dx + dy * dy + core2)
    return found
