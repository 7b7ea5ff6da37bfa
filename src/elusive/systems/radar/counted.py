"""What a tracker's steps say of a radar: how often it sees ships, and how many plots are of nothing, by their range.

Plots of nothing: those of no confirmed track, less those by which a track that is confirmed later began.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.charts import Water
from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.radar import RadarSensor
from elusive.sensors.range_bands import BANDS, SECTORS, edges, sector_of, shares_of
from elusive.systems.radar.bunches import Bunches, explained
from elusive.systems.radar.checks import in_view
from elusive.systems.radar.land import land_shares
from elusive.tracking.track import Step

KNOWN = 0.9  # existence from which a miss is one
OPEN_SEA = 0.99  # P(water), where no plot is of the coast
LEAST_SEA = 0.05  # share of a band that is taken to be sea at least
TIMES, MORE, ERRORS = 2.0, 1.0, 4.0  # of the alarms told; plots a scan, and standard errors, beyond
RECENT = 4  # scans by which a sea that rises is known


class Heard(NamedTuple):
    """What a tracker counted."""

    detected: float  # probability of detection
    trials: float  # scans of confirmed tracks
    false: float  # plots of no track a scan, the view all sea
    shares: tuple[float, ...]  # of these, in bands of range
    sectors: tuple[float, ...]  # and in sectors of the view


class Counts:
    """Counts step by step.

    Parameters
    ----------
    sea
        P(water) of places that count.
    memory_scans
        After which a count has faded; infinite: never.
    """

    def __init__(self, sea: float = OPEN_SEA, memory_scans: float = math.inf) -> None:
        self._sea, self._fade = sea, 1 - 1 / memory_scans
        self._hits = self._trials = self._scans = 0.0
        self._false = np.zeros((BANDS, SECTORS))  # plots in each band of range and sector of the view
        self._begun = dict[int, Array]()  # of each candidate
        self._recent = deque[Array](maxlen=RECENT)
        self.bunches = Bunches()
        """Of what no ship explains."""

    def add(self, step: Step, sensor: RadarSensor, water: Water | None) -> None:
        """Take a step in, tracked with a sensor and what is known of water."""
        scan, targets = step.measurement, step.state.targets
        confirmed = [one for one in targets if one.life.status == "confirmed"]
        known = [one.detection >= 0 for one in confirmed if one.existence > KNOWN and in_view(one, scan, sensor)]
        self._trials, self._hits = self._fade * self._trials + len(known), self._fade * self._hits + sum(known)
        self._scans = self._fade * self._scans + 1
        self.bunches.add_left_over(scan, sensor, targets, water)
        at_sea = np.ones(scan.detections, dtype=bool)
        if water is not None and scan.detections:
            at_sea = water.probability(sensor.places(scan)[0]) >= self._sea
        left = at_sea & ~explained(scan, sensor, confirmed).any(axis=0)
        low, high, half = sensor.limits
        band = np.searchsorted(edges(low, high, BANDS)[1:-1], scan.range_m, side="right")
        sector = sector_of(scan.bearing_rad, sensor.middle_rad, half, SECTORS)
        came = np.zeros((BANDS, SECTORS))
        np.add.at(came, (band[left], sector[left]), 1)
        self._recent.append(came)
        self._false = self._fade * self._false + self._recent[-1]
        candidates = [one for one in targets if one.life.status == "candidate"]
        self._begun.update({one.life.track or 0: np.zeros((BANDS, SECTORS)) for one in candidates} | self._begun)
        for one in candidates:
            begun = self._begun[one.life.track or 0]
            begun *= self._fade
            if one.detection >= 0:
                begun[band[one.detection], sector[one.detection]] += at_sea[one.detection]
        for one in confirmed:
            self._false -= self._begun.pop(one.life.track or 0, 0.0)
        for one in targets:
            if one.life.status == "deleted":
                self._begun.pop(one.life.track or 0, None)

    def risen(self) -> bool:
        """Whether the latest scans have far more plots of nothing than those before; if so, these are forgotten."""
        lately = np.sum(self._recent, axis=0)
        bands, before = lately.sum(axis=1), (self._false - lately).clip(0).sum(axis=1)
        share = len(self._recent) / max(self._scans - len(self._recent), 1)
        before *= share
        risen = bool((bands > TIMES * before + ERRORS * (np.sqrt(before) + MORE * RECENT)).any())
        if risen:
            self._false, self._scans = lately, float(len(self._recent))
            self._begun.clear()
        return risen

    def heard(self, land: Array) -> Heard:
        """Return what was counted, where so much of each is land, ``(BANDS, SECTORS)``."""
        sea, false = np.maximum(1 - land, LEAST_SEA), self._false.clip(0)
        shares, sectors = shares_of(false, sea)
        rate = float(false.sum() / (max(self._scans, 1) * (shares @ sea @ sectors)))
        detected = (self._hits + 1) / (self._trials + 2)
        return Heard(detected, self._trials, rate, tuple(shares.tolist()), tuple(sectors.tolist()))

    def finding(self, sensor: RadarSensor, water: Water | None, way: Array) -> Finding:
        """Judge whether there are many more plots of nothing than are expected, in some band of range.

        The radar's ``way`` is ``(S, 2)`` [m].
        """
        sectors = np.array(sensor.false_alarm_sectors)
        land = land_shares(sensor, water, BANDS, len(sectors), way) @ (sectors / sectors.sum())
        sea = np.maximum(1 - land, LEAST_SEA)
        limits, scans = edges(*sensor.limits[:2], BANDS), max(self._scans, 1.0)
        told, seen = sensor.false_alarms * _in_bands(sensor) * sea, self._false.sum(axis=1).clip(0) / scans
        excess = seen - np.maximum(TIMES * told, told + MORE) - ERRORS * np.sqrt(told / scans)
        worst = int(excess.argmax())
        return Finding(
            "radar.alarms", not excess[worst] > 0, float(told[worst]), float(seen[worst]),
            f"Between {limits[worst]:.0f} and {limits[worst + 1]:.0f} m a scan has {seen[worst]:.2g} plots of no "
            f"track, and {told[worst]:.2g} is expected: where more come than that, tracks are made of them.",
            "Leave out --false-alarms, or tell what elusive fit radar finds.",
        )  # fmt: skip


def _in_bands(sensor: RadarSensor) -> Array:
    """Shares of a sensor's false alarms in the bands that are counted."""
    low, high, _ = sensor.limits
    of: Sequence[float] = sensor.false_alarm_shares
    reached = np.interp(edges(low, high, BANDS), edges(low, high, len(of)), np.cumsum([0.0, *of]) / sum(of))
    return np.diff(reached)
