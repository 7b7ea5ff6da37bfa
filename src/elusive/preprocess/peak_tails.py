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
from elusive.preprocess import _tail_kernels

LEAST = 2.5  # deviations from which a local maximum is a peak
EXCESS = 0.35  # mean excess of maxima of Gaussian noise over it
PRIOR = 20.0  # peaks that a whole scale counts for beside a group's own
FRAMES = 40.0  # over which counts are averaged
SPARED = 3  # strongest peaks a frame that do not tell the tail: they may be targets
CLIP = 4.0  # excess, in mean ones, that one peak counts for at most
HEAVY = np.array([1.3, 2.5])  # mean excess, in a Gaussian's, that parts light tails from heavier ones
POWER = (0.25, 1.0)  # of the quantile plot beyond what was seen; a Gaussian's is one
EDGES = np.geomspace(0.02, 400.0, 80)  # of the histogram of excess

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


def begin(log_rate: Array, scale: Index, pools: int) -> TailState:
    """Return the state before the first frame."""
    nothing = np.zeros((pools, len(scale)))
    return TailState(
        0.0, log_rate, scale, nothing, nothing, nothing, np.zeros((pools * (len(HEAVY) + 1), len(EDGES) + 1))
    )


def rate(state: TailState, area_px: Array, pool: Index, groups: Index, white: Array) -> tuple[TailState, Array]:
    """Count a frame's peaks, and say how rare each is: the strength of one as rare in white Gaussian noise, ``(m,)``.

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
    keep = 1.0 - 1.0 / FRAMES if state.frames else 0.0
    counted = TailState(
        keep * state.frames + 1.0,
        state.log_rate,
        state.scale,
        keep * state.area_px + area_px,
        *(keep * values for values in (state.peaks, state.excess, state.histogram)),
    )
    # where nothing was seen before, the frame's own peaks tell the tail
    fresh = not state.peaks[np.bincount(pool, minlength=len(area_px)) > 0].any(axis=1).all()
    rated = _rated(state, pool, groups, white)
    _tail_kernels.count(
        white,
        pool,
        groups[0],
        groups[1],
        *rated[1:],
        LEAST,
        CLIP,
        SPARED,
        counted.peaks,
        counted.excess,
        counted.histogram,
    )
    if fresh:
        rated = _rated(counted, pool, groups, white)
    return counted, rated[0]


def _rated(state: TailState, pool: Index, groups: Index, white: Array) -> tuple[Array, Array, Index, Index]:
    """Rate peaks by what is known: strength, mean excess, and row and bin of the histogram."""
    log_middle, log_local = _expected(state)
    spared = max(SPARED * state.frames, PRIOR)
    places = _tail_kernels.quantile_plots(state.histogram, EDGES, LEAST, spared, PRIOR, POWER)
    rated: tuple[Array, Array, Index, Index] = _tail_kernels.rate(
        white,
        pool,
        groups[0],
        groups[1],
        state.scale[groups[0]],
        log_middle,
        log_local,
        places,
        EDGES,
        HEAVY,
        LEAST,
        EXCESS,
        state.log_rate,
    )
    return rated


def _expected(state: TailState) -> tuple[Array, Array]:
    """Return logs of mean excess and of density of each group's peaks, ``(pools, groups)``, held by its scale's."""
    scales = len(state.log_rate)
    # white Gaussian noise's own, before anything is known
    nominal = np.exp(state.log_rate) * LEAST * np.exp(-0.5 * LEAST**2)
    # each peak and each pixel is in two groups
    of_scale = 0.5 * (state.scale[:, None] == np.arange(scales))
    peaks, excess, area = (values @ of_scale for values in (state.peaks, state.excess, state.area_px))
    dense = ((peaks + PRIOR) / (area + PRIOR / nominal))[:, state.scale]
    mean = ((excess + PRIOR * EXCESS) / (peaks + PRIOR))[:, state.scale]
    log_local = np.log((state.peaks + PRIOR) / (state.area_px + PRIOR / dense))
    log_middle = np.log((state.excess + PRIOR * mean) / (state.peaks + PRIOR))
    return log_middle, log_local
