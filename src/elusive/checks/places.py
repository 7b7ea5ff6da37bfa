"""Leftovers that cluster: what a model calls noise lies independently over places.

Nearest neighbours: Clark and Evans (1954), eqs. 1-5; counts: Fisher's index of dispersion.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import chdtri, ndtri

from elusive.checks.finding import LEVEL, Fact
from elusive.contracts import Array

DEVIATION = 0.26136  # of a nearest distance's mean, sqrt((4 - pi) / (4 pi)), in 1 / sqrt(n density)


def nearest_of(places: Array, area: float, *, tolerance: float = 0.15, level: float = LEVEL) -> Fact:
    """Compare the mean distance to the nearest neighbour with that of independent places: less is clustered.

    Parameters
    ----------
    places
        ``(n, 2)``.
    area
        Of where they can be, in the square of their unit. Too large an area looks like clusters.
    tolerance
        Share that the mean may be too small.
    level
        Probability of a remark on independent places.

    Returns
    -------
    Fact
        Of the ratio; 1 is independent. Regular places, above 1, hold.
    """
    count = len(places)
    if count < 8:
        return Fact(1.0, math.nan, True, count)
    distance, _ = cKDTree(places).query(places, k=2)
    density = count / area
    seen = float(distance[:, 1].mean()) * 2 * math.sqrt(density)
    allowed = tolerance - ndtri(level) * 2 * DEVIATION / math.sqrt(count)
    return Fact(1.0, seen, seen >= 1 - allowed, count)


def dispersion_of(counts: Array, expected: Array, *, tolerance: float = 0.3, level: float = LEVEL) -> Fact:
    """Compare counts in cells with their expected numbers: the mean of (count - expected)^2 / expected is 1 if Poisson.

    Parameters
    ----------
    counts, expected
        ``(cells,)``; cells in which less than 0 is expected are left out. Expected numbers of one and more are best.
    tolerance
        By how much the mean may exceed 1.
    level
        Probability of a remark on Poisson counts of such expectations, by the chi-square law.
    """
    mean = np.asarray(expected, dtype=np.float64).ravel()
    there = mean > 0
    if there.sum() < 2:
        return Fact(1.0, math.nan, True, float(there.sum()))
    cells, mean = int(there.sum()), mean[there]
    seen = float(np.mean((np.asarray(counts).ravel()[there] - mean) ** 2 / mean))
    # a Poisson count of mean m has a squared deviation of variance 2 + 1/m: fewer degrees of freedom than cells
    freedom = cells * 2 / (2 + float(np.mean(1 / mean)))
    return Fact(1.0, seen, seen <= 1 + tolerance + chdtri(freedom, level) / freedom - 1, freedom)
