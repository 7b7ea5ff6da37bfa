"""Whether somebody was there throughout a calibration; and what links read with nobody there, of a log without it.

Both directions of a link pass the same room, by radios whose noise is their own (reciprocity). What they have in common
from one frame to the next wanders in the room: whoever sits still breathes and sways. That is compared with what one
direction has in common with another link's, which keeps what each radio does in time, and with frames in another order,
which keeps what links have in common at one moment (permutations: Pitman, 1937, J. Roy. Stat. Soc. Suppl. 4, 119-130).
"""

from __future__ import annotations

import math
import warnings

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from elusive.contracts import Array
from elusive.preprocess.link_drift import gains_of, of_drift
from elusive.preprocess.robust import MAD
from elusive.sensors.radio_network import Indices, directions_of, links_of, nodes_of

FEWEST = 6  # frames that tell whether anything wanders
DRAWS = 100  # of unlike links, and of orders
LEAST_SD_DB = 0.5  # readings are often whole decibels
FARTHEST_SD = 3.0  # what one reading counts for at most
BLOCK, QUIET = 10, 0.1  # frames, and the quantile of such blocks in which a reading is taken for quiet


def wandering(dbm: Array) -> float:
    """Return how much both directions of links wander alike, in deviations of what chance does; NaN: not known.

    Parameters
    ----------
    dbm
        ``(K, D, C)`` levels of successive frames, NaN where missing.
    """
    nodes = nodes_of(dbm.shape[1])
    if len(dbm) < FEWEST or nodes * (nodes - 1) != dbm.shape[1]:
        return math.nan
    ends, rng = links_of(nodes), np.random.default_rng(0)
    scaled = _scaled(dbm, nodes)
    one, two = (scaled[:, way] for way in directions_of(nodes).T)

    def together(link: Indices, apart: NDArray[np.bool_]) -> Array:
        """Return sums of products of one direction and another link's other one, of all pairs of frames ``(K, K)``."""
        found: Array = np.tensordot(one[:, apart], two[:, link[apart]], ((1, 2), (1, 2)))
        return found + found.T

    every, frames, unlike = np.arange(len(ends), dtype=np.int64), np.arange(len(dbm)), list[float]()
    for _ in range(DRAWS):
        link = rng.permutation(every)
        apart = ~(ends[:, :, None] == ends[link][:, None, :]).any(axis=(1, 2))
        if apart.any():
            unlike.append(float(np.trace(together(link, apart), 1)) / math.sqrt(apart.mean()))
    products = together(every, every >= 0)
    orders = [rng.permutation(frames) for _ in range(DRAWS)]
    chance = [float(products[order[:-1], order[1:]].sum()) for order in orders]
    spread = max(float(np.std(sums)) if sums else 0.0 for sums in (unlike, chance))
    return (float(np.trace(products, 1)) - float(np.mean(chance))) / spread if spread > 0 else math.nan


def _scaled(dbm: Array, nodes: int) -> Array:
    """Return readings less their means and what gains do, in deviations; nought where missing."""
    with warnings.catch_warnings():  # readings that are never heard
        warnings.simplefilter("ignore", RuntimeWarning)
        left = dbm - np.nanmean(dbm, axis=0)
        left = np.array([rise - of_drift(gains_of(rise, nodes), nodes) for rise in left])
        found: Array = np.nan_to_num(left / np.nanstd(left, axis=0), posinf=0.0, neginf=0.0)
    return found


def emptied(dbm: Array, frames: int) -> Array:
    """Return frames of the empty room ``(frames, D, C)``, made up of what a log's readings mostly are.

    Nobody is by a link most of the time, so that its level is its median. Its noise is the lesser of two, each of which
    somebody makes greater: what both directions differ by, and what it varies by in quiet blocks.

    Parameters
    ----------
    dbm
        ``(T, D, C)`` of the log, in blocks of BLOCK successive frames, NaN where missing.
    frames
        How many.
    """
    with warnings.catch_warnings():  # readings that are never heard
        warnings.simplefilter("ignore", RuntimeWarning)
        level = np.nanmedian(dbm, axis=0)
        blocks = dbm[: len(dbm) // BLOCK * BLOCK].reshape(-1, BLOCK, *level.shape).var(axis=1, ddof=1)
        quiet = np.nanquantile(blocks, QUIET, axis=0) * (BLOCK - 1) / (2 * gammaincinv((BLOCK - 1) / 2, QUIET))
        one, two = directions_of(nodes_of(dbm.shape[1])).T
        apart = dbm[:, one] - dbm[:, two]
        apart -= np.nanmedian(apart, axis=0)
        most = FARTHEST_SD * np.maximum(MAD * np.nanmedian(np.abs(apart), axis=0), LEAST_SD_DB)
        differ = np.empty(level.shape)
        differ[one] = differ[two] = np.nanmean(np.clip(apart, -most, most) ** 2, axis=0) / 2
    noise = np.random.default_rng(0).standard_normal((frames, *level.shape))
    found: Array = level + np.sqrt(np.fmin(quiet, differ)) * (noise - noise.mean(axis=0))
    return found
