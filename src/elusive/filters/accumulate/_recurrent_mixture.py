"""Markov switching between the velocities of a bank, as sparse rows: which velocities each is mixed of.

Mazurek (2013), eq. 7b.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elusive.contracts import Array


class Mixture(NamedTuple):
    """Row v of the transposed Markov matrix: ``shares[e]`` of ``sources[e]``, e in ``starts[v]:starts[v + 1]``."""

    starts: NDArray[np.int64]  # (V + 1,)
    sources: NDArray[np.int64]
    shares: NDArray[np.floating[Any]]

    def scaled(self, ratio: float) -> Mixture:
        """Return the mixture where velocities change so many times as often; each keeps what is left."""
        own = self.sources == np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))
        shares = np.where(own, 1 - ratio * (1 - self.shares), ratio * self.shares)
        return self._replace(shares=shares.astype(self.shares.dtype))


def by_matrix(q: ArrayLike) -> Mixture:
    """Mixture of a Markov matrix ``q[v', v]``, from v' to v."""
    after, sources = np.nonzero(np.transpose(q))
    shares = np.transpose(q)[after, sources]
    starts = np.searchsorted(after, np.arange(len(np.asarray(q)) + 1))
    return Mixture(starts.astype(np.int64), sources.astype(np.int64), np.asarray(shares, dtype=np.float64))


def adjacent(vectors: Array, step: float, probability: float) -> Mixture:
    """Mixture over velocities at most one step away along each axis.

    A velocity has as many neighbours as the one with most, each ``probability`` over that number; what would leave
    the bank at its edge stays. So the matrix is symmetric, and nothing gathers anywhere.
    """
    count = len(vectors)
    from scipy.spatial import cKDTree  # slow to load

    pairs = cKDTree(vectors).query_pairs(step * (1 + 1e-9), p=np.inf, output_type="ndarray")
    one, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    neighbours = np.bincount(one, minlength=count)
    share = probability / max(1, int(neighbours.max()))
    v, sources = np.concatenate([np.arange(count), one]), np.concatenate([np.arange(count), other])
    shares = np.concatenate([1 - share * neighbours, np.full(len(one), share)])
    order = np.lexsort([sources, v])
    starts = np.searchsorted(v[order], np.arange(count + 1))
    return Mixture(starts.astype(np.int64), sources[order].astype(np.int64), shares[order])


def any_other(count: int, probability: float) -> Mixture:
    """Mixture over all other velocities alike, of two parts: itself, and the sum of all, which is source ``count``."""
    share = probability / (count - 1) if count > 1 else 0.0
    sources = np.stack([np.arange(count), np.full(count, count)], axis=1).ravel()
    own = 1 - probability - share if count > 1 else 1.0
    return Mixture(np.arange(0, 2 * count + 1, 2), sources, np.tile([own, share], count))
