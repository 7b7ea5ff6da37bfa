"""Where a track was before it was detected: straight back, to where the evidence along it begins.

The most likely change point of the mean along a path (Hinkley, 1970), which is a cumulative sum run backwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.tracking.fresh import ring, sample
from elusive.tracking.peaks import Border


class ReadBack(NamedTuple):
    """The part of a track that lies before its detection."""

    first: int  # index of the frame in which the target appeared
    positions: Array  # (n, ndim) x[, y], of the frames from there to the last one given
    level: float  # mean evidence along them, in deviations of the frames' evidence


def read_back(
    evidence: Sequence[ArrayLike | None],
    position: tuple[float, ...],
    velocity: tuple[float, ...],
    border: Border = "circular",
) -> ReadBack:
    """Follow a track straight back and find the frame in which its target appeared.

    Parameters
    ----------
    evidence
        Maps of the frames up to the track's detection, the oldest first; None where a frame is missing.
    position
        Place in the last of these frames, x[, y] [samples].
    velocity
        vx[, vy] [samples a frame].
    border
        ``circular``: the map's ends meet; ``bounded``: the track begins no earlier than it came in.

    Raises
    ------
    DataError
        If there is no evidence, it is not finite, not of one shape, or has another number of axes than the position,
        or the position lies outside a bounded map.
    ParameterError
        If position and velocity differ in length or are not finite.
    """
    place, step = np.asarray(position, dtype=float), np.asarray(velocity, dtype=float)
    if place.shape != step.shape or not (np.isfinite(place).all() and np.isfinite(step).all()):
        raise ParameterError(f"position, velocity: must be finite and of one length (got {position}, {velocity}).")
    maps = [None if given is None else np.asarray(given, dtype=float) for given in evidence]
    known = [given for given in maps if given is not None]
    if not known:
        raise DataError("evidence: there is none; give the maps of the frames up to the track's detection.")
    if any(given.ndim != len(place) for given in known):
        raise DataError(f"evidence: maps must have {len(place)} axes, as the position has coordinates.")
    if any(given.shape != known[0].shape for given in known):
        raise DataError("evidence: maps are not all of one shape; give those of one recording.")
    if not all(np.isfinite(given).all() and given.any() for given in known):
        raise DataError("evidence: maps must be finite and not all zero; give None for a frame that is missing.")
    lengths = ring(known[0].shape)
    back = place - np.arange(len(maps))[:, None] * step
    if border == "circular":
        back %= lengths
    else:
        inside = ((back >= -0.5) & (back <= lengths - 0.5)).all(axis=1)
        if not inside[0]:
            raise DataError(f"position: {position} lies outside the map of {known[0].shape}.")
        back = back[: len(back) if inside.all() else int(np.argmin(inside))]
    best, first, level = -math.inf, 0, 0.0
    total, count = 0.0, 0
    for ago in range(len(back)):
        given = maps[-1 - ago]
        if given is None:
            continue
        total, count = total + sample(given, back[ago]), count + 1
        gain = math.copysign(total**2, total) / count
        if gain > best:
            best, first, level = gain, ago, total / count
    return ReadBack(len(maps) - 1 - first, back[first::-1].copy(), level)
