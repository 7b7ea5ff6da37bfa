"""Whether a track has gone anywhere: what flickers in its place, as a coast does, is told with a velocity, and stays.

A ship under way leaves a place where it was told by more than it errs there and then. Until then it is a candidate.
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
LEFT = 3.0  # deviations of both places and of a quarter of a cell, by which a track has left where it was
PART = 0.25
KEPT = 60  # places that are held against the latest, at most


class Moved(NamedTuple):
    """What is known of where tracks have been."""

    told: dict[int, tuple[Array, Array]]  # (n, 2) where each was told, and (n, 2, 2) covariance [m, m^2]
    left: frozenset[int]  # those that have left such a place


def moved_after(
    before: Moved | None, tracks: Sequence[Track], peaks: PeaksOf, turn: EvidenceTurn, sensor: RadarVideo
) -> Moved:  # fmt: skip
    """Return what is known after a turn.

    By how much the middle of an echo, as ``peaks`` tell it, is off its ship's for good, it is off at both places.
    """
    old, told, left = before or Moved({}, frozenset()), dict[int, tuple[Array, Array]](), set[int]()
    for track in tracks:
        if track.status == "deleted":
            continue
        if track.track in old.left:
            left.add(track.track)
            continue
        place, spread = track.mean[PLACE], track.covariance[np.ix_(PLACE, PLACE)]
        if track.track in peaks:
            spread = spread - MIDDLE**2 * peaks[track.track].reach
        places, spreads = old.told.get(track.track, (np.zeros((0, 2)), np.zeros((0, 2, 2))))
        both = spreads + spread + PART**2 * cell_covariance(place - np.asarray(turn.place), sensor)
        off = place - places
        if (np.einsum("ni,nij,nj->n", off, np.linalg.inv(both), off) > LEFT**2).any():
            left.add(track.track)
        else:
            told[track.track] = np.vstack([places, place])[-KEPT:], np.concatenate([spreads, spread[None]])[-KEPT:]
    return Moved(told, frozenset(left))


def without_still(tracks: Sequence[Track], moved: Moved) -> tuple[Track, ...]:
    """Return tracks, of which those that have left no place are candidates at most."""
    return tuple(
        track._replace(status="candidate") if track.status == "confirmed" and track.track not in moved.left else track
        for track in tracks
    )
