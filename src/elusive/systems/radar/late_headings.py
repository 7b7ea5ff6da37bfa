"""Whether a ship's headings are late or early, by how its radar's picture turns as it does; and scans without it.

A compass that is damped, or a log whose clock is behind, tells the heading of some time ago: while the ship turns, all
bearings are off by what it turned since. Of three plots of a target the middle one lies between the others
(:mod:`elusive.systems.radar.triples`), if headings are read at the right time: the delay is the one under which triples
of scans, of a Poisson process with a Gaussian about zero in it, are likeliest (Streit, 2010, Poisson point processes).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.radar_scans import TURN_RAD, RadarScan
from elusive.systems.radar.straight import OVERLAP, mixture
from elusive.systems.radar.triples import USUAL, Triples

COARSE_S = np.arange(-2.0, 6.01, 0.5)  # delays that are tried first
FINE_S = np.arange(-0.5, 0.51, 0.1)  # and about the best of them
TURNS_RAD = math.radians(1.0)  # of a ship in three scans, from which these tell
MOST = 150  # triples of scans that are looked at
FEW = 25  # triples of plots
NEAR_S = 0.25  # of the best delay, by which it is told how well it is known
ODDS = math.log(1000.0)  # beforehand that a delay that is tried is none
EARLIER_S = 0.25  # between headings that are kept


class Late(NamedTuple):
    """How late headings are read."""

    late_s: float = 0.0
    error_s: float = math.nan


class Headings:
    """Gathers headings and scans in which the ship turns, and says how late the headings are.

    Parameters
    ----------
    kept
        Number of headings that are kept; None: all.
    """

    def __init__(self, kept: int | None = None) -> None:
        self._told = deque[tuple[float, float]](maxlen=kept)  # times and headings, without jumps of a turn
        self._latest: list[RadarScan] = []
        self._turning = deque[tuple[RadarScan, ...]](maxlen=MOST)
        self.turns = 0
        """Number of triples of scans in which the ship turned."""

    def add(self, scan: RadarScan) -> None:
        """Take a scan in, of the order of time."""
        if scan.heading_rad is None:
            self._latest.clear()
            return
        for time_s, heading in zip(scan.times_s.tolist(), scan.heading_rad.tolist(), strict=True):
            before_s, before = self._told[-1] if self._told else (-math.inf, heading)
            if time_s > before_s + EARLIER_S:
                self._told.append((time_s, before + math.remainder(heading - before, TURN_RAD)))
        self._latest = [*self._latest[-2:], scan]
        if len(self._latest) == 3:
            headings = np.concatenate([one.heading_rad for one in self._latest if one.heading_rad is not None])
            if np.ptp(np.unwrap(headings)) > TURNS_RAD:
                self._turning.append(tuple(self._latest))
                self.turns += 1

    @property
    def course(self) -> Array:
        """Times and headings, ``(2, n)``; the last of them goes on as the ship turned in the second before."""
        times, headings = np.array(self._told).reshape(-1, 2).T
        if not len(times):
            return np.zeros((2, 0))
        ago = max(int(np.searchsorted(times, times[-1] - 1.0, side="right")) - 1, 0)
        rate = (headings[-1] - headings[ago]) / max(times[-1] - times[ago], 1.0)
        ahead = COARSE_S[-1]
        return np.array([np.append(times, times[-1] + ahead), np.append(headings, headings[-1] + rate * ahead)])

    @property
    def late(self) -> Late:
        """How late headings are; none where that does not make plots go on far more straightly."""
        if not self._turning:
            return Late()
        course = self.course
        as_told, triples = self._likely(0.0, course)
        if as_told == -math.inf:
            return Late()
        tried = {0.0: as_told}
        for more in (COARSE_S, FINE_S):
            best = max(tried, key=lambda one: tried[one])
            others = [late for late in (best + more).tolist() if late not in tried]
            tried |= {late: self._likely(late, course, triples)[0] for late in others}
        best = max(tried, key=lambda one: tried[one])
        if not tried[best] - tried[0.0] > ODDS:
            return Late()
        near = np.array([(late, value) for late, value in tried.items() if abs(late - best) < NEAR_S])
        bend = -2 * np.polyfit(near[:, 0] - best, near[:, 1], 2)[0]
        return Late(float(f"{best:.2g}"), 1 / math.sqrt(max(bend, 1e-9)))

    def _likely(self, late_s: float, course: Array, triples: float = math.inf) -> tuple[float, float]:
        """Return the log likelihood of plots with headings read so late, of so many triples at most, and their number.

        Where echoes lie close to each other, as a coast's, how many triples they make says nothing of headings: those
        are asked whose middle plot is in no other, and how straight they are, not how many.
        """
        rows = list[Array]()
        for three in self._turning:
            each = Triples()
            for scan in three:
                each.add(righted(scan, course, late_s))
            rows.append(each.alone)
        errors = np.concatenate(rows)[:, :2]
        if len(errors) < FEW:
            return -math.inf, 0.0
        limits = np.array(USUAL[:2])
        *_, density = mixture(errors, limits, limits[None] / 4)
        return min(triples, len(errors)) * float(np.log(density).mean()) / OVERLAP, len(errors)


class Righted:
    """Scans with the headings that the ship had, read afresh at each iteration."""

    def __init__(self, scans: Iterable[RadarScan], course: Array, late_s: float) -> None:
        self._scans, self._course, self._late_s = scans, course, late_s

    def __iter__(self) -> Iterator[RadarScan]:
        return (righted(scan, self._course, self._late_s) for scan in self._scans)


def righted(scan: RadarScan, course: Array, late_s: float) -> RadarScan:
    """Return a scan with headings of a ``course``, times and headings ``(2, n)``, that are read so late."""
    if not late_s or scan.heading_rad is None:
        return scan
    told, had = (np.interp(scan.times_s + late, *course) for late in (0.0, late_s))
    bearing = (scan.bearing_rad + had - told) % TURN_RAD
    return scan._replace(bearing_rad=np.where(bearing < TURN_RAD, bearing, 0.0))


def late_finding(late: Late) -> Finding:
    """Say how late headings are."""
    by = f"{abs(late.late_s):.2g} s {'late' if late.late_s > 0 else 'early'}"
    return Finding(
        "radar.headings", not late.late_s, 0.0, late.late_s,
        f"Headings are {by} (± {late.error_s:.1g} s): as told, the whole picture turns whenever the ship does. "
        "Bearings are taken with the headings that it had."
        if late.late_s
        else "Plots go on straight when the ship turns.",
        "Set clocks of headings and plots alike; a damped compass stays late.",
        grave=False,
    )  # fmt: skip
