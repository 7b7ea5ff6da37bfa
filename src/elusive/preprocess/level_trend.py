"""A level that changes along a frame, and from frame to frame: each sample in deviations of those about it.

As radars do before they detect (Finn and Johnson, 1968), but only where that predicts the samples better than the
level of the whole frame does. Clutter whose level lasts for some frames is told by those before, too, nearer by.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess.levels import block_sums, hidden_sum, log_density, normal

SHARES = (1, 4, 16)  # of a frame that a level is taken from, one in so many
LEAST_WINDOWS = 8  # that it is taken from at least
LASTING = ((2, 16.0), (4, 4.0), (4, 16.0))  # windows to each side, and frames, that a level which lasts is taken from
JUDGED_FRAMES = 100.0  # that predictions are compared over


class Trend(NamedTuple):
    """What the frames so far say of how the level changes along a frame."""

    reaches: tuple[tuple[int, float], ...]  # samples to each side, and frames, that tell a level; a whole frame first
    guard: int  # to each side, nearest, that do not: an object may be there
    power: Array  # (reaches, n) faded sums of the frames
    frames: Array  # (reaches, n) that they stand for
    gains: Array  # (reaches, blocks) log evidence for each
    chosen: int  # of the reaches; 0: the level is the same all along


def no_trend(samples: int, window: int) -> Trend:
    """Return what is known before the first frame."""
    along = [(samples // share, 1.0) for share in SHARES if share == 1 or samples // share >= LEAST_WINDOWS * window]
    lasting = [(windows * window, frames) for windows, frames in LASTING if samples >= 4 * windows * window]
    reaches = (*along, *lasting)
    nothing = np.zeros((len(reaches), samples))
    return Trend(reaches, window, nothing, nothing, np.zeros((len(reaches), -(-samples // window))), 0)


def flattened(state: Trend, parts: Array, explained: NDArray[np.bool_] | None = None) -> tuple[Trend, Array]:
    """Return what is known after one more frame, and the frame with one level, of mean square about one.

    ``parts`` is ``(1, n)``, or ``(2, n)`` of a complex frame, of mean square one; samples that objects explain say
    nothing of levels.
    """
    squared = parts**2
    told = np.ones(parts.shape[1]) if explained is None else 1.0 - explained
    kept = np.array([[1 - 1 / frames] for _, frames in state.reaches])
    power, frames = kept * state.power + told * squared.mean(axis=0), kept * state.frames + told
    levels = [
        _about(total, seen, reach, state.guard)
        for total, seen, (reach, _) in zip(power, frames, state.reaches, strict=True)
    ]
    densities = [-0.5 * squared, *(log_density(squared, level, count * len(parts)) for level, count in levels[1:])]
    fresh = [block_sums(told * density.sum(axis=0), state.gains.shape[-1]) for density in densities]
    gains = (1 - 1 / JUDGED_FRAMES) * state.gains + np.array(fresh)
    chosen = int(hidden_sum(gains - gains[0]).argmax())
    after = state._replace(power=power, frames=frames, gains=gains, chosen=chosen)
    if chosen == 0:
        return after, parts
    level, count = levels[chosen]
    return after, normal(parts, level, count * len(parts))


def _about(power: Array, frames: Array, reach: int, guard: int) -> tuple[Array, Array]:
    """Mean of what was seen within reach to either side but for the nearest, and of how much; no ring."""
    n, at = len(power), np.arange(len(power))
    found = []
    for seen in (power, frames):
        total, sums = np.concatenate([[0.0], np.cumsum(seen)]), np.zeros(n)
        for half, sign in ((reach, 1), (guard, -1)):
            sums += sign * (total[np.minimum(at + half + 1, n)] - total[np.maximum(at - half, 0)])
        found.append(sums)
    counts = np.maximum(found[1], 1.0)
    return np.maximum(found[0], 1e-12) / counts, counts
