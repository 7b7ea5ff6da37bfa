"""Means over independent runs, and how far off they may be."""

from __future__ import annotations

import math

from elusive.contracts import Array


def mean_and_error(values: Array) -> tuple[float, float]:
    """Mean over runs ``(n,)`` and its standard error, NaN for a single one."""
    return float(values.mean()), standard_error(values)


def standard_error(values: Array) -> float:
    """Return the standard error of the mean over runs ``(n,)``; NaN for a single one."""
    return float(values.std(ddof=1)) / math.sqrt(len(values)) if len(values) > 1 else math.nan
