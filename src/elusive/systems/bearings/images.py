"""Whether one track is the mirror image of another, as an emitter is heard a second time by way of a wall.

An emitter and its image lie on a line across the wall, as far before it as behind: what joins them keeps its direction
as they move, and its middle stays in the wall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.tracking.track import Step

TIMES = 15  # of two tracks together
FITS, MOVES = 1.5, 6.0  # deviations of place that they scatter by at most, and by which they move either way
ASIDE = 3.0  # deviations by which what joins them may lie aslant


class _Way(NamedTuple):
    times_s: Array  # (k,)
    places: Array  # (k, 2) [m]
    spread_m: float


def images_finding(steps: Sequence[Step]) -> Finding:
    """Look for two confirmed tracks that mirror each other."""
    rows = dict[int, list[tuple[float, Array, float]]]()
    for step in steps:
        for track in step.tracks:
            if track.status == "confirmed":
                spread = math.sqrt(track.covariance[X, X] + track.covariance[Y, Y])
                rows.setdefault(track.track, []).append((step.time_s, track.mean[[X, Y]], spread))
    ways = {
        number: _Way(np.array([row[0] for row in its]), np.array([row[1] for row in its]), _median(its))
        for number, its in rows.items()
    }
    said = [
        f"{one} and {other} (in a line {wall} degrees from north)"
        for one, other in combinations(sorted(ways), 2)
        if (wall := _wall(ways[one], ways[other])) is not None
    ]
    return Finding(
        "bearings.images", not said, 0.0, float(len(said)),
        f"Tracks {', '.join(said)} are mirror images of each other: one emitter is heard a second time by way of a "
        "wall or a shore, and one of the two is nobody.",
        "Keep the one that is on the sensors' side of what reflects.",
    )  # fmt: skip


def _median(rows: Sequence[tuple[float, Array, float]]) -> float:
    return float(np.median([row[2] for row in rows]))


def _wall(one: _Way, other: _Way) -> int | None:
    """Direction of the line in which two ways mirror each other [deg]; None: in none."""
    _, mine, its = np.intersect1d(one.times_s, other.times_s, return_indices=True)
    if len(mine) < TIMES:
        return None
    first, second = one.places[mine], other.places[its]
    across, middle = second - first, (first + second) / 2
    away = np.median(across, axis=0)
    unit = away / max(float(np.hypot(*away)), 1e-9)
    along = np.array([-unit[1], unit[0]])
    spread = math.hypot(one.spread_m, other.spread_m)

    def scatter(values: Array) -> float:
        return float(np.std(values)) / spread

    # they part and meet across the wall, and go the same way along it
    moves = min(np.ptp(across @ unit), np.ptp(middle @ along)) > MOVES * spread
    straight = abs(float(np.mean(across @ along))) < ASIDE * spread and scatter(across @ along) < FITS
    if not (moves and straight and scatter(middle @ unit) < FITS):
        return None
    return round(math.degrees(math.atan2(*along))) % 180
