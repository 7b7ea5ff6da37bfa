"""Whether plots follow each other faster than ships do: straight on, and not as often round a corner.

Of two plots in scans after each other the third of a fast target lies straight ahead. By chance as many lie as far to
the side, so that the difference of the two counts is the targets', whatever the clutter: a paired sign test (Conover,
1999, Practical nonparametric statistics, section 3.4).
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.radar_view import RadarView
from elusive.systems.radar.turned import without_spoke

SLOW_MPS, SLOWEST_MPS, FASTEST_MPS = 25.0, 45.0, 400.0
ROOM_M, ROOM_RAD = 60.0, 0.02  # beside where a plot would be straight ahead
MOST, SCANS = 60, 1000  # plots of a scan, and scans, that are looked at
TOLD = 3.0  # deviations of a new target's velocity, from which it is not found
FEW, CLEAR = 20, 4.0  # more ahead than to the side, also in deviations of what chance makes


class Counted(NamedTuple):
    """Plots ahead of two before, to the side, and how fast those ahead would be in the median [m/s]."""

    ahead: int = 0
    aside: int = 0
    speed_mps: float = math.nan


class Fast:
    """Counts plots that lie ahead of two before, and that lie to the side."""

    def __init__(self) -> None:
        self._before = deque[tuple[float, Array]](maxlen=2)
        self._ahead = self._aside = self._scans = 0
        self._speeds: list[float] = []

    def add(self, scan: RadarScan) -> None:
        """Take a scan in, of the order of time."""
        places = RadarView().places(without_spoke(scan))[0]
        if len(self._before) == 2 and self._scans < SCANS and len(places) and len(places) <= MOST:
            self._scans += 1
            (first_s, first), (middle_s, middle) = self._before
            if first_s < middle_s < scan.time_s and 0 < len(first) <= MOST and 0 < len(middle) <= MOST:
                self._count(first, middle, places, middle_s - first_s, scan.time_s - middle_s)
        self._before.append((scan.time_s, places))

    def _count(self, first: Array, middle: Array, last: Array, before_s: float, after_s: float) -> None:
        # ships in a lane come to where another was
        alone = _unlike(_unlike(middle, first, before_s), last, after_s)
        first, middle, last = _unlike(first, middle, before_s), alone, _unlike(last, middle, after_s)
        if not (len(first) and len(middle) and len(last)):
            return
        way = (middle[:, None] - first) / before_s
        speed = np.hypot(*way.transpose(2, 0, 1))
        row, column = np.nonzero((speed > SLOWEST_MPS) & (speed < FASTEST_MPS))
        along, tree = after_s * way[row, column], cKDTree(last)
        room = ROOM_M + ROOM_RAD * np.hypot(*middle[row].T)

        def near(aim: Array) -> NDArray[np.bool_]:
            return np.asarray(tree.query(middle[row] + aim)[0] < room)

        ahead = near(along)
        self._ahead += int(ahead.sum())
        self._aside += int(near(along[:, ::-1] * [1, -1]).sum())
        self._speeds += speed[row, column][ahead].tolist()

    @property
    def counted(self) -> Counted:
        """What was counted."""
        return Counted(self._ahead, self._aside, float(np.median(self._speeds or [math.nan])))


def _unlike(places: Array, others: Array, apart_s: float) -> Array:
    """Return the places where no slow target of others can be."""
    if not (len(places) and len(others)):
        return places
    found: Array = places[cKDTree(others).query(places)[0] > ROOM_M + SLOW_MPS * apart_s]
    return found


def fast_finding(counted: Counted, speed_sd_mps: float) -> Finding:
    """Say that there are targets faster than new ones are taken to be."""
    ahead, aside, speed = counted
    clear = ahead - aside > max(FEW, CLEAR * math.sqrt(ahead + aside))
    fast = clear and speed > TOLD * speed_sd_mps
    return Finding(
        "radar.fast", not fast, 0.0, float(ahead - aside),
        f"{ahead - aside} plots more lie straight ahead of two before than to the side, at some {speed:.0f} m/s, as "
        "those of aircraft: ships are looked for, and what is so fast is not found.",
        f"Give --speed-sd-mps {speed:.0f}, and --q for how hard it turns.", grave=False,
    )  # fmt: skip
