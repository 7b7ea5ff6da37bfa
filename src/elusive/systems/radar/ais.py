"""What ships report by AIS, fused with a radar's tracks at its own times: whose tracks they are, and what does not fit.

Where the radar looks, it alone begins tracks, and a report that fits none moves none. Beyond its view a ship that
reports is a track as long as it does.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.checks import Finding
from elusive.contracts import VX, VY, Array, X, Y
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.tracking.detection_targets import Target
from elusive.tracking.detections import DetectionState, DetectionTracker
from elusive.tracking.reports import PLACE_SD_M, Report, fused

SILENT_S = 200.0  # somewhat longer than between the reports of a ship at anchor
FEW, MOST = 5, 0.5  # reports from which something is said, and the share of them that fits
FAR_M, STRAY, OTHER_MPS = 3000.0, 4.0, 1.5
GONE = 1e-9
LATEST = 2000  # of a ship's reports, by which it is judged


class Misfit(NamedTuple):
    """A report that fits no track, from the nearest confirmed one."""

    off: Array  # (2,) [m]
    velocity: Array  # (2,) of the track [m/s]


class AisFusion:
    """Takes reports into tracks between scans.

    Parameters
    ----------
    reports
        On the clock of the scans.
    more
        Live: returns what has come since it was called last; what it tells of a time before the latest scan is late,
        and left out.
    """

    def __init__(self, reports: Sequence[Report] = (), more: Callable[[], Sequence[Report]] | None = None) -> None:
        self._reports, self._next = sorted(reports, key=lambda report: report.time_s), 0
        self._more, self._told = more, len(reports)
        self._names: dict[int, Counter[int]] = defaultdict(Counter)  # of each track
        self._latest: dict[int, float] = {}  # report of each track
        self._counts: dict[int, Counter[str]] = defaultdict(Counter)
        self._paces: dict[int, deque[tuple[Array, Array]]] = defaultdict(
            lambda: deque(maxlen=LATEST)
        )  # velocities seen and told
        self._misfits: dict[int, deque[Misfit]] = defaultdict(lambda: deque(maxlen=LATEST))

    def name_of(self, track: int | None) -> float:
        """MMSI of a track; NaN of one that nobody reports to be."""
        names = self._names.get(track or 0)
        return float(names.most_common(1)[0][0]) if names else math.nan

    def before(
        self, scan: RadarScan, state: DetectionState, tracker: DetectionTracker, rng: Generator
    ) -> DetectionState:
        """Take in what was reported before a scan and after the one before; none before the first."""
        if self._more is not None:
            came = self._more()
            self._told += len(came)
            waiting = [*self._reports[self._next :], *came]
            self._reports, self._next = sorted(waiting, key=lambda report: report.time_s), 0
        while self._next < len(self._reports) and self._reports[self._next].time_s <= scan.time_s:
            report = self._reports[self._next]
            self._next += 1
            if not math.isnan(state.time_s) and report.time_s >= state.time_s:
                state = self._taken(report, scan, state, tracker, rng)
        return state._replace(targets=tuple(self._heard(one, scan, tracker) for one in state.targets))

    def _taken(
        self, report: Report, scan: RadarScan, state: DetectionState, tracker: DetectionTracker, rng: Generator
    ) -> DetectionState:
        looks = _looked_at(report.place, scan, tracker)
        state, taker = fused(state, report, tracker, rng, begins=not looks)
        counts = self._counts[report.name]
        counts["reports"] += 1
        if taker is not None:
            counts["taken"] += 1
            target = state.targets[taker]
            track = target.life.track
            if looks:
                self._paces[report.name].append((target.mean[[VX, VY]], report.velocity))
            if track is not None:
                self._names[track][report.name] += 1
                self._latest[track] = report.time_s
        else:
            self._misfits[report.name].append(_misfit(report, state))
        return state

    def _heard(self, target: Target, scan: RadarScan, tracker: DetectionTracker) -> Target:
        """End a target that is silent where the radar does not look."""
        since = self._latest.get(target.life.track or 0)
        if since is None or scan.time_s - since < SILENT_S or _looked_at(target.mean[[X, Y]], scan, tracker):
            return target
        return target._replace(existence=GONE)

    def rows(self) -> list[tuple[str, str]]:
        """Say how many ships report, and how many of their reports are a track's."""
        total = sum((counts for counts in self._counts.values()), Counter[str]())
        return [("AIS", f"{len(self._counts)} ships, {total['reports']} reports, {total['taken']} of them of tracks")]

    def finding(self) -> Finding:
        """Name the ships whose reports do not fit what the radar sees."""
        wrong = [
            name
            for name, counts in self._counts.items()
            if counts["reports"] >= FEW and counts["taken"] < MOST * counts["reports"]
        ]
        heard = bool(self._counts)
        said = [self._said(name) for name in wrong] + [pace for name in self._counts if (pace := self._pace(name))]
        return Finding(
            "radar.ais", heard and not said, 0.0, len(said),
            f"None of {self._told} reports of AIS falls between the first and the last scan: the clocks differ."
            if not heard
            else f"AIS does not fit the radar: {'; '.join(said)}. No track follows that."
            if said
            else "What ships report fits.",
            "Look at the reports' clock and places, or leave these ships out of the file.",
        )  # fmt: skip

    def _said(self, name: int) -> str:
        """Say what is wrong with a ship's reports, by the nearest tracks."""
        counts = self._counts[name]
        which = f"{name} ({counts['reports'] - counts['taken']} of {counts['reports']} reports)"
        near = [one for one in self._misfits[name] if np.hypot(*one.off) < FAR_M]
        if len(near) < MOST * len(self._misfits[name]):
            return f"{which} reports where no ship is seen"
        off = np.array([one.off for one in near])
        velocity = np.array([one.velocity for one in near])
        middle, sd = np.median(off, axis=0), STRAY * PLACE_SD_M
        if np.hypot(*middle) < sd:
            return f"{which} strays about its track"
        speed = np.hypot(*velocity.T)
        late = np.median(-(off * velocity).sum(axis=1) / np.maximum(speed, 0.1) ** 2)
        across = np.median(np.abs(off[:, 0] * velocity[:, 1] - off[:, 1] * velocity[:, 0]) / np.maximum(speed, 0.1))
        if across < sd and late > 0:
            return f"{which} lies {np.hypot(*middle):.0f} m astern of its track, as if {late:.0f} s old"
        return f"{which} lies {middle[0]:+.0f} m east, {middle[1]:+.0f} m north of the nearest track"

    def _pace(self, name: int) -> str:
        """Say that a ship tells another velocity than it is seen to have; nothing where it does not."""
        paces = np.array([both for both in self._paces[name] if not np.isnan(both[1]).any()]).reshape(-1, 2, 2)
        if len(paces) < FEW:
            return ""
        seen, told = np.median(paces, axis=0)
        if np.hypot(*(told - seen)) < OTHER_MPS:
            return ""
        courses = [math.degrees(math.atan2(*one)) % 360 for one in (told, seen)]
        return (
            f"{name} tells {np.hypot(*told):.1f} m/s towards {courses[0]:.0f} degrees, and is seen to go "
            f"{np.hypot(*seen):.1f} m/s towards {courses[1]:.0f}"
        )


def _looked_at(place: Array, scan: RadarScan, tracker: DetectionTracker) -> bool:
    """Whether the radar would see a ship at a place."""
    assert isinstance(tracker.sensor, RadarSensor)
    state = np.zeros((1, 4))
    state[0, [X, Y]] = place
    return bool(tracker.sensor.detection_probabilities(state, scan)[0] > 0)


def _misfit(report: Report, state: DetectionState) -> Misfit:
    sure = [one for one in state.targets if one.life.status == "confirmed"]
    if not sure:
        return Misfit(np.full(2, math.inf), np.zeros(2))
    nearest = min(sure, key=lambda one: float(np.hypot(*(report.place - one.mean[[X, Y]]))))
    return Misfit(report.place - nearest.mean[[X, Y]], nearest.mean[[VX, VY]])
