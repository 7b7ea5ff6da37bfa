"""Bearings by the headings that a radar's ship had, where those told are late or early: of a recording and live.

How late they are is judged by :mod:`elusive.systems.radar.headings`. The heading of a moment is what is told so much
later: a live run waits for that.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import islice

import numpy as np

from elusive.charts import Water
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.sensors.radar_scans import TURN_RAD, RadarScan
from elusive.systems.radar.checks import plot_errors
from elusive.systems.radar.headings import Late, late_headings, told_headings
from elusive.systems.radar.recorded import RecordedRadar
from elusive.systems.radar.survey import RadarSurvey, held, survey

EVERY, KEPT = 10, 400  # scans of a live run after which headings are judged, and latest ones by which they are
BETTER = 2.0  # logarithm of the likelihood ratio from which another delay is taken: Wilks' two deviations
ABOUT = 40  # latest scans, of whose headings those that wait take theirs


class Righted:
    """Scans with bearings by the headings that their ship had, read afresh at each iteration.

    Parameters
    ----------
    scans
        As told.
    late_s
        How late their headings are.
    """

    def __init__(self, scans: Iterable[RadarScan], late_s: float) -> None:
        self._scans, self._late_s, self._told = scans, late_s, told_headings(scans)

    def __iter__(self) -> Iterator[RadarScan]:
        for scan in self._scans:
            yield _righted(scan, self._late_s, self._told)


def look_through(
    scans: Iterable[RadarScan],
    radar: RecordedRadar,
    water: Water | None = None,
    watched: Iterable[RadarScan] | None = None,
) -> tuple[Iterable[RadarScan], RadarSurvey]:
    """Look through a recording's scans; return them as they are to be tracked, with right headings, and the look.

    Parameters
    ----------
    scans
        As told.
    radar
        What is known of it.
    water
        Of a chart.
    watched
        The scans as they are read first; None: as they are.
    """
    seen = survey(scans if watched is None else watched, water)
    scans = held(scans, seen)
    late = late_headings(seen.passed, *plot_errors(seen, radar.bind(seen)))
    if late.named and any(scan.heading_rad is not None for scan in seen.passed):
        righted = Righted(scans, late.late_s)
        seen, late = survey(righted, water), late._replace(righted_s=-math.inf)
        scans = held(righted, seen)
    return scans, seen._replace(headings=late)


class Righting:
    """Puts headings right as scans come, from where they are known to be late."""

    def __init__(self) -> None:
        self.late = Late()
        """How late they are, by all scans so far."""
        self._passed = deque[RadarScan](maxlen=KEPT)
        self._count = 0

    def righted(self, scans: Iterable[RadarScan], errors: Callable[[], tuple[float, float]]) -> Iterator[RadarScan]:
        """Yield scans, each once the heading that its ship had is told.

        Parameters
        ----------
        scans
            As they come.
        errors
            Gives how far plots err by then, in range [m] and bearing [rad].
        """
        waiting = deque[RadarScan]()
        try:
            for scan in scans:
                self._take(scan, errors)
                waiting.append(scan)
                while waiting and self._is_told(waiting[0]):
                    yield self._right(waiting.popleft())
        except DataError:  # after what came before it
            yield from map(self._right, waiting)
            raise
        yield from map(self._right, waiting)

    def _take(self, scan: RadarScan, errors: Callable[[], tuple[float, float]]) -> None:
        if not self._passed or scan.time_s > self._passed[-1].time_s:  # else it waited when the run was ended
            self._passed.append(scan)
            self._count += 1
            if not self._count % EVERY:
                self.judge(*errors())

    def judge(self, range_sd_m: float, bearing_sd_rad: float) -> None:
        """Judge headings by the latest scans, whose plots err so far."""
        held_s = self.late.late_s if self.late.named else 0.0
        found = late_headings(self._passed, range_sd_m, bearing_sd_rad, held_s)
        if not self.late.named:
            told = any(scan.heading_rad is not None for scan in self._passed)
            since_s = self._passed[-1].time_s if found.named and told else math.nan
            self.late = found._replace(righted_s=since_s)
        elif found.gain > BETTER:
            self.late = self.late._replace(late_s=found.late_s)

    def seen(self, first: RadarSurvey, range_sd_m: float, bearing_sd_rad: float) -> RadarSurvey:
        """Return the look at the first scans with what the latest say of headings and of the ship's way."""
        self.judge(range_sd_m, bearing_sd_rad)
        places = {(scan.own.x_m, scan.own.y_m) for scan in self._passed}
        passed = Righted(self._passed, self.late.late_s) if self._rights else self._passed
        return first._replace(passed=tuple(passed) if len(places) > 1 else (), headings=self.late)

    @property
    def _rights(self) -> bool:
        return not math.isnan(self.late.righted_s)

    def _is_told(self, scan: RadarScan) -> bool:
        """Whether the heading that the ship had in a scan has been told."""
        until_s = max(scan.time_s, float(scan.times_s.max(initial=scan.time_s))) + self.late.late_s
        return not self._rights or self.late.late_s <= 0 or self._passed[-1].time_s >= until_s

    def _right(self, scan: RadarScan) -> RadarScan:
        if not self._rights:
            return scan
        latest = [*islice(self._passed, max(0, len(self._passed) - ABOUT), None)]
        return _righted(scan, self.late.late_s, told_headings(latest))


def _righted(scan: RadarScan, late_s: float, told: Array) -> RadarScan:
    """Return a scan whose headings are so late with bearings by those that its ship had, of all ``(2, k)`` told."""
    bow, had = (np.interp(scan.times_s + late, *told) for late in (0.0, late_s))
    bearing = (scan.bearing_rad + had - bow) % TURN_RAD
    return scan._replace(bearing_rad=np.where(bearing < TURN_RAD, bearing, 0.0))
