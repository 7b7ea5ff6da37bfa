"""False alarms in bands of range, each twice as wide as the one nearer: sea clutter is densest about the radar.

Its power falls with a power of the range (Ward, Tough and Watts (2013), Sea clutter, 2nd edition, chapter 2), so that
bands of equal ratios follow it; within a band alarms are uniform.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array

BANDS = 6  # that are estimated: the nearest is a 63rd of the view
SURE = 200.0  # plots that uniform ones count as: in a handful, those of a ship that is not yet known tell no band


def uniform(bands: int) -> tuple[float, ...]:
    """Shares of bands, one as dense as another."""
    return tuple((2.0 ** np.arange(bands) / (2.0**bands - 1)).tolist())


def edges(low: float, high: float, bands: int) -> Array:
    """Limits of the bands between the ranges of a view, ``(bands + 1,)`` [m]."""
    return np.asarray(low + (high - low) * (2.0 ** np.arange(bands + 1) - 1) / (2.0**bands - 1))


def log_relative(range_m: Array, low: float, high: float, shares: Sequence[float]) -> Array:
    """Log density at ranges, to that of the same number spread evenly from ``low`` to ``high``, ``(m,)``."""
    limits = edges(low, high, len(shares))
    level = np.log(np.array(shares) / sum(shares)) - np.log(np.diff(limits) / (high - low))
    return np.asarray(level[np.searchsorted(limits[1:-1], range_m, side="right")])


def draw_ranges(rng: Generator, n: int, low: float, high: float, shares: Sequence[float]) -> Array:
    """Draw ranges of false alarms, ``(n,)`` [m]."""
    limits = edges(low, high, len(shares))
    band = rng.choice(len(shares), n, p=np.array(shares) / sum(shares))
    return rng.uniform(limits[band], limits[band + 1])


def shares_of(counts: Array, seen: Array) -> Array:
    """Estimate the shares of bands from counts, ``(bands,)``: the mean of a Dirichlet posterior about uniform ones.

    ``seen`` is the share of each band that was looked at, sea beside land.
    """
    width = np.array(uniform(len(counts)))
    density = (counts + SURE * width * seen / (width * seen).sum()) / seen
    return np.asarray(density / density.sum())
