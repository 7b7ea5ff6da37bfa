"""Whether a radar's whole picture turns, as bearings do that are from a bow that swings, or whose north is set anew.

Of three plots of a target the last lies ahead of the others, but for errors. Of a scan whose picture has turned against
an earlier one the last plots of several targets lie ahead of them at their ranges, all turned by one angle, and none as
they are. Rows of such plots are a mixture of a Gaussian about that angle and a uniform density; a turn by any angle and
none are compared by evidence (Kass and Raftery, 1995, Bayes factors), which is summed up since the scan that makes it
greatest (Page, 1954, Continuous inspection schemes).
"""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.report.clock import moment
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import HullRadar
from elusive.sensors.radar_scans import TURN_RAD, RadarScan
from elusive.sensors.radar_view import wrapped
from elusive.systems.radar.straight import OVERLAP
from elusive.systems.radar.triples import FASTEST_MPS, ROOM_M

APART = 5  # scans, from each plot of a target to the next
BESIDE_RAD = 0.16  # of a plot from the one before, beside what a target sails, so that a turn may lie between the two
PLOTS, ROWS = 60, 400  # of a scan, and threes of plots, that are looked at
WINDOW, SCALE = 6.0, math.sqrt(6.0)  # deviations of a range ahead, which errs so many times as much as a plot
UNEVEN = 2.0  # ratio of the times between scans that are compared
OF_TARGETS, SELDOM = 0.3, 0.05  # share of threes, and of scans that have turned
NONE = np.array([-1.0, 0.0, 1.0])  # deviations of no turn
SPOKE, NEAR_DEG, ACROSS = 8, 2, 0.5  # plots of one bearing, how near, and the share of the farthest range they cross
CLEAR, TURNED = 3.0, 3.0  # logarithms of Bayes factors, of scans together and of one


class Turns:
    """Compares scans with earlier ones, as they come.

    Parameters
    ----------
    sensor
        That made them.
    """

    def __init__(self, sensor: RadarSensor) -> None:
        self._sensor = sensor
        self._latest = deque[RadarScan](maxlen=2 * APART + 1)
        self._evidence = self._most = 0.0
        self._scans = 0
        self._turns: list[tuple[float, float]] = []  # times and angles

    def add(self, scan: RadarScan) -> None:
        """Take a scan in, of the order of time."""
        self._latest.append(_without_spoke(scan))
        three = self._latest[0], self._latest[len(self._latest) // 2], self._latest[-1]
        since, before = (late.time_s - early.time_s for early, late in pairwise(three))
        even = min(since, before) > 0 and max(since, before) < UNEVEN * min(since, before)
        if len(self._latest) <= 2 * APART or not even or not all(0 < one.detections <= PLOTS for one in three):
            return
        clear, angle = self._turn(*three)
        self._scans += 1
        more = float(np.logaddexp(math.log(1 - SELDOM), math.log(SELDOM) + clear)) / OVERLAP
        self._evidence = max(self._evidence + more, 0.0)
        self._most = max(self._most, self._evidence)
        if clear > TURNED:
            self._turns.append((scan.time_s, angle))

    def _turn(self, first: RadarScan, middle: RadarScan, last: RadarScan) -> tuple[float, float]:
        """Return the log of the Bayes factor of a turn to none, and by how much the last scan has turned."""
        places, begin = (self._sensor.places(scan)[0] for scan in (middle, first))
        room = FASTEST_MPS * (middle.time_s - first.time_s) + ROOM_M
        near = cKDTree(begin).query_ball_point(places, room + BESIDE_RAD * middle.range_m)
        which = np.repeat(np.arange(len(places)), [len(found) for found in near])
        earlier = np.array([one for found in near for one in found], dtype=np.int64)
        later = last.times_s - middle.times_s[which, None]
        rate = (places[which] - begin[earlier]) / (middle.times_s[which] - first.times_s[earlier])[:, None]
        ahead = places[which, None] + later[..., None] * rate[:, None] - np.array([last.own.x_m, last.own.y_m])
        off = (last.range_m - np.hypot(ahead[..., 0], ahead[..., 1])) / (SCALE * self._sensor.range_sd_m)
        row, plot = np.nonzero(np.abs(off) < WINDOW)
        taken = slice(None, None, max(1, math.ceil(len(row) / ROWS)))
        row, plot = row[taken], plot[taken]
        if not len(row):
            return 0.0, 0.0
        turn = wrapped(last.bearing_rad[plot] - np.arctan2(ahead[row, plot, 0], ahead[row, plot, 1]), TURN_RAD)
        wide, middles = SCALE * self._sensor.bearing_sd_rad, which[row]
        weight = 1 / np.bincount(middles)[middles]
        ratio = OF_TARGETS * 2 * WINDOW / wide * np.exp(-0.5 * off[row, plot] ** 2)

        def likelihoods(turns: Array) -> Array:
            density = ratio * np.exp(-0.5 * (wrapped(turn - turns[:, None], TURN_RAD) / wide) ** 2)
            return np.asarray(np.log(1 - OF_TARGETS + density) @ weight)

        tried = likelihoods(turn)
        clear = tried.max() - math.log(TURN_RAD / wide) - likelihoods(wide * NONE).max()
        return float(clear), float(turn[tried.argmax()])

    @property
    def finding(self) -> Finding:
        """Whether the picture turns, when, and by how much."""
        holds = isinstance(self._sensor, HullRadar) or not (self._most > CLEAR and self._turns)
        first, most = self._turns[0][0] if self._turns else 0.0, max((abs(by) for _, by in self._turns), default=0.0)
        return Finding(
            "radar.turned", holds, 0.0, math.degrees(most),
            f"In {len(self._turns)} of {self._scans} scans plots of ships go on straight only if all bearings are "
            f"turned together, first at {moment(first)}, by up to {math.degrees(most):.2g} degrees: the whole picture "
            "turns, as if bearings were from a bow that swings, or headings were late or set anew. Tracks turn with "
            "it: ships are lost and begun anew, or are where none is.",
            "Give the heading of each scan (relative_bearing_deg, heading_deg), or bearings from true north.",
        )  # fmt: skip


def _without_spoke(scan: RadarScan) -> RadarScan:
    """Return a scan without plots of one bearing and many ranges: another radar's pulses, which go round."""
    far, degrees = scan.range_m, np.degrees(scan.bearing_rad).astype(np.int64) % 360
    each = np.bincount(degrees, minlength=360)
    along = np.sum([np.roll(each, k) for k in range(-NEAR_DEG, NEAR_DEG + 1)], axis=0)
    spoke = np.abs((degrees - along.argmax() + 180) % 360 - 180) <= NEAR_DEG
    if spoke.sum() < SPOKE or np.ptp(far[spoke]) < ACROSS * far.max():
        return scan
    return scan.select_detections(np.flatnonzero(~spoke))
