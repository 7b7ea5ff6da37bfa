"""The median, and a Gaussian's deviation by it: over the median absolute one 1 / .6745 (Rousseeuw and Croux 1993)."""

from __future__ import annotations

import numpy as np

from elusive.contracts import Array

MAD = 1.4826


def median_of_known(values: Array) -> Array:
    """Return the median over the last axis, NaN left out; NaN where nothing else is."""
    ordered, known = np.sort(values, axis=-1), np.isfinite(values).sum(axis=-1)[..., None]  # NaN are sorted last
    low, high = (np.take_along_axis(ordered, np.maximum(known - one, 0) // 2, axis=-1)[..., 0] for one in (1, 0))
    half: Array = 0.5 * (low + high)
    return half
