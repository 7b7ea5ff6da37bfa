"""How rare a peak is in this recording, in clutter of its kind: the tail of its noise peaks, learnt frame by frame.

Maxima of Gaussian noise beyond u have the density Lambda u exp(-u^2 / 2) (Adler and Taylor, 2007, ch. 14). What a
recording shows departs from it: each kind of clutter has its own density of peaks and its own mean excess (the scale
of a generalised Pareto tail; Coles, 2001, ch. 4), and the peaks of all kinds together give the tail's shape, which is
carried on along the quantile plot as a power beyond what was seen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array

LEAST = 2.0  # deviations from which a local maximum is a peak
PRIOR = 20.0  # peaks that all kinds together count for beside a kind's own
FRAMES = 40.0  # over which counts are averaged
SPARED = 3  # strongest peaks a frame that do not tell the tail: they may be targets
CLIP = 4.0  # excess, in mean ones, that one peak counts for at most
EXCESS = 0.4  # mean excess of maxima of Gaussian noise over LEAST
HEAVY = (1.3, 2.5)  # mean excess, in a Gaussian's, that parts light tails from heavier ones
EDGES = np.geomspace(0.02, 400.0, 80)  # of the histogram of excess

BOTH = np.array([0.5, 0.5])  # weights of a peak's kind and of its tile
Index = NDArray[np.int64]


class TailState(NamedTuple):
    """What the peaks so far have shown; ``pools`` are map and polarity.

    A group is a kind of clutter or a tile of the frame, of one scale: every place of a map is in one of either.
    """

    frames: float  # effective number
    log_rate: Array  # (scales,) log Lambda of white noise [1 / px^2]
    scale: Index  # (groups,) of each group
    area_px: Array  # (pools, groups) [px^2 of the frame]
    peaks: Array  # (pools, groups) how many
    excess: Array  # (pools, groups) sum of their excess over LEAST
    histogram: Array  # (pools, bins) of their excess in units of their group's


class Rarity(NamedTuple):
    """How rare each of m peaks is."""

    strength: Array  # (m,) of a peak as rare in white Gaussian noise [deviations]
    log_density: Array  # (m,) log of how many are as strong [1 / px^2], of its scale, map and polarity


def begin(log_rate: Array, scale: Index, pools: int) -> TailState:
    """Return the state before the first frame."""
    nothing = np.zeros((pools, len(scale)))
    return TailState(
        0.0, log_rate, scale, nothing, nothing, nothing, np.zeros((pools * (len(HEAVY) + 1), len(EDGES) + 1))
    )


def rate(state: TailState, area_px: Array, pool: Index, groups: Index, white: Array) -> tuple[TailState, Rarity]:
    """Count a frame's peaks, and say how rare each of them is.

    Parameters
    ----------
    area_px
        ``(pools, groups)`` area of each group in this frame [px^2].
    pool
        ``(m,)`` map and polarity of each peak.
    groups
        ``(2, m)`` its kind of clutter and its tile.
    white
        ``(m,)`` its height in deviations of the local noise, LEAST or more.
    """
    pools, n = state.peaks.shape
    keep = 1.0 - 1.0 / FRAMES
    over = white - LEAST
    middle, _ = _expected(state, pool, groups)
    counted = np.ones(len(over), dtype=bool)
    for k in range(pools):
        mine = np.flatnonzero(pool == k)
        spared = min(SPARED, len(mine) // 4)
        counted[mine[np.argsort(over[mine] / middle[mine])[len(mine) - spared :]]] = False
    clipped = counted * np.minimum(over, CLIP * middle)
    flat = (pool * n + groups).ravel()
    count, excess = (np.bincount(flat, np.tile(w, 2), pools * n).reshape(pools, n) for w in (counted, clipped))
    state = state._replace(
        frames=keep * state.frames + 1.0,
        area_px=keep * state.area_px + area_px,
        peaks=keep * state.peaks + count,
        excess=keep * state.excess + excess,
    )
    middle, log_density = _expected(state, pool, groups)
    scaled = over / middle * EXCESS
    shape = pool * (len(HEAVY) + 1) + np.searchsorted(HEAVY, middle / EXCESS)
    shapes, width = state.histogram.shape
    bins = np.bincount(shape * width + np.searchsorted(EDGES, scaled), minlength=shapes * width)
    state = state._replace(histogram=keep * state.histogram + bins.reshape(shapes, width))
    rare = np.zeros(len(white))
    for k in np.unique(shape):
        mine = shape == k
        rare[mine] = _gaussian_place(state.histogram[k], state.frames, scaled[mine])
    log_left = np.log(rare / LEAST) - 0.5 * (rare**2 - LEAST**2)
    log_dense = log_density + log_left
    return state, Rarity(invert(state.log_rate[state.scale[groups[0]]] - log_dense), log_dense)


def invert(cost: Array) -> Array:
    """Solve ``u^2 / 2 - log u = cost`` for u above 1."""
    u: Array = np.sqrt(2.0 * np.maximum(cost, 0.51) + 1.0)
    for _ in range(6):
        u = np.maximum(u - (0.5 * u * u - np.log(u) - cost) / np.maximum(u - 1.0 / u, 0.3), 1.0)
    return u


def _expected(state: TailState, pool: Index, groups: Index) -> tuple[Array, Array]:
    """Mean excess and log density of the peaks where each peak is: the geometric mean of its kind's and its tile's.

    Either is held by its whole scale's.
    """
    scales = len(state.log_rate)
    # white Gaussian noise's own, before anything is known
    nominal = np.exp(state.log_rate) * LEAST * np.exp(-0.5 * LEAST**2)
    # each peak and each pixel is in two groups
    of_scale = np.zeros((len(state.scale), scales))
    of_scale[np.arange(len(state.scale)), state.scale] = 0.5
    count, excess, area = state.peaks @ of_scale, state.excess @ of_scale, state.area_px @ of_scale
    dense = ((count + PRIOR) / (area + PRIOR / nominal))[:, state.scale]
    mean = ((excess + PRIOR * EXCESS) / (count + PRIOR))[:, state.scale]
    log_local = np.log((state.peaks + PRIOR) / (state.area_px + PRIOR / dense))
    log_middle = np.log((state.excess + PRIOR * mean) / (state.peaks + PRIOR))
    middle: Array = np.exp(BOTH @ log_middle[pool, groups])
    return middle, BOTH @ log_local[pool, groups]


def _gaussian_place(histogram: Array, frames: float, scaled: Array) -> Array:
    """Gaussian strength of an excess, from the quantile plot of a pool's own, extrapolated as a power."""
    # Gaussian noise counts for some peaks, so that a first small frame has a tail
    ideal = LEAST + EDGES
    gauss = np.exp(np.log(ideal / LEAST) - 0.5 * (ideal**2 - LEAST**2))
    left = histogram.sum() - np.cumsum(histogram[:-1])  # peaks beyond each edge
    share = (left + PRIOR * gauss) / (histogram.sum() + PRIOR)
    known = left > max(SPARED * frames, PRIOR)
    last = max(int(known.sum()) - 1, int(np.searchsorted(EDGES, EXCESS)))
    half = min(int(np.searchsorted(-share, -0.3)), last - 4)
    place = invert(0.5 * LEAST**2 - np.log(LEAST) - np.log(np.maximum(share[: last + 1], 1e-300)))
    top = LEAST + EDGES[: last + 1]
    power = float(np.clip(np.log(place[last] / place[half]) / np.log(top[last] / top[half]), 0.25, 1.0))
    height = LEAST + scaled
    within = np.interp(height, np.concatenate([[LEAST], top]), np.concatenate([[LEAST], place]))
    beyond: Array = place[last] * (height / top[last]) ** power
    return np.where(height <= top[last], within, beyond)
