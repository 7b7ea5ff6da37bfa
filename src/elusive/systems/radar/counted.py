"""What a tracker's steps say of a radar: how often it sees ships, and how many plots are of nothing, by their range.

Plots of nothing: those of no confirmed track, less those by which a track that is confirmed later began, and those that
come where plots do all along.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.charts import Water
from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import HullRadar
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.range_bands import BANDS, edges
from elusive.systems.radar.bunches import Bunches, explained
from elusive.systems.radar.checks import in_view
from elusive.systems.radar.land import land_shares
from elusive.systems.radar.lives import Lives
from elusive.systems.radar.patches import BEARINGS, RANGES, Cells, Laid, Lasting, cell_of, in_bands, laid
from elusive.systems.radar.recorded import RecordedRadar
from elusive.systems.radar.triples import PlotErrors, Triples
from elusive.systems.radar.wakes import Trailing
from elusive.tracking.track import Step

OPEN_SEA = 0.99  # P(water), where no plot is of the coast
LEAST_SEA = 0.05  # share of a band that is taken to be sea at least
TIMES, MORE, ERRORS = 2.0, 1.0, 4.0  # of the alarms told; plots a scan, and standard errors, beyond
RECENT = 4  # scans by which a sea that rises is known


class Heard(NamedTuple):
    """What a tracker counted."""

    detected: float  # probability of detection
    trials: float  # scans of confirmed tracks
    alarms: Laid  # where plots of no track lie
    lives: tuple[float, ...]  # of clutter that lasts
    wakes: tuple[float, ...]  # behind ships
    behind: tuple[float, ...]  # of ships, be it wakes or not
    bunched: float  # share of what no ship explains that comes in bunches
    errors: PlotErrors | None  # that plots show beside those of wakes, if any were taken to be


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
        self._lives = Lives(self._fade)
        self._false = Lasting(self._fade)  # plots of nothing
        self._begun = dict[int, list[tuple[int, int, int]]]()  # scans and cells of a candidate's plots
        self._recent = deque[Array](maxlen=RECENT)
        self._trailing = Trailing(self._fade)
        self._beside: Triples | None = None  # wakes
        self.bunches = Bunches()
        """Of what no ship explains."""

    def add(
        self, step: Step, sensor: RadarSensor, water: Water | None, radar: RecordedRadar | None = None
    ) -> RadarScan:
        """Take a step of :func:`~elusive.systems.radar.track.track_radar` in.

        It was tracked with a sensor and what is known of water and the ``radar``.

        Returns
        -------
        RadarScan
            Its scan without plots of ground, of what stands, and of wakes.
        """
        ground = wakes = still = None
        if radar is not None:
            ground, wakes, still = radar.ground(sensor), radar.trails(sensor), radar.standing(sensor)
        scan, targets = step.measurement, step.state.belief.targets
        confirmed = [one for one in targets if one.life.status == "confirmed"]
        there = [one for one in targets if in_view(one, scan, sensor)]
        stands = {track.track: track.extra.get("stands", 0.0) for track in step.tracks}
        self._lives.add(step.state.ages, there, step.state.ways, stands)
        left = self._at_sea(scan, sensor, water) & ~explained(scan, sensor, confirmed).any(axis=0)
        theirs = np.zeros_like(left)
        for echoes in (ground, still):
            theirs |= False if echoes is None else echoes.theirs(scan)
        left &= ~theirs
        if not isinstance(sensor, HullRadar):  # whose plots lie behind where its hull is told too short
            moves = {track.track: track.extra.get("moves", 1.0) for track in step.tracks}
            sure = {one.life.track or 0: one for one in there if one.life.status == "confirmed"}
            sail = {track: one._replace(existence=one.existence * moves[track]) for track, one in sure.items()}
            self._trailing.add(scan, sensor, sail, left)
        trailing = np.zeros_like(left)
        if wakes is not None:
            trailing = left & wakes.explained(scan, confirmed)
        beside: RadarScan = scan.select_detections(np.flatnonzero(~(trailing | theirs)))
        if wakes is not None:
            self._beside = self._beside or Triples()
            self._beside.add(beside)
        self.bunches.add_left_over(scan, sensor, targets, water, trailing | theirs)
        left &= ~trailing
        far, turned = self._take(scan, sensor, left)
        for one in targets:
            number = one.life.track or 0
            if one.life.status == "candidate" and one.detection >= 0 and left[one.detection]:
                cell = int(far[one.detection]), int(turned[one.detection])
                self._begun.setdefault(number, []).append((self._false.scan, *cell))
            elif one.life.status == "confirmed":
                self._false.take_back(self._begun.pop(number, ()))
            elif one.life.status == "deleted":
                self._begun.pop(number, None)
        return beside

    def look(self, scan: RadarScan, sensor: RadarSensor, water: Water | None) -> None:
        """Take all plots of a scan for those of nothing, before any ship is known."""
        self._take(scan, sensor, self._at_sea(scan, sensor, water))

    def _at_sea(self, scan: RadarScan, sensor: RadarSensor, water: Water | None) -> NDArray[np.bool_]:
        if water is None or not scan.detections:
            return np.ones(scan.detections, dtype=bool)
        return np.asarray(water.probability(sensor.places(scan)[0]) >= self._sea)

    def _take(self, scan: RadarScan, sensor: RadarSensor, left: NDArray[np.bool_]) -> tuple[Cells, Cells]:
        far, turned = cell_of(scan, sensor)
        came = np.zeros((RANGES, BEARINGS))
        np.add.at(came, (far[left], turned[left]), 1)
        self._recent.append(came)
        self._false.add(came)
        return far, turned

    def risen(self) -> bool:
        """Whether the latest scans have far more plots of nothing than those before; if so, these are forgotten."""
        lately = np.sum(self._recent, axis=0)
        bands, before = in_bands(lately), in_bands((self._false.counts - lately).clip(0))
        share = len(self._recent) / max(self._false.scans - len(self._recent), 1)
        before *= share
        risen = bool((bands > TIMES * before + ERRORS * (np.sqrt(before) + MORE * RECENT)).any())
        if risen:
            self._false = Lasting(self._fade)
            for came in self._recent:
                self._false.add(came)
            self._begun.clear()
        return risen

    def heard(self, land: Array, sensor: RadarSensor, *, every: bool = False) -> Heard:
        """Return what was counted of a sensor, where so much of each is land, ``(BANDS, SECTORS)``."""
        false, sea = self._false, np.maximum(1 - land, LEAST_SEA)
        found = laid(false.counts.clip(0), false.lasting, max(false.scans, 1.0), sea, sensor)
        detected, trials, lives = self._lives.sorted_out(every=every)
        errors, trailing = None if self._beside is None else self._beside.fit(), self._trailing
        bunched = self.bunches.share
        return Heard(detected, trials, found, lives, trailing.wakes, trailing.behind, bunched, errors)

    def finding(self, sensor: RadarSensor, water: Water | None, way: Array) -> Finding:
        """Judge whether there are many more plots of nothing than are expected, in some band of range.

        The radar's ``way`` is ``(S, 2)`` [m].
        """
        sectors = np.array(sensor.false_alarm_sectors)
        land = land_shares(sensor, water, BANDS, len(sectors), way) @ (sectors / sectors.sum())
        sea = np.maximum(1 - land, LEAST_SEA)
        limits, scans = edges(*sensor.limits[:2], BANDS), max(self._false.scans, 1.0)
        told = sensor.false_alarms * _shares(sensor) * sea + _patched(sensor)
        seen = in_bands(self._false.counts).clip(0) / scans
        excess = seen - np.maximum(TIMES * told, told + MORE) - ERRORS * np.sqrt(told / scans)
        worst = int(excess.argmax())
        return Finding(
            "radar.alarms", not excess[worst] > 0, float(told[worst]), float(seen[worst]),
            f"Between {limits[worst]:.0f} and {limits[worst + 1]:.0f} m a scan has {seen[worst]:.2g} plots of no "
            f"track, and {told[worst]:.2g} is expected: where more come than that, tracks are made of them.",
            "Leave out --false-alarms, or tell what elusive fit radar finds.",
        )  # fmt: skip


def _patched(sensor: RadarSensor) -> Array:
    """Alarms of a sensor's patches in the bands that are counted."""
    limits, found = edges(*sensor.limits[:2], BANDS), np.zeros(BANDS)
    for near, far, _, _, number in sensor.false_alarm_patches:
        found += number * np.diff(limits.clip(near, far)) / (far - near)
    return found


def _shares(sensor: RadarSensor) -> Array:
    """Shares of a sensor's false alarms in the bands that are counted."""
    low, high, _ = sensor.limits
    of: Sequence[float] = sensor.false_alarm_shares
    reached = np.interp(edges(low, high, BANDS), edges(low, high, len(of)), np.cumsum([0.0, *of]) / sum(of))
    return np.diff(reached)
