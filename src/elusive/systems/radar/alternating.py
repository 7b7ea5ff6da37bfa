"""Whether scans come of one radar: what a scan shows lies where the last showed it, not where the last but one did."""

from __future__ import annotations

from collections import deque

import numpy as np
from scipy.spatial import cKDTree

from elusive.checks import Finding
from elusive.sensors.own_track import FASTEST_MPS
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.radar_view import RadarView
from elusive.systems.radar.triples import ROOM_M

FEW, SCANS = 3, 20  # plots of a scan, and scans, from which something is said
SHOWN, NOT_SHOWN = 0.5, 0.3  # of the plots in the scan before the last; of these in the last


class Alternating:
    """Counts the plots of each scan that lie near one of the scan before, and near one of the scan before that."""

    def __init__(self) -> None:
        self._before = deque[RadarScan](maxlen=2)
        self._scans = self._plots = self._last = self._last_but_one = 0

    def add(self, scan: RadarScan) -> None:
        """Take a scan in, of the order of time."""
        if len(self._before) == 2 and min(scan.detections, *(one.detections for one in self._before)) >= FEW:
            places, room = RadarView().places(scan)[0], ROOM_M + FASTEST_MPS * (scan.time_s - self._before[0].time_s)
            trees = (cKDTree(RadarView().places(one)[0]) for one in self._before)
            earlier, last = (int(np.isfinite(tree.query(places, distance_upper_bound=room)[0]).sum()) for tree in trees)
            self._scans, self._plots = self._scans + 1, self._plots + len(places)
            self._last, self._last_but_one = self._last + last, self._last_but_one + earlier
        self._before.append(scan)

    @property
    def finding(self) -> Finding:
        """Whether every second scan is another radar's."""
        shown, share = self._last_but_one / max(self._plots, 1), self._last / max(self._last_but_one, 1)
        two = self._scans >= SCANS and shown > SHOWN and share < NOT_SHOWN
        return Finding(
            "radar.alternate", not two, 1.0, share,
            f"{100 * shown:.0f} % of the plots lie where the scan before the last has some, and "
            f"{100 * shown * share:.0f} % where the last has: scans of two radars stand in turn in one file, and "
            "places of one of them are taken from the other.",
            "Track each radar's plots by themselves, or give places (x_m, y_m or lon_deg, lat_deg) instead of ranges.",
        )  # fmt: skip
