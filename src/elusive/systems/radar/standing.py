"""Echoes that stand: a track whose plots lie where plots come all along may be land, a buoy or a pier as well.

A ship under way comes to places where nothing was, leaves nothing there, and goes on. Land that no chart names has
plots at the same places all along (:mod:`elusive.systems.radar.ground`), and a track wanders from one to another. Each
track is a ship under way or an echo that stands, a hidden Markov chain of two states (Rabiner, 1989, A tutorial on
hidden Markov models, Proc. IEEE 77(2), section III): how often plots come where its own are is evidence at each of
them, and how far it is from where it was of late, once in the time over which that is taken.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.ground_echoes import GroundEchoes
from elusive.systems.radar.lives import SHIPS_MPS, SURE
from elusive.tracking.detection_targets import Target
from elusive.tracking.track import Track

CHANCE, OFTEN = 0.05, 0.2  # plots a scan that come by chance where one is, and as many as speak for neither
LATELY_S, WANDERS_M = 30.0, 30.0  # over which places are averaged, and how far off these an echo is, on each axis
CHANGES_PER_S = 1 / 600  # of one to the other: land takes a ship's track over, a ship leaves its berth
AT_REST = 0.5  # probability that an echo that stands is a ship
LEAST = 1e-12


class Stand(NamedTuple):
    """What is known of a track."""

    probability: float  # that it is an echo that stands
    place: Array  # (2,) where it was of late [m]
    alone: bool = True  # whether no other echo stands near


NEVER = Stand(0.0, np.zeros(2))


def stands_after(
    before: Mapping[int, Stand],
    targets: Sequence[Target],
    scan: RadarScan,
    interval_s: float,
    echoes: GroundEchoes | None,
) -> dict[int, Stand]:
    """Return whether tracks stand after a scan, each by its number.

    Parameters
    ----------
    before
        After the scan before.
    targets
        Of the scan; those that are candidates at least count.
    scan, interval_s
        And the time since the one before.
    echoes
        Places at which plots come all along; None: there are none, and nothing stands.
    """
    if echoes is None:
        return {}
    often, change = echoes.often(scan), -0.5 * math.expm1(-2 * CHANGES_PER_S * interval_s)
    lately = -math.expm1(-interval_s / LATELY_S)
    near, far = WANDERS_M**2, WANDERS_M**2 + (SHIPS_MPS * LATELY_S) ** 2
    found = dict[int, Stand]()
    for target in targets:
        if target.life.track is None:
            continue
        now = target.mean[[X, Y]]
        stands, place, _ = before.get(target.life.track, Stand(0.5, now))
        stands += change * (1 - 2 * stands)
        place = place + lately * (now - place)
        log_ratio = math.log(far / near) - 0.5 * float(np.sum((now - place) ** 2)) * (1 / near - 1 / far)
        odds = stands / (1 - stands) * math.exp(lately * log_ratio)
        if target.detection >= 0:
            odds *= (CHANCE + float(often[target.detection])) / (CHANCE + OFTEN)
        sure = target.life.status == "confirmed"
        alone = not sure or echoes.alone(now, target.covariance[np.ix_([X, Y], [X, Y])])
        found[target.life.track] = Stand(min(max(odds / (1 + odds), LEAST), 1 - LEAST), place, alone)
    return found


def as_standing(tracks: Sequence[Track], stands: Mapping[int, Stand]) -> tuple[Track, ...]:
    """Return tracks, of which those that may be echoes that stand exist less surely.

    Those that stand beside others are candidates at most: ships at rest lie farther from each other. A ship that AIS
    names (``mmsi``) is one, whether it stands or not. How probably each stands is said in ``stands``.
    """
    found = []
    for track in tracks:
        stand, _, alone = stands.get(track.track, NEVER)
        named = not math.isnan(track.extra.get("mmsi", math.nan))
        ship = 1.0 if named else 1 - (1 - AT_REST) * stand
        status = "candidate" if track.status == "confirmed" and ship <= SURE and not alone else track.status
        extra = {**track.extra, "stands": stand}
        found.append(track._replace(status=status, existence=ship * track.existence, extra=extra))
    return tuple(found)
