"""What four corners make up is one thing, shown at its middle: a box that is drawn about a target and follows it.

No source; an own test. Nothing else keeps four things that move at the corners of an upright box, but a machine of four
parts, which is one thing, too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.tracking.peak_companions import ALIKE
from elusive.tracking.peak_targets import PeakTargets

OFF_PX, LEAST_PX, MOST_PX = 2.0, 6.0, 60.0  # of a corner from where it should be; sides of a box
LIKE = 0.7  # of the logarithms of contrasts of corners
CORNERS = 4
MANY = 40  # strongest, among which corners are sought
BESIDE_PX, MIDDLE = 4.0, 0.3  # about a box, and share of its sides from its middle, within which something is its


class Boxed(NamedTuple):
    """What is shown of boxes."""

    shows: NDArray[np.bool_]  # (n,) which tracks show one
    way: Array  # (n, 2) from these to its middle, 0 of all others


def leave_boxes(targets: PeakTargets, shown: NDArray[np.bool_], moving: NDArray[np.bool_]) -> Boxed:
    """Show what makes up a box once: what is in its middle, else what was shown before."""
    count = len(shown)
    found, known = Boxed(np.zeros(count, np.bool_), np.zeros((count, 2))), np.zeros(count, np.bool_)
    place, velocity = targets.mean_place, targets.mean_velocity
    for corners in boxes(targets, moving) if shown.any() else ():
        at, goes = place[corners], velocity[corners].mean(axis=0)
        middle, half = at.mean(axis=0), np.ptp(at, axis=0) / 2
        inside = (np.abs(place - middle) < half + BESIDE_PX).all(axis=1)
        inside &= np.hypot(*(velocity - goes).T) < ALIKE[0] + ALIKE[1] * float(np.hypot(*goes))
        inside[corners] = True
        parts = np.flatnonzero(shown & inside)
        if not len(parts) or known[corners].any():
            continue
        off = np.abs(place[parts] - middle).max(axis=1)
        central = off < np.maximum(OFF_PX, MIDDLE * half.min())
        first = np.lexsort((off, ~targets.shown[parts], ~central))[0]
        shown[parts] = False
        shown[parts[first]] = found.shows[parts[first]] = True
        known[inside] = True
        if not central[first]:
            found.way[parts[first]] = middle - place[parts[first]]
    return found


def boxes(targets: PeakTargets, moving: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Return the corners of upright boxes among what moves, four each, each in one box, the strongest first."""
    some = np.flatnonzero(moving)
    some = some[np.argsort(-targets.strength[some], kind="stable")][:MANY]
    if len(some) < CORNERS:
        return []
    place, velocity, level = targets.mean_place[some], targets.mean_velocity[some], targets.level[some]
    bright = targets.bright[some]
    found, taken = list[NDArray[np.int64]](), set[int]()
    across = place[None] - place[:, None]
    opposite = ((across > LEAST_PX) & (across < MOST_PX)).all(axis=2)
    for a, b in np.argwhere(opposite).tolist():
        corners = [a, b]
        for x, y in ((b, a), (a, b)):
            off = np.abs(place - (place[x, 0], place[y, 1])).max(axis=1)
            corners.append(int(off.argmin()) if off.min() < OFF_PX else -1)
        if min(corners) < 0 or taken & set(corners):
            continue
        four = np.array(corners)
        goes = velocity[four].mean(axis=0)
        even = np.hypot(*(velocity[four] - goes).T).max() < ALIKE[0] + ALIKE[1] * float(np.hypot(*goes))
        if even and np.ptp(level[four]) < LIKE and np.ptp(bright[four].astype(int)) == 0:
            taken |= set(corners)
            found.append(some[four])
    return found
