"""Whether scans, bearings and the radar's own way are measured anew each time, and not copied, rounded or frozen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding, share_of, whole_step
from elusive.contracts import Array
from elusive.report.clock import moment
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan

KEPT = 5000  # bearings by which steps are judged
FEW = 20  # bearings
SELDOM = 0.5  # share of the scans with a plot of a ship, below which it is asked why, whatever was told
PLOTS, COPY = 3, 0.8  # of a scan that can be a copy, and the share of them that stood before
RARE = 0.02  # share of other scans' plots that stood before, up to which no scan is a copy by chance
ROUNDED = 0.05  # share of scans that may be, where plots are rounded
INTERVALS_S = 0.1, 120.0  # between turns of an antenna
LATER_S, TIMES, SAILS_MPS = 20.0, 5.0, 2.0  # that a radar stays, as often as it usually does, and how fast it went


class Given(NamedTuple):
    """What a recording's scans are like."""

    compared: int = 0  # scans of some plots
    copied: int = 0  # of which most plots stood there before, to the last digit
    by_chance: float = 0.0  # share of the others' plots that did
    interval_s: float = math.nan  # from a scan to the next, in the median
    bearings_deg: Array = np.zeros(0)  # the first of them
    until_s: float = math.nan


class Gathered:
    """Takes scans in."""

    def __init__(self) -> None:
        self._before: set[tuple[float, float]] = set()
        self._compared = self._copied = self._plots = self._stood = 0
        self._intervals: list[float] = []
        self._bearings: list[float] = []
        self._until_s = math.nan

    def add(self, scan: RadarScan) -> None:
        """Take a scan in, of the order of time."""
        plots = list(zip(scan.range_m.tolist(), scan.bearing_rad.tolist(), strict=True))
        if len(self._intervals) < KEPT and not math.isnan(self._until_s):
            self._intervals.append(scan.time_s - self._until_s)
        self._until_s = scan.time_s
        if len(self._bearings) < KEPT:
            self._bearings += np.degrees(scan.bearing_rad).tolist()
        if len(plots) >= PLOTS:
            twice = len(plots) - len(set(plots))
            again = sum(plot in self._before for plot in plots)
            copied = max(again, 2 * twice) >= COPY * len(plots)
            self._compared, self._copied = self._compared + 1, self._copied + copied
            self._plots, self._stood = self._plots + len(plots) * (not copied), self._stood + again * (not copied)
        self._before = set(plots)

    @property
    def given(self) -> Given:
        """What they are like."""
        by_chance, interval_s = self._stood / max(self._plots, 1), float(np.median(self._intervals or [math.nan]))
        return Given(self._compared, self._copied, by_chance, interval_s, np.array(self._bearings), self._until_s)


def given_findings(given: Given, way: Array, sensor: RadarSensor) -> tuple[Finding, ...]:
    """Check scans, bearings and the radar's way, ``(S, 3)`` times and places where these change [s, m]."""
    return _copied(given), _rounded(given, sensor), _frozen(given, way)


def _copied(given: Given) -> Finding:
    fact = share_of(given.copied, given.compared, 0.0, tolerance=ROUNDED if given.by_chance > RARE else 0.0)
    return Finding(
        "radar.repeated", fact.holds, 0.0, fact.seen,
        f"In {given.copied} of {given.compared} scans most plots stood there before, to the last digit: scans or lines "
        "stand twice, or the radar has stopped. Each counts as seen anew: tracks are surer than they may be, and ships "
        "that seem to stop are lost.",
        "Leave the copies out.",
    )  # fmt: skip


def _rounded(given: Given, sensor: RadarSensor) -> Finding:
    degrees = given.bearings_deg
    step = whole_step(degrees) if len(degrees) >= FEW and np.ptp(np.round(degrees, 6)) > 0 else 0.0
    told_mrad, least_mrad = sensor.bearing_sd_mrad, 1000 * math.radians(step) / math.sqrt(12)
    return Finding(
        "radar.rounding", least_mrad <= told_mrad, told_mrad, least_mrad,
        f"All bearings are whole multiples of {step:g} degrees: rounding alone has a deviation of {least_mrad:.2g} "
        f"mrad, and {told_mrad:.2g} mrad was told. Ships seem to stand and to jump.",
        f"Tell --bearing-sd-mrad {math.hypot(told_mrad, 1.7 * least_mrad):.2g}, or take bearings of more digits.",
    )  # fmt: skip


