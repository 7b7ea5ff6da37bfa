"""Tracks that may be echoes that stand are no sure ships: land that no chart names, a buoy, a pier.

How probably a track is one is a posterior over the ways in which it may move (:mod:`elusive.systems.radar.moving`). A
ship at rest from the beginning looks the same, so that what stands exists as a ship with a half.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from elusive.contracts import X, Y
from elusive.systems.radar.ground_echoes import GroundEchoes
from elusive.systems.radar.lives import SURE
from elusive.systems.radar.moving import Ways
from elusive.tracking.track import Track

AT_REST = 0.5  # probability that an echo that stands is a ship


def as_standing(tracks: Sequence[Track], ways: Mapping[int, Ways], echoes: GroundEchoes | None) -> tuple[Track, ...]:
    """Return tracks, of which those that may be echoes that stand exist less surely.

    Those that stand beside others are candidates at most: ships at rest lie farther from each other. A ship that AIS
    names (``mmsi``) is one, whether it stands or not. How probably each stands is said in ``stands``.

    Parameters
    ----------
    tracks
        After a scan.
    ways
        In which they may move, each by its number.
    echoes
        Places at which plots come all along; None: there are none, and nothing stands.
    """
    found = []
    for track in tracks:
        stand = 0.0 if echoes is None or track.track not in ways else float(ways[track.track].stands[0])
        named = not math.isnan(track.extra.get("mmsi", math.nan))
        ship = 1.0 if named else 1 - (1 - AT_REST) * stand
        status = track.status
        if echoes is not None and status == "confirmed" and ship <= SURE:
            alone = echoes.alone(track.mean[[X, Y]], track.covariance[np.ix_([X, Y], [X, Y])])
            status = "confirmed" if alone else "candidate"
        extra = {**track.extra, "stands": stand}
        found.append(track._replace(status=status, existence=ship * track.existence, extra=extra))
    return tuple(found)
