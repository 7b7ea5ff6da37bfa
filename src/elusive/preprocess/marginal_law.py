"""Noise that is not Gaussian: each sample as the normal score of its rank among those before (van der Waerden, 1952).

Heavy tails, envelopes and power are white Gaussian noise then, as any other. It is done where what the frames so far
hold predicts the next better than a Gaussian does (Dawid, 1984): what is Gaussian stays as it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from elusive.contracts import Array
from elusive.preprocess.levels import block_sums, hidden_sum

CELLS = 400  # that samples are counted in, from minus to plus infinity
REMEMBERED_FRAMES = 500.0
JUDGED_FRAMES = 200.0  # that predictions are compared over
PRIOR = 200.0  # samples that a Gaussian weighs
EVEN = 0.45  # of the variance that the squares of Gaussian noise have; uniform noise has .4 of it

_edges = 1 - CELLS / 2 / np.arange(1, CELLS // 2 + 1)  # of the lower cells, up to nought
_lower = np.maximum(np.diff(ndtr(_edges), prepend=0.0), np.finfo(float).tiny)
_GAUSSIAN = np.concatenate([_lower, _lower[::-1]])  # each cell's share
_middles = 2 * (np.arange(CELLS) + 0.5) / CELLS - 1
_SQUARES = (_middles / (1 - np.abs(_middles))) ** 2


class MarginalLaw(NamedTuple):
    """What the frames so far say of how their samples are distributed."""

    counts: Array  # (CELLS,) faded numbers of samples
    gains: Array  # (blocks,) log evidence for their law against a Gaussian

    @property
    def chosen(self) -> bool:
        """Whether it predicts better than a Gaussian, and was not limited: then nothing can be louder."""
        square = float(self.counts @ _SQUARES) / float(self.counts.sum())
        varies = float(self.counts @ _SQUARES**2) / float(self.counts.sum()) / square**2 - 1
        return float(hidden_sum(self.gains)) > 0 and varies > 2 * EVEN


def no_law(samples: int, block: int) -> MarginalLaw:
    """Return what is known before the first frame; blocks are as long as a window."""
    return MarginalLaw(PRIOR * _GAUSSIAN, np.zeros(-(-samples // block)))


def scored(law: MarginalLaw, parts: Array) -> Array:
    """Return normal scores of samples ``(..., n)`` of mean square one where that predicts better, else the samples."""
    if not law.chosen:
        return parts
    place = _place(parts)
    cell = place.astype(np.intp)
    below, total = np.cumsum(law.counts) - law.counts, law.counts.sum()
    rank = below[cell] + (place - cell) * law.counts[cell]
    found: Array = ndtri(np.clip(rank, 0.5, total - 0.5) / total)
    return found


def law_after(law: MarginalLaw, parts: Array, explained: NDArray[np.bool_] | None = None) -> MarginalLaw:
    """Return what is known after one more frame, ``(1, n)`` or ``(2, n)``, but for samples that objects explain."""
    told = np.ones(parts.shape) if explained is None else np.broadcast_to(1.0 - explained, parts.shape)
    cell = _place(parts).astype(np.intp)
    gain = told * np.log(law.counts / law.counts.sum() / _GAUSSIAN)[cell]
    fresh = np.bincount(cell.ravel(), told.ravel(), CELLS) + PRIOR / REMEMBERED_FRAMES * _GAUSSIAN
    return MarginalLaw(
        (1 - 1 / REMEMBERED_FRAMES) * law.counts + fresh,
        (1 - 1 / JUDGED_FRAMES) * law.gains + block_sums(gain.sum(axis=0), len(law.gains)),
    )


def _place(values: Array) -> Array:
    """Return where in the cells, from 0 to less than CELLS, values lie; cells are finest about nought."""
    place: Array = np.minimum((values / (1 + np.abs(values)) + 1) * (CELLS / 2), np.nextafter(CELLS, 0))
    return place
