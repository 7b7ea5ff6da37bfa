"""Gains that drift: of what radios send and hear, and of channels, as supplies fall and oscillators warm up.

What a reading has risen by since the calibration is the sum of what its sender, its receiver and its channel have, and
of what people do to fewer than half of the links. The sums are fitted to all readings by least squares that forget,
weighed anew so that what is far tells nothing (Holland and Welsch, 1977, Communications in Statistics A 6(9), 813-827).
How fast gains drift, and whether they do at all, is what has foretold most readings so far, after Dawid (1984,
J. Royal Statistical Society A 147, 278-292): where they stay, nothing is taken out.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array, Flags
from elusive.sensors.radio_network import Indices, directed_links_of

MEMORIES_S, LEAST_FRAMES = (1.0, 4.0, 16.0), 2.0  # that gains are taken from
JUDGED_S, JUDGED_FRAMES = 10.0, 10.0  # that predictions are compared over
FEWEST_NODES = 8  # of fewer, gains are as many as links: whoever stands there is fitted by them
NEAR_SD = 2.0  # deviations about what is foretold, the scale within which a reading tells
PRIOR_DB = 3.0  # deviation of a gain before anything is known
# share of the readings that are foretold by gains that drift and not by those that stay: .01 at most of who walks or
# sits, .02 where people change half of the links, or a cabinet was moved
SURE = 0.03


class Drift(NamedTuple):
    """What the frames so far say of how gains have drifted, for each memory."""

    weights: Array  # (M, K, K) faded sums, of S senders, S receivers and C channels
    sums: Array  # (M, K)
    gains_db: Array  # (M, K)
    foretold: Array  # (M,) faded share of the readings that each foretells, less that of gains that stay
    chosen: int = -1  # of the memories; -1: gains stay

    @property
    def gain_db(self) -> Array:
        """By how much gains have drifted, ``(K,)``."""
        found: Array = self.gains_db[self.chosen] if self.chosen >= 0 else np.zeros(self.gains_db.shape[1])
        return found


def no_drift(nodes: int, channels: int) -> Drift:
    """Return what is known before the first frame."""
    memories, gains = len(MEMORIES_S), 2 * nodes + channels
    nothing = np.zeros((memories, gains))
    return Drift(np.zeros((memories, gains, gains)), nothing, nothing, np.zeros(memories))


def drift_after(before: Drift, rise_db: Array, sd_db: Array, away: Flags | None, interval_s: float) -> Drift:
    """Return what is known after one more frame.

    Parameters
    ----------
    before
        What was.
    rise_db
        ``(D, C)`` changes of the readings since the calibration, NaN where missing.
    sd_db
        ``(D, C)`` their deviations in the empty room.
    away
        ``(D,)`` directed links that run by nobody; the others tell nothing. None: nobody is known.
    interval_s
        Since the frame before.
    """
    nodes = (before.sums.shape[1] - rise_db.shape[1]) // 2
    if nodes < FEWEST_NODES:
        return before
    told = np.isfinite(rise_db) & (True if away is None else away[:, None])
    rise, parts = np.where(told, rise_db, 0.0), told / sd_db**2
    staying = np.exp(-0.5 * rise**2 * parts / NEAR_SD**2)
    weights, sums, gains, foretold = (one.copy() for one in before[:4])
    judged = _gain(interval_s, JUDGED_S, JUDGED_FRAMES)
    for k, memory_s in enumerate(MEMORIES_S):
        kept = 1 - _gain(interval_s, memory_s, LEAST_FRAMES)
        near = np.exp(-0.5 * (rise - of_drift(gains[k], nodes)) ** 2 * parts / NEAR_SD**2)
        foretold[k] += judged * (float((near - staying).sum()) / max(told.sum(), 1) - foretold[k])
        more, total = _normal_equations(near * parts, rise, nodes)
        weights[k], sums[k] = kept * weights[k] + more, kept * sums[k] + total
        gains[k] = _solved(weights[k], sums[k])
    best = int(foretold.argmax())
    return Drift(weights, sums, gains, foretold, best if foretold[best] > SURE else -1)


def gains_of(rise_db: Array, nodes: int) -> Array:
    """Return the gains ``(2 S + C,)`` that explain most of a frame's changes ``(D, C)``, NaN where missing [dB]."""
    heard = np.isfinite(rise_db)
    return _solved(*_normal_equations(heard.astype(np.float64), np.where(heard, rise_db, 0.0), nodes))


def of_drift(gains_db: Array, nodes: int) -> Array:
    """Return what gains ``(2 S + C,)`` add to the readings, ``(D, C)`` [dB]."""
    sender, receiver = _ends(nodes)
    sent, heard, channel = gains_db[:nodes], gains_db[nodes : 2 * nodes], gains_db[2 * nodes :]
    added: Array = (sent[sender] + heard[receiver])[:, None] + channel
    return added


def _gain(interval_s: float, memory_s: float, frames: float) -> float:
    return min(-math.expm1(-max(interval_s, 0.0) / memory_s), 1 / frames)


def _solved(weights: Array, sums: Array) -> Array:
    return np.asarray(np.linalg.solve(weights + np.eye(len(sums)) / PRIOR_DB**2, sums), dtype=np.float64)


@lru_cache(maxsize=8)
def _ends(nodes: int) -> tuple[Indices, Indices]:
    sender, receiver = directed_links_of(nodes).T
    return sender, receiver


def _normal_equations(weights: Array, rise: Array, nodes: int) -> tuple[Array, Array]:
    """Return sums of weights ``(D, C)`` over pairs of gains ``(K, K)``, and of weighed changes ``(K,)``."""
    channels = rise.shape[1]
    of_ends = np.zeros((2, nodes, nodes, channels))  # weights, and weighed changes
    of_ends[:, *_ends(nodes)] = weights, weights * rise
    (sent, total_sent), (heard, total_heard) = of_ends.sum(axis=2), of_ends.sum(axis=1)
    found = np.zeros((2 * nodes + channels, 2 * nodes + channels))
    found[:nodes, nodes : 2 * nodes] = of_ends[0].sum(axis=2)
    found[:nodes, 2 * nodes :], found[nodes : 2 * nodes, 2 * nodes :] = sent, heard
    found += found.T
    np.fill_diagonal(found, np.concatenate([sent.sum(axis=1), heard.sum(axis=1), sent.sum(axis=0)]))
    total = np.concatenate([total_sent.sum(axis=1), total_heard.sum(axis=1), total_sent.sum(axis=0)])
    return found, total
