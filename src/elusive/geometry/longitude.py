"""Longitudes on both sides of the antimeridian."""

from __future__ import annotations

import numpy as np

from elusive.contracts import Array


def wrapped(lon_deg: float) -> float:
    """Return a longitude between -180 and 180; 180 stays."""
    return lon_deg if -180 <= lon_deg <= 180 else (lon_deg + 180) % 360 - 180


def unwrapped(lon_deg: Array) -> Array:
    """Add turns to longitudes so that they lie side by side: the widest gap among them is outside, not inside."""
    if not len(lon_deg) or lon_deg.max() - lon_deg.min() <= 180:
        return lon_deg
    around = np.unique(lon_deg % 360)
    widest = int(np.argmax(np.diff(around, append=around[0] + 360)))
    first = around[(widest + 1) % len(around)]
    return np.asarray(lon_deg + 360 * np.ceil((first - lon_deg) / 360 - 1e-12))  # whole turns: no digit is lost
