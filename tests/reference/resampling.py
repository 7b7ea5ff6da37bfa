"""Resampling as it is written in textbooks: cumulative sums, ``searchsorted`` and ``repeat``."""

from __future__ import annotations

import numpy as np


def systematic(weights, n, u0):
    """Douc, Cappe and Moulines (2005), section 2.4, by ``searchsorted``."""
    return np.searchsorted(np.cumsum(weights), (u0 + np.arange(n)) * (np.sum(weights) / n), side="right")


def systematic_by_repeat(weights, n, u0):
    """The same by counting the comb's teeth under each weight: the quick form in NumPy."""
    edges = np.cumsum(weights) * (n / np.sum(weights))
    below = np.ceil(edges - u0).astype(np.int64)
    below[-1] = n
    return np.repeat(np.arange(len(weights)), np.diff(below, prepend=0))


def at_points(weights, points):
    """Stratified and multinomial: the particle under each sorted point of [0, 1)."""
    return np.searchsorted(np.cumsum(weights), points * np.sum(weights), side="right")


def residual(weights, n, points):
    """Integer parts by ``repeat``, the rest multinomial at the sorted points."""
    expected = weights * (n / np.sum(weights))
    copies = np.floor(expected).astype(np.int64)
    rest = at_points(expected - copies, points)
    return np.sort(np.concatenate([np.repeat(np.arange(len(weights)), copies), rest]))
