"""Compiled kernels of what is carried beside a target's belief: its looks, where it has been, whether it moves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array

SEEN = 1e-6  # probability of a peak below which nothing is learnt of a target's looks

Index = NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def recent(target: Index, peak: Index, share: Array, known: Array, new: Array, gain: float) -> tuple[Array, Array]:
    """Probability that each target has a peak, ``(n,)``, and its looks after that, ``(looks, n)``.

    Pair e of a ``target`` and a ``peak`` is right with probability ``share[e]``. ``known`` looks, ``(looks, n)``, go
    towards the mean of ``new``, ``(looks, m)`` of each peak, with a weight of ``gain``.
    """
    n = known.shape[1]
    hit, after = np.zeros(n), np.zeros((len(known), n))
    for e in range(len(target)):
        hit[target[e]] += share[e]
        for k in range(len(new)):
            after[k, target[e]] += share[e] * new[k, peak[e]]
    for k in range(len(known)):
        for i in range(n):
            mean = after[k, i] / max(hit[i], 1e-9)
            after[k, i] = known[k, i] + (gain * hit[i] * (mean - known[k, i]) if hit[i] > SEEN else 0.0)
    return hit, after


@njit(cache=True, nogil=True, error_model="numpy")
def ways(
    place: Array,
    weight: Array,
    latest: Array,
    offset: Array,
    origin: Array,
    lately: Array,
    usual: Array,
    strayed: Array,
) -> tuple[Array, Array, Array, Array, Array]:
    """Follow where targets have been by their places in all motions, ``(n, M, 2)`` with ``weight`` ``(n, M)``.

    ``latest`` ``(n,)`` is the weight of this frame in what is usual; ``offset`` ``(2,)`` is the scene's on the sensor.

    Returns
    -------
    tuple
        How far from their ``origin``, and from the earliest of the places ``lately``, ``(n,)`` each; those places,
        ``(n, k, 2)``; the usual ones in the scene and on the sensor, ``(n, 2, 2)``; squared distances from these.
    """
    n, kinds, hops = len(place), place.shape[1], lately.shape[1]
    far, hop, here = np.empty(n), np.empty(n), np.empty(2)
    places, means, squares = np.empty((n, hops, 2)), np.empty((n, 2, 2)), np.empty((n, 2))
    for i in range(n):
        for a in range(2):
            here[a] = 0.0
            for k in range(kinds):
                here[a] += weight[i, k] * place[i, k, a]
            for k in range(hops - 1):
                places[i, k, a] = lately[i, k + 1, a]
            places[i, hops - 1, a] = here[a]
        far[i] = np.sqrt((here[0] - origin[i, 0]) ** 2 + (here[1] - origin[i, 1]) ** 2)
        hop[i] = np.sqrt((here[0] - lately[i, 0, 0]) ** 2 + (here[1] - lately[i, 0, 1]) ** 2)
        for s in range(2):
            square = 0.0
            for a in range(2):
                off = here[a] + s * offset[a] - usual[i, s, a]
                square += off * off
                means[i, s, a] = usual[i, s, a] + latest[i] * off
            squares[i, s] = (1 - latest[i]) * (strayed[i, s] + latest[i] * square)
    return far, hop, places, means, squares


@njit(cache=True, nogil=True, error_model="numpy")
def moving(
    evidence: Array,
    resting: Array,
    place: Array,
    origin: Array,
    leash: Array,
    farthest: Array,
    hop: Array,
    age: Index,
    frames: int,
    least: float,
) -> Array:
    """Log evidence that targets move, ``(n,)``, see :meth:`elusive.tracking.peak_targets.PeakTargets.moving`.

    The first motions of ``place`` are the R ways of resting; a hop is made within some ``frames``; likelihoods are of
    ``least`` or more.
    """
    n, ways_of_resting = resting.shape
    found, rests = np.empty(n), np.empty(ways_of_resting)
    tightest = leash.min()
    for i in range(n):
        top, total = 0.0, 0.0
        for r in range(ways_of_resting):
            square = (place[i, r, 0] - origin[i, 0]) ** 2 + (place[i, r, 1] - origin[i, 1]) ** 2
            rests[r] = resting[i, r] - 0.5 * square / leash[r] ** 2
            top = max(top, rests[r])
        for r in range(ways_of_resting):
            total += np.exp(rests[r] - top)
        still = top + np.log(total / ways_of_resting + least)
        even = farthest[i] * min(frames / max(age[i], 1), 1.0)
        way = farthest[i] - min(max(hop[i] - even - tightest, 0.0), farthest[i])
        found[i] = min(evidence[i] - max(still, 0.0), 0.5 * (way / tightest) ** 2)
    return found
