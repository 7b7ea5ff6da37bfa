"""A level that changes along a frame: each sample in deviations of those about it.

As radars do before they detect (Finn and Johnson, 1968), but only where that predicts the samples better than the
level of the whole frame does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.preprocess.levels import block_sums, hidden_sum, log_density, normal

SHARES = (1, 4, 16)  # of a frame that a level is taken from, one in so many
LEAST_WINDOWS = 8  # that it is taken from at least
JUDGED_FRAMES = 100.0  # that predictions are compared over


class Trend(NamedTuple):
    """What the frames so far say of how the level changes along a frame."""

    reaches: tuple[int, ...]  # samples to each side that tell a level, the whole frame first
    guard: int  # to each side, nearest, that do not: an object may be there
    gains: Array  # (reaches, blocks) log evidence for each
    chosen: int  # of the reaches; 0: the level is the same all along


def no_trend(samples: int, window: int) -> Trend:
    """Return what is known before the first frame."""
    reaches = tuple(samples // share for share in SHARES if share == 1 or samples // share >= LEAST_WINDOWS * window)
    return Trend(reaches, window, np.zeros((len(reaches), -(-samples // window))), 0)


def flattened(state: Trend, parts: Array) -> tuple[Trend, Array]:
    """Return what is known after one more frame, and the frame with one level, of mean square about one.

    ``parts`` is ``(1, n)``, or ``(2, n)`` of a complex frame, of mean square one.
    """
    squared = parts**2
    levels = [_about(squared.mean(axis=0), reach, state.guard) for reach in state.reaches]
    blocks = state.gains.shape[-1]
    fresh = [block_sums(log_density(squared, level, count * len(parts)).sum(axis=0), blocks) for level, count in levels]
    gains = (1 - 1 / JUDGED_FRAMES) * state.gains + np.array(fresh)
    chosen = int(hidden_sum(gains - gains[0]).argmax())
    after = state._replace(gains=gains, chosen=chosen)
    if chosen == 0:
        return after, parts
    level, count = levels[chosen]
    return after, normal(parts, level, count * len(parts))


def _about(power: Array, reach: int, guard: int) -> tuple[Array, Array]:
    """Mean of the samples within reach to either side but for the nearest, and how many they are; no ring."""
    n, at = len(power), np.arange(len(power))
    total = np.concatenate([[0.0], np.cumsum(power)])
    sums, counts = np.zeros(n), np.zeros(n)
    for half, sign in ((reach, 1), (guard, -1)):
        first, last = np.maximum(at - half, 0), np.minimum(at + half + 1, n)
        sums += sign * (total[last] - total[first])
        counts += sign * (last - first)
    counts = np.maximum(counts, 1.0)
    return np.maximum(sums, 1e-12) / counts, counts
