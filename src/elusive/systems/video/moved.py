"""Whether a track has gone anywhere: what flickers in its place, as a coast does, is told with a velocity, and stays.

A ship under way leaves the place where it was first told by more than it errs. Until then it is a candidate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.systems.video.peaks import MIDDLE, PeaksOf, cell_covariance
from elusive.tracking.track import Track

PLACE = [X, Y]
LEFT = 3.0  # deviations of its place and of a quarter of a cell, by which a track has left where it was
PART = 0.25


class Moved(NamedTuple):
    """What is known of where tracks have been."""

    first: dict[int, Array]  # (2,) where each was told first [m]
    left: frozenset[int]  # those that have left that


def moved_after(
    before: Moved | None, tracks: Sequence[Track], peaks: PeaksOf, turn: EvidenceTurn, sensor: RadarVideo
) -> Moved:  # fmt: skip
    """Return what is known after a turn.

    By how much the middle of an echo, as ``peaks`` tell it, is off its ship's for good, it is off at both places.
    """
    old = before or Moved({}, frozenset())
    alive = [track for track in tracks if track.status != "deleted"]
    first = {track.track: old.first.get(track.track, track.mean[PLACE]) for track in alive}
    left = {track.track for track in alive if track.track in old.left}
    for track in alive:
        off = track.mean[PLACE] - first[track.track]
        cell = cell_covariance(track.mean[PLACE] - np.asarray(turn.place), sensor)
        spread = track.covariance[np.ix_(PLACE, PLACE)] + PART**2 * cell
        if track.track in peaks:
            spread -= MIDDLE**2 * peaks[track.track].reach
        if off @ np.linalg.solve(spread, off) > LEFT**2:
            left.add(track.track)
    return Moved(first, frozenset(left))


def without_still(tracks: Sequence[Track], moved: Moved) -> tuple[Track, ...]:
    """Return tracks, of which those that have left no place are candidates at most."""
    return tuple(
        track._replace(status="candidate") if track.status == "confirmed" and track.track not in moved.left else track
        for track in tracks
    )
