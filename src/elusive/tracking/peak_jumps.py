"""Targets that are found again elsewhere: where frames were dropped, or a target was hidden for long.

What was shown and is no longer seen goes on as what has just begun beside it, if that alone is like it, and has gone
since as it went, rather than rested: a part of the scene that looks like it rests.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from elusive.tracking.peak_targets import PeakTargets

FRESH = 10  # frames up to which a target has just begun
SURE = 0.9  # existence from which it counts
REACH_PX = 16.0  # how far a target may have jumped, and a third as far again for each frame's way it has
ON_SENSOR = ("usual", "strayed", "swept", "mark")
TOLD_PX = 1.0  # way since it began, from which going on is told from resting
ALIKE = 0.6  # share of a strength that another has at least; more it may have, where little is known of a place


def rejoined(targets: PeakTargets, level_spread: float) -> PeakTargets:
    """Return the targets, those that had been shown and were lost joined to what began where they went."""
    lost = np.flatnonzero(targets.shown & (targets.visible < 0.5 * targets.existence))
    fresh = np.flatnonzero((targets.age <= FRESH) & (targets.existence > SURE) & ~targets.shown)
    if not len(lost) or not len(fresh):
        return targets
    place, velocity = targets.mean_place, targets.mean_velocity
    speed, gone = np.hypot(*velocity.T), place - targets.origin
    kept = np.ones(len(targets.number), np.bool_)
    values: dict[str, Any] = {
        name: getattr(targets, name).copy()
        for name in ("number", "age", "evidence", "resting", "shown", "origin", "farthest", "hop", *ON_SENSOR)
    }
    for old in lost[np.argsort(-targets.evidence[lost], kind="stable")]:
        near = np.hypot(*(place[fresh] - place[old]).T) < REACH_PX + 3 * speed[old]
        ratio = targets.strength[fresh] / targets.strength[old]
        like = near & (targets.bright[fresh] == targets.bright[old]) & (ratio > ALIKE)
        like &= np.abs(targets.level[fresh] - targets.level[old]) < 3 * level_spread
        way = targets.age[fresh, None] * velocity[old]
        rests = np.hypot(*(gone[fresh] - way).T) > np.hypot(*gone[fresh].T)
        like &= ~(rests & (np.hypot(*way.T) > TOLD_PX))
        if like.sum() != 1:
            continue
        new = int(fresh[like][0])
        kept[old] = False
        fresh = fresh[fresh != new]
        for name in ("number", "shown", "origin", *ON_SENSOR):
            values[name][new] = values[name][old]
        for name in ("age", "evidence", "resting"):
            values[name][new] += values[name][old]
        away, jump = (float(np.hypot(*(place[new] - before[old]))) for before in (targets.origin, place))
        values["farthest"][new] = max(float(targets.farthest[old]), away)
        values["hop"][new] = max(float(targets.hop[old]), jump)
    return targets._replace(**values).kept(kept)
