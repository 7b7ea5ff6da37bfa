"""False alarms in bands of range, each twice as wide as the one nearer, and sectors: sea clutter has a place.

Its power falls with a power of the range, so that bands of equal ratios follow it, and is greatest upwind (Ward, Tough
and Watts (2013), Sea clutter, 2nd edition, chapter 2). One does not depend on the other; within a band and a sector
alarms are uniform.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.sensors.radar_scans import TURN_RAD

BANDS, SECTORS = 6, 8  # that are estimated: the nearest band is a 63rd of the view
ROUNDS = 5
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


def sector_of(bearing_rad: Array, middle_rad: float, half_rad: float, sectors: int) -> NDArray[np.int64]:
    """Return which of the equal sectors between ``middle_rad`` - and + ``half_rad`` bearings lie in, ``(m,)``."""
    turned = (bearing_rad - (middle_rad - half_rad)) % TURN_RAD
    return np.asarray((turned / (2 * half_rad) * sectors).astype(np.int64).clip(0, sectors - 1))


def log_relative_sector(bearing_rad: Array, middle_rad: float, half_rad: float, shares: Sequence[float]) -> Array:
    """Log density at bearings, to that of the same number spread evenly over the view, ``(m,)``."""
    level = np.log(np.array(shares) / sum(shares) * len(shares))
    return np.asarray(level[sector_of(bearing_rad, middle_rad, half_rad, len(shares))])


def draw_bearings(rng: Generator, n: int, middle_rad: float, half_rad: float, shares: Sequence[float]) -> Array:
    """Draw bearings of false alarms, ``(n,)`` [rad]."""
    sector = rng.choice(len(shares), n, p=np.array(shares) / sum(shares))
    return middle_rad - half_rad + 2 * half_rad * (sector + rng.uniform(size=n)) / len(shares)


def draw_ranges(rng: Generator, n: int, low: float, high: float, shares: Sequence[float]) -> Array:
    """Draw ranges of false alarms, ``(n,)`` [m]."""
    limits = edges(low, high, len(shares))
    band = rng.choice(len(shares), n, p=np.array(shares) / sum(shares))
    return rng.uniform(limits[band], limits[band + 1])


def shares_of(counts: Array, sea: Array) -> tuple[Array, Array]:
    """Estimate the shares of bands and of sectors: means of Dirichlet posteriors about uniform ones.

    Parameters
    ----------
    counts
        Of false alarms, ``(bands, sectors)``.
    sea
        Share of each that was looked at, sea beside land, above zero.

    Returns
    -------
    tuple
        ``(bands,)`` and ``(sectors,)``.
    """
    even, level = np.array(uniform(len(counts))), np.full(counts.shape[1], 1 / counts.shape[1])
    bands, sectors = even, level
    for _ in range(ROUNDS):  # one marginal is seen through the other, where land hides a part
        bands = _shares(counts.sum(axis=1), sea @ sectors, even)
        sectors = _shares(counts.sum(axis=0), bands @ sea, level)
    return bands, sectors


def _shares(counts: Array, seen: Array, even: Array) -> Array:
    density = (counts + SURE * even * seen / (even * seen).sum()) / seen
    return np.asarray(density / density.sum())
