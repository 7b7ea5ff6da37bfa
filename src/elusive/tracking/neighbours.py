"""Which tracks are of one target: those that go together, and one that is where another, seen no more, has turned."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elusive.contracts import Array
from elusive.tracking.accumulated import PeakTrack
from elusive.tracking.footprint import Border

UNSEEN = 3.0  # log odds against a target's being there still, from which what is found where it was is its turn


def way(path: Array, places: Array, shape: tuple[int, ...], border: Border) -> Array:
    """Return the way from a path to places ``(..., 2)``, the shorter round a ring."""
    straight: Array = places[..., :2] - path[:2]
    if border == "bounded":
        return straight
    period = np.array([*shape[::-1], 1.0][:2])
    shorter: Array = straight - period * np.rint(straight / period)
    return shorter


def together(track: PeakTrack, other: PeakTrack, cells: float, shape: tuple[int, ...], border: Border) -> bool:
    """Say whether two tracks are as near as that, now and when the evidence came that both have."""
    now = way(track.path, other.path, shape, border)
    before = min(track.age, other.age) * (other.path[2:] - track.path[2:])
    return bool(max(np.abs(now).max(), np.abs(now - before).max()) < cells)


def same(track: PeakTrack, other: PeakTrack, shape: tuple[int, ...], border: Border) -> bool:
    """Say whether two tracks that live are of one target."""
    lives = track.life.lives and other.life.lives
    return lives and together(track, other, max(track.footprint.own, other.footprint.own), shape, border)


def turned(track: PeakTrack, later: PeakTrack, time_s: float, shape: tuple[int, ...], border: Border) -> bool:
    """Say whether a later track was where an earlier one, which is seen no more, was seen last."""
    if track.fresh.against < UNSEEN or later.fresh.against > 0 or not (track.life.lives and later.life.lives):
        return False
    times = track.trail.times_s
    ago = time_s - times[-1 - min(track.fresh.pending[2], len(times) - 1)]
    then = way(track.path, later.path, shape, border) - ago * (later.path[2:] - track.path[2:])
    return bool(np.abs(then).max() < max(track.footprint.reach, later.footprint.reach))


def without_doubles(
    tracks: Sequence[PeakTrack], time_s: float, shape: tuple[int, ...], border: Border
) -> list[PeakTrack]:
    """End tracks of an earlier one's target: that have come to follow it, or that follow where it has turned."""
    kept: list[PeakTrack] = []
    for track in tracks:
        double = any(same(other, track, shape, border) for other in kept)
        before = [k for k, other in enumerate(kept) if not double and turned(other, track, time_s, shape, border)]
        if before:
            earlier = kept[before[0]]
            kept[before[0]] = track._replace(life=earlier.life, first_frame=earlier.first_frame)
        ends = double or bool(before)
        kept.append(track._replace(life=track.life._replace(status="deleted")) if ends else track)
    return kept
