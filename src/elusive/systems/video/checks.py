"""What a run of radar video is checked by, gathered turn by turn: its ships, and what they are beside."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Sequence

import numpy as np

from elusive.charts import Water
from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.sensors.radar_video import RadarVideo
from elusive.systems.video.ghosts import told_of
from elusive.systems.video.lasting import Lasting
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.registration import Registration, register
from elusive.systems.video.shadows import THIRDS, row_levels, shadows
from elusive.systems.video.start import VideoStart
from elusive.systems.video.swell import Swell
from elusive.systems.video.swinging import COAST, SETTLED, expected, swings, turned
from elusive.systems.video.told import findings_of, still_m
from elusive.systems.video.turns import Heard, blind
from elusive.tracking.track import Track

LATEST = 2000  # turns by whose clutter a run is checked
EDGE = 2  # cells about a ship in which what is fixed shows as well
MANY = 50  # ships at once
KNOWN = 5  # turns after which it is known how fast a ship is
SURE = 0.9  # existence of what its place is known of


class Judged:
    """Gathers, turn by turn, what a run is checked by; of the clutter, the latest turns."""

    def __init__(self, sensor: RadarVideo) -> None:
        self._sensor = sensor
        self._beside = dict[int, bool]()  # whether a ship that is there has never left what is fixed
        self._gone = Counter[bool]()  # the same of those that have ended, and how many
        self._at_once = self._crests = 0
        self._ghosts, self._told = 0, frozenset[int]()  # tracks that were another's echo, and those that are
        self._rows, self._known = np.zeros((2, THIRDS, sensor.shape[0]))  # sums of levels, and of how many turns
        self._swell: Swell | None = None
        self._lasting = Lasting(sensor)
        self._held = deque[float](maxlen=LATEST)
        self._turned = deque[Array](maxlen=LATEST)
        self._least, self._most = np.full(2, math.inf), np.full(2, -math.inf)
        self._last: Heard | None = None
        self._ships, self._since = list[Track](), dict[int, int]()  # that were under way then; for how many turns

    def add(self, heard: Heard, tracks: Sequence[Track]) -> None:
        """Take in a turn, and the tracks after it."""
        ships = [track for track in tracks if track.status == "confirmed"]
        self._at_once = max(self._at_once, len(ships))
        swell = heard.learnt.about.swell
        if swell is not None and swell.sure:
            crests = sum(track.status != "deleted" and swell.carries(track) for track in tracks)
            self._crests, self._swell = max(self._crests, crests), swell
        if heard.learnt.about.ghosts is not None:
            self._ghosts += len(heard.learnt.about.ghosts.found - self._told)
            self._told = heard.learnt.about.ghosts.found
        for ship in ships:
            if self._beside.get(ship.track, True):
                self._beside[ship.track] = self._is_beside(ship, heard)
        for gone in self._beside.keys() - {track.track for track in tracks}:
            self._gone[self._beside.pop(gone)] += 1
        place = np.array(heard.turn.place)
        self._least, self._most = np.minimum(self._least, place), np.maximum(self._most, place)
        self._held.append(heard.held)
        if self._last is not None:
            self._lasting.add(self._last, heard, tracks)
        levels = row_levels(heard)
        self._rows += np.nan_to_num(levels)
        self._known += np.isfinite(levels)
        before_s = heard.turn.time_s if self._last is None else self._last.turn.time_s
        ahead = expected(self._ships, before_s, heard.turn, self._sensor)
        fixed = heard.clutter.fixed
        moved = float((self._most - self._least).max()) > still_m(self._sensor)
        if moved or (heard.clutter.turns < SETTLED and fixed.mean() < COAST):  # ships alone tell it then
            fixed = np.zeros_like(fixed)
        self._turned.append(turned(heard.power, fixed, ahead))
        if moved:  # what rests is as good a mark then
            ships = [track for track in tracks if track.status != "deleted" and track.existence > SURE]
        self._since = {ship.track: self._since.get(ship.track, 0) + 1 for ship in ships}
        self._ships, self._last = [ship for ship in ships if self._since[ship.track] > KNOWN], heard

    def _is_beside(self, ship: Track, heard: Heard) -> bool:
        """Whether something fixed lies within an echo of a ship."""
        (row,), (column,) = self._sensor.cells(ship.mean[None, [X, Y]], heard.turn)
        about, fixed = np.arange(-EDGE, EDGE + 1), heard.clutter.fixed
        columns = np.clip(column + about, 0, fixed.shape[1] - 1)
        return bool(fixed[np.ix_((row + about) % fixed.shape[0], columns)].any())

    def findings(
        self, counts: Counter[str], start: VideoStart, water: Water | None, parameters: VideoTracking
    ) -> tuple[Registration | None, tuple[Finding, ...]]:
        """Return how a radar that stands lies to the chart, and what was checked."""
        assert self._last is not None
        clutter, registration = self._last.clutter, None
        fixed, moved = clutter.fixed, float((self._most - self._least).max())
        if water is not None and moved <= still_m(start.sensor):
            itself = fixed & ~clutter.beside
            registration = register(itself, start.sensor, water.probability, self._last.turn.place)
        unseen = blind(parameters.clutter, self._last.learnt, start.most, parameters.tracker.least_evidence)
        ships = [
            _many(self._at_once), _swell(self._swell, self._crests), told_of(self._ghosts), self._lasting.finding()
        ]  # fmt: skip
        known = self._known > 0.5 * self._known.max()
        ships.append(shadows(np.where(known, self._rows / np.maximum(self._known, 1), np.nan), start.sensor))
        ships.append(swings(np.array(self._turned), start.sensor))
        counted = self._gone + Counter(self._beside.values())
        if water is None and counted:
            ships.append(_beside(counted[True], counted.total()))
        return registration, (
            *findings_of(
                counts, registration, list(self._held), moved, start, fixed, unseen, charted=water is not None
            ),
            *ships,
        )


def _many(at_once: int) -> Finding:
    return Finding(
        "video.many", at_once <= MANY, MANY, at_once,
        f"{at_once} ships under way were told at once: more than are likely. Strong spots of no ship that come in each "
        "turn, as another radar's interference leaves them, are tracked sure and wrong.",
        "Turn the radar's interference rejection on; look at the report.",
    )  # fmt: skip


def _swell(swell: Swell | None, crests: int) -> Finding:
    """Whether tracks are carried by a swell, whose crests stand out of the sea between them."""
    towards = 0.0 if swell is None else math.degrees(swell.towards_rad)
    speed, length = (0.0, 0.0) if swell is None else (swell.speed_mps, swell.length_m)
    return Finding(
        "video.swell", swell is None, 0.0, crests,
        f"{crests} tracks at once were crests of a swell, {length:.0f} m long, that goes {speed:.0f} m/s towards "
        f"{towards:.0f} degrees: what goes at that speed in that direction is told as a candidate, be it a ship.",
        "Look at the report for ships that sail with the swell.", grave=False,
    )  # fmt: skip


def _beside(beside: int, ships: int) -> Finding:
    return Finding(
        "video.beside", beside == 0, 0.0, beside,
        f"{beside} of {ships} ships under way never left what is fixed by more than an echo: a coast in strong sea "
        "clutter, or rain, makes such tracks, slow ones along it, sure and wrong.",
        "Give --chart, so that land is known; else take them for the coast.", grave=2 * beside > ships,
    )  # fmt: skip
