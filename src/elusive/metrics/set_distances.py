"""OSPA and GOSPA: one distance between the set of true places and the set of estimated ones, frame by frame.

Schuhmacher, Vo and Vo (2008), IEEE Trans. Signal Process. 56(8), eq. 3; Rahmathullah, Garcia-Fernandez and Svensson
(2017), Generalized optimal sub-pattern assignment metric, eq. 1 with alpha = 2, proposition 1 for its parts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.metrics._assignment import linear_sum_assignment
from elusive.metrics.target_table import Sightings, frames_of


class Gospa(NamedTuple):
    """GOSPA of each frame and its parts, which add up to the distance to the power p."""

    distance: Array  # (T,) in the places' unit
    localisation: Array  # (T,) sum of the pairs' distances to the power p
    missed: Array  # (T,) c^p / 2 for each missed target
    false: Array  # (T,) c^p / 2 for each false one


def ospa(
    truth: Sightings, tracks: Sightings, cutoff: float = 2.0, order: float = 2.0, frames: int | None = None
) -> Array:
    """OSPA of each frame, ``(T,)`` in the places' unit: 0 where both are empty, the cutoff where one is.

    Parameters
    ----------
    truth, tracks
        From :func:`~elusive.metrics.target_table.sightings`; their identities are not looked at.
    cutoff
        c: distance that counts as much as a target too few or too many.
    order
        p, from 1.
    frames
        Frames to score; all up to the last in which there is something, by default.

    Raises
    ------
    ParameterError
        If the cutoff is not positive or the order below 1.
    DataError
        If truth and tracks have places of different dimension, or a row lies beyond the frames given.
    """
    _check(cutoff, order)
    count = frames_of(truth, tracks, frames)
    found = np.zeros(count)
    for frame, (_, _, apart) in enumerate(truth.apart(tracks, count)):
        most = max(apart.shape)
        if most:
            paired = np.minimum(_best(apart, cutoff, order), cutoff) ** order
            total = paired.sum() + cutoff**order * (most - len(paired))
            found[frame] = (total / most) ** (1 / order)
    return found


def gospa(
    truth: Sightings, tracks: Sightings, cutoff: float = 2.0, order: float = 2.0, frames: int | None = None
) -> Gospa:
    """GOSPA of each frame with alpha = 2, and what it is made of; arguments and errors as of :func:`ospa`."""
    _check(cutoff, order)
    count = frames_of(truth, tracks, frames)
    parts = np.zeros((3, count))
    half = cutoff**order / 2
    for frame, (targets, names, apart) in enumerate(truth.apart(tracks, count)):
        pairs = _best(apart, cutoff, order)
        pairs = pairs[pairs < cutoff]
        parts[:, frame] = (pairs**order).sum(), half * (len(targets) - len(pairs)), half * (len(names) - len(pairs))
    return Gospa(parts.sum(axis=0) ** (1 / order), *parts)


def _check(cutoff: float, order: float) -> None:
    if not cutoff > 0:
        raise ParameterError(f"cutoff: must be above zero (got {cutoff}).")
    if not order >= 1:
        raise ParameterError(f"order: must be 1 or more (got {order}).")


def _best(apart: Array, cutoff: float, order: float) -> Array:
    """Return the distances of the best pairs, as many as there can be."""
    return np.asarray(apart[linear_sum_assignment(np.minimum(apart, cutoff) ** order)])