def _frozen(given: Given, way: Array) -> Finding:
    """Look for a radar that sails, and is at one point from one scan to the next and for long."""
    times = way[:, 0]
    stays = np.diff(np.append(times, given.until_s))
    gone = np.hypot(*np.diff(way[:, 1:], axis=0).T) / np.maximum(np.diff(times), 1e-9)
    before = np.concatenate([[0.0], gone])
    after = np.concatenate([gone, [math.inf]])
    usual = float(np.median(stays))
    frozen = (stays > max(LATER_S, TIMES * usual)) & (before > SAILS_MPS) & (after > SAILS_MPS)
    first = int(frozen.argmax()) if frozen.any() else 0
    last_s = times[first] + stays[first]
    return Finding(
        "radar.own-frozen", not frozen.any(), 0.0, float(stays[frozen].sum()),
        f"The radar's own place is one point, to the last digit, from {moment(float(times[first]))} to "
        f"{moment(float(last_s))}, and it sailed at {before[first]:.2g} m/s until then: its log is frozen, and every "
        "track there is off by as far as it went.",
        "Leave that part out, or give another log of the ship (--own-ship).",
    )  # fmt: skip


def times_finding(given: Given, innovations: Sequence[float]) -> Finding:
    """Judge the unit of times, where tracks have few plots: antennas turn in seconds."""
    least, most = INTERVALS_S
    slow = given.interval_s > most
    values = np.array(innovations)
    seen = float(np.isfinite(values).mean()) if len(values) else 0.0
    return Finding(
        "radar.times", not ((slow or given.interval_s < least) and seen < SELDOM), 1.0, given.interval_s,
        f"Scans are {given.interval_s:.3g} s apart, as no antenna turns, and tracks are seen in {100 * seen:.0f} % of "
        f"them: times look like {'milliseconds' if slow else 'minutes or hours'}, and ships are not where tracks are.",
        "Convert the column time_s to seconds.",
    )  # fmt: skip


def seen_finding(innovations: Sequence[float], sensor: RadarSensor, *, told: bool = True) -> Finding:
    """Check that confirmed tracks have plots as often as was told; a scan without one has no innovation, NaN.

    What was not ``told`` was found, and is right; it may be too little of a radar that turns.
    """
    if not told:
        return _seldom(innovations)
    return _as_told(innovations, sensor.detection_probability)


def _seldom(innovations: Sequence[float]) -> Finding:
    values = np.array(innovations)
    fact = share_of(int(np.isfinite(values).sum()), len(values), 1.0, tolerance=1 - SELDOM)
    return Finding(
        "radar.detection", fact.holds, 1.0, fact.seen,
        f"Tracks have a plot in {100 * fact.seen:.0f} % of the scans alone: ships are hard to see, or what is taken "
        "for a scan is a part of one, whose times are rounded.",
        "Where plots have times of their own, tell --rotation-s.", grave=False,
    )  # fmt: skip


def _as_told(innovations: Sequence[float], told: float) -> Finding:
    values = np.array(innovations)
    fact = share_of(int(np.isfinite(values).sum()), len(values), told, tolerance=0.2)
    return Finding(
        "radar.detection", fact.holds or fact.seen > told, told, fact.seen,
        f"Tracks have a plot in {100 * fact.seen:.0f} % of the scans, and {100 * told:.0f} % was told: ships are "
        "missed or lost, or what is taken for a scan is a part of one, whose times are rounded.",
        f"Tell --detection-probability {fact.seen:.2g}; where plots have times of their own, --rotation-s.",
        grave=fact.seen < 0.6 * told,
    )  # fmt: skip
