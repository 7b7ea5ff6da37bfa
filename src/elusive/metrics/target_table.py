"""Who is where in which frame: truth and tracks as one kind of table, for every score of several targets."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elusive.contracts import Array
from elusive.errors import DataError


class Sightings(NamedTuple):
    """One row for each target in each frame, in the order of frames."""

    frame: NDArray[np.int64]  # (R,) from 0
    identity: NDArray[np.int64]  # (R,) number of the target or track
    place: Array  # (R, k) of one unit, metres or pixels

    def in_frames(self, frames: int) -> Iterator[tuple[NDArray[np.int64], Array]]:
        """Yield identities ``(n,)`` and places ``(n, k)`` of each frame."""
        edges = np.searchsorted(self.frame, np.arange(frames + 1))
        for start, stop in pairwise(edges):
            yield self.identity[start:stop], self.place[start:stop]

    def apart(self, other: Sightings, frames: int) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], Array]]:
        """Yield the identities of each frame here ``(n,)`` and there ``(m,)``, and the distances between ``(n, m)``."""
        for (own, at), (others, to) in zip(self.in_frames(frames), other.in_frames(frames), strict=True):
            both = len(own) and len(others)  # else they may be of different dimension
            yield own, others, np.linalg.norm(at[:, None] - to, axis=2) if both else np.empty((len(own), len(others)))


def sightings(frame: ArrayLike, identity: ArrayLike, place: ArrayLike, name: str = "tracks") -> Sightings:
    """Make a table of rows in any order.

    Parameters
    ----------
    frame
        ``(R,)`` frame of each row, from 0.
    identity
        ``(R,)`` number of each row's target.
    place
        ``(R, k)``.
    name
        For the sentences of failures.

    Raises
    ------
    DataError
        If lengths differ, a number is not finite, a frame is below zero, or a target is twice in a frame.
    """
    frames, identities = np.asarray(frame), np.asarray(identity)
    places = np.asarray(place, dtype=np.float64)
    if places.ndim != 2 and frames.size in (0, len(places)):
        places = places.reshape(frames.size, -1 if places.size else 2)
    if not frames.ndim == identities.ndim == places.ndim - 1 == 1 or not frames.size == identities.size == len(places):
        raise DataError(
            f"{name}: {frames.size} frames, {identities.size} identities, {len(places)} places; give as many."
        )
    for what, values in (("frame", frames), ("identity", identities)):
        if values.size and not (np.isfinite(values).all() and (values == np.floor(values)).all()):
            raise DataError(f"{name}: {what} holds what is no whole number; give whole numbers.")
    frames, identities = frames.astype(np.int64), identities.astype(np.int64)
    if (frames < 0).any():
        raise DataError(f"{name}: frame {frames.min()} is below zero; count from 0.")
    if not np.isfinite(places).all():
        row = int(np.argmin(np.isfinite(places).all(axis=1)))
        raise DataError(f"{name}, row {row}: the place is not finite; leave out the rows of targets that are absent.")
    order = np.lexsort((identities, frames))
    frames, identities, places = frames[order], identities[order], places[order]
    twice = (np.diff(frames) == 0) & (np.diff(identities) == 0)
    if twice.any():
        at = int(np.argmax(twice))
        raise DataError(f"{name}: {identities[at]} is twice in frame {frames[at]}; give each target one place a frame.")
    return Sightings(frames, identities, places)


def sightings_of(places: ArrayLike) -> Sightings:
    """Make a table of a dense array ``(frames, targets, k)``, NaN where a target is absent; targets count from 0.

    Raises
    ------
    DataError
        If the array has another shape.
    """
    dense = np.asarray(places, dtype=np.float64)
    if dense.ndim != 3:
        raise DataError(f"truth: has shape {dense.shape}; give (frames, targets, axes), NaN where a target is absent.")
    frame, identity = np.nonzero(~np.isnan(dense).any(axis=2))
    return sightings(frame, identity, dense[frame, identity], "truth")


def frames_of(truth: Sightings, tracks: Sightings, frames: int | None) -> int:
    """Return how many frames are scored: as many as given, else up to the last in which something is.

    Raises
    ------
    DataError
        If truth and tracks have places of different dimension, or a row lies beyond the frames given.
    """
    if truth.place.shape[1] != tracks.place.shape[1] and len(truth.frame) and len(tracks.frame):
        raise DataError(
            f"tracks: places have {tracks.place.shape[1]} components, those of the truth {truth.place.shape[1]}."
        )
    last = max((int(table.frame[-1]) for table in (truth, tracks) if len(table.frame)), default=-1)
    if frames is not None and last >= frames:
        raise DataError(
            f"frames: {frames} are to be scored, but a row is in frame {last}; cut the tables or give more."
        )
    return last + 1 if frames is None else frames
