"""Whether radar video looks as it was told: its north, its place on the chart, its clutter, its turns."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elusive.charts import Water
from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.sensors.echo_extent import EchoExtent
from elusive.sensors.radar_video import RadarVideo
from elusive.systems.video.ghosts import told_of
from elusive.systems.video.registration import Registration, register
from elusive.systems.video.shadows import THIRDS, row_levels, shadows
from elusive.systems.video.spirals import spirals
from elusive.systems.video.swell import Swell
from elusive.systems.video.swinging import FEW_TURNS, swings, turned
from elusive.systems.video.turns import Heard, VideoStart
from elusive.tracking.track import Track

CHANGED = 3  # turns at the end in another range scale
LATEST = 2000  # turns by whose clutter a run is checked
SURE = 3.0  # errors of a registration beyond which it is told
WIDE_DEG, PART = 1.0, 0.3  # of a bias of north that matters: in degrees, and in beams
LIKE = 0.3  # correlation of what is fixed with charted land from which they are the same coast
FIXES_M = 10.0  # of a position that jitters
SPIKY = 2.0  # share of the clutter beyond what its law lets expect, to that
OTHER_EXTENT = 2.0  # factor by which echoes reach further or less far than told
CROWDED = 0.1  # share of the cells that are fixed
EDGE = 2  # cells about a ship in which what is fixed shows as well
INTERFERED = 0.002  # share of azimuths
MANY = 50  # ships at once
LEVELS = 8  # of amplitude, three bits


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
        self._held = deque[float](maxlen=LATEST)
        self._turned = deque[Array](maxlen=LATEST)
        self._least, self._most = np.full(2, math.inf), np.full(2, -math.inf)
        self._last: Heard | None = None

    def add(self, heard: Heard, tracks: Sequence[Track]) -> None:
        """Take in a turn, and the tracks after it."""
        ships = [track for track in tracks if track.status == "confirmed"]
        self._at_once = max(self._at_once, len(ships))
        swell = heard.learnt.swell
        if swell is not None and swell.sure:
            crests = sum(track.status != "deleted" and swell.carries(track) for track in tracks)
            self._crests, self._swell = max(self._crests, crests), swell
        if heard.learnt.ghosts is not None:
            self._ghosts += len(heard.learnt.ghosts.found - self._told)
            self._told = heard.learnt.ghosts.found
        for ship in ships:
            if self._beside.get(ship.track, True):
                self._beside[ship.track] = self._is_beside(ship, heard)
        for gone in self._beside.keys() - {track.track for track in tracks}:
            self._gone[self._beside.pop(gone)] += 1
        place = np.array(heard.turn.place)
        self._least, self._most = np.minimum(self._least, place), np.maximum(self._most, place)
        self._held.append(heard.held)
        levels = row_levels(heard)
        self._rows += np.nan_to_num(levels)
        self._known += np.isfinite(levels)
        self._turned.append(turned(heard.power, heard.clutter.fixed))
        self._last = heard

    def _is_beside(self, ship: Track, heard: Heard) -> bool:
        """Whether something fixed lies within an echo of a ship."""
        x, y = ship.mean[[X, Y]] - np.array(heard.turn.place)
        first, step, pitch = self._sensor.grid
        rows = np.arange(-EDGE, EDGE + 1) + round(math.atan2(x, y) / pitch - 1)
        columns = np.arange(-EDGE, EDGE + 1) + round((math.hypot(x, y) - first) / step)
        fixed = heard.clutter.fixed
        columns = np.clip(columns, 0, fixed.shape[1] - 1)
        return bool(fixed[np.ix_(rows % fixed.shape[0], columns)].any())

    def findings(
        self, counts: Counter[str], start: VideoStart, water: Water | None
    ) -> tuple[Registration | None, tuple[Finding, ...]]:
        """Return how a radar that stands lies to the chart, and what was checked."""
        assert self._last is not None
        clutter, registration = self._last.clutter, None
        fixed, moved = clutter.fixed, float((self._most - self._least).max())
        if water is not None and moved <= _still_m(start.sensor):
            itself = fixed & ~clutter.beside
            registration = register(itself, start.sensor, water.probability, self._last.turn.place)
        ships = [_many(self._at_once), _swell(self._swell, self._crests), told_of(self._ghosts)]
        known = self._known > 0.5 * self._known.max()
        ships.append(shadows(np.where(known, self._rows / np.maximum(self._known, 1), np.nan), start.sensor))
        if moved <= _still_m(start.sensor):
            ships.append(swings(np.array(self._turned), start.sensor))
        counted = self._gone + Counter(self._beside.values())
        if water is None and counted:
            ships.append(_beside(counted[True], counted.total()))
        return registration, (
            *findings_of(counts, registration, list(self._held), moved, start, fixed, charted=water is not None),
            *ships,
        )


def findings_of(
    counts: Counter[str], registration: Registration | None, held: list[float], moved_m: float, start: VideoStart,
    fixed: NDArray[np.bool_], *, charted: bool = False,
) -> tuple[Finding, ...]:  # fmt: skip
    """Return what a recording says of what was told of it."""
    spokes, sensor = max(counts["spokes"], 1), start.sensor
    still_m = _still_m(sensor)
    found = [
        _turns(counts["turns"]),
        _north(counts["no heading"] / spokes),
        _scale(counts["other scale"] / spokes, counts["turns away"]),
    ]
    spoilt = counts["spoilt"] / max(counts["turns"] * sensor.shape[0], 1)
    found += [_clutter(held), _extent(sensor, start.extent), _interference(spoilt), _levels(start.levels)]
    found.append(spirals(counts["single"], counts["samples"]))
    found.append(
        Finding(
            "video.moving-radar", not (moved_m > still_m and fixed.any()), still_m, moved_m,
            f"The radar moved by {moved_m:.0f} m: what is fixed moves through its cells and is told from ships less "
            "well.", "Give --chart, so that land is known; look at slow tracks with care.", grave=False,
        )
    )  # fmt: skip
    if not charted:
        share = float(fixed.mean())
        found.append(
            Finding(
                "video.crowded", share < CROWDED, CROWDED, share,
                f"{100 * share:.0f} % of the cells return turn after turn: land, or a harbour. Ships that pass there "
                "are told from it by their motion alone.",
                "Give --chart, so that land is known.", grave=False,
            )
        )  # fmt: skip
    if registration is not None and registration.likeness > LIKE:
        found += _registered(registration, start)
    return tuple(found)


def _still_m(sensor: RadarVideo) -> float:
    return max(sensor.cell_m, FIXES_M)


def _registered(registration: Registration, start: VideoStart) -> list[Finding]:
    """Whether what is fixed begins where charted land does."""
    off, sd = registration.azimuth_deg, registration.azimuth_se_deg
    found = [
        Finding(
            "video.azimuth", abs(off) < max(WIDE_DEG, PART * start.sensor.beam_deg, SURE * sd), 0.0, off,
            f"What is fixed lies on charted land best if azimuths are turned by {off:.1f} degrees (error {sd:.1f}): "
            "north is not where the recording says, and ships near the coast are taken for land.",
            f"Give --azimuth-bias-deg {off:.1f}, added to what was given.",
        )
    ]  # fmt: skip
    if math.isfinite(registration.shift_se_m) and start.frame is not None:
        east, north = registration.shift_m
        away = math.hypot(east, north)
        lon, lat = start.frame.to_lonlat(np.array([registration.shift_m]))[0].tolist()
        found.append(
            Finding(
                "video.place", away < max(2 * _still_m(start.sensor), SURE * registration.shift_se_m), 0.0, away,
                f"What is fixed lies on charted land best if the radar stands {abs(east):.0f} m further "
                f"{'east' if east > 0 else 'west'} and {abs(north):.0f} m further {'north' if north > 0 else 'south'} "
                f"(error {registration.shift_se_m:.0f} m): its place, or the chart's, is off.",
                f"Give --radar-lon-deg {lon:.6f} --radar-lat-deg {lat:.6f}.",
            )
        )  # fmt: skip
    return found


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


def _turns(turns: int) -> Finding:
    return Finding(
        "video.turns", turns >= FEW_TURNS, FEW_TURNS, turns,
        f"The recording has {turns} turn{'s' * (turns != 1)}: too few to tell a faint ship from clutter, or what is "
        "fixed from a ship.",
        "Record longer.", grave=False,
    )  # fmt: skip


def _north(share: float) -> Finding:
    return Finding(
        "video.heading", share < 0.01, 0.0, share,
        f"{100 * share:.0f} % of the spokes count from the bow and have no heading: they are taken to look north where "
        "the bow looks.", "Record the heading (NMEA HDG, HDT) beside, or give --azimuth-bias-deg.",
    )  # fmt: skip


def _interference(share: float) -> Finding:
    return Finding(
        "video.interference", share < INTERFERED, 0.0, share,
        f"{100 * share:.1f} % of the azimuths were filled by another radar's pulses at all ranges and are taken as "
        "not received: ships there are seen less.", "Turn the radar's interference rejection on.", grave=share > 0.3,
    )  # fmt: skip


def _levels(levels: int) -> Finding:
    if levels == 1:
        return Finding(
            "video.levels", False, LEVELS, levels, "All samples of the first turn are the same: no echo was received.",
            "See whether the radar transmits, and whether its video was written.", grave=True,
        )  # fmt: skip
    return Finding(
        "video.levels", levels >= LEVELS, LEVELS, levels,
        f"Samples have {levels} levels: how strong an echo is, against its clutter, is cut off. Spots of clutter are "
        "tracked as ships, sure and wrong.", "Record the video before any threshold, in four bits or more.",
        grave=levels <= 2,
    )  # fmt: skip


def _scale(share: float, away: int) -> Finding:
    """Whether all spokes have the first one's range scale; ``away`` turns at the end did not."""
    name, remedy = "video.scale", "Record one range scale at a time, or start anew where it changes."
    if away >= CHANGED:
        return Finding(
            name, False, 0.0, share,
            f"The radar's range scale changed, and did not change back in {away} turns: nothing was tracked from then "
            "on.", remedy,
        )  # fmt: skip
    return Finding(
        name, share == 0, 0.0, share,
        f"{100 * share:.0f} % of the spokes have another range scale than the first and were left out.", remedy,
        grave=share > 0.5,
    )  # fmt: skip


def _extent(sensor: RadarVideo, extent: EchoExtent) -> Finding:
    """Whether echoes reach as far as was told; by which factor they do not, where it is worst."""
    told, shown = (2 * sensor.cell_m, sensor.beam_deg), (extent.pulse_m, extent.beam_deg)
    factors = [a / b if math.isfinite(b) else 1.0 for a, b in zip(told, shown, strict=True)]
    worst = max(factors, key=lambda factor: abs(math.log(factor)))
    return Finding(
        "video.extent", max(worst, 1 / worst) < OTHER_EXTENT, 1.0, worst,
        f"Echoes reach as far as a pulse of {shown[0]:.3g} m and a beam of {shown[1]:.2g} degrees make them; told were "
        f"{told[0]:.3g} m and {told[1]:.2g} degrees. Of finer cells one echo is many, which wander; in coarser ones "
        "faint ships drown.", "Leave --pulse-m and --beam-deg out, or give the radar's own.",
        grave=worst < 1,
    )  # fmt: skip


def _clutter(held: list[float]) -> Finding:
    known = [one for one in held if math.isfinite(one)]
    seen = float(np.median(known)) if known else math.nan
    return Finding(
        "video.clutter", not (len(known) >= FEW_TURNS and seen > SPIKY), 1.0, seen,
        f"New turns hold {seen:.1f} times as much strong clutter as what was learnt before lets expect: existence is "
        "told too high.", "Give a shorter --memory-turns, more --sectors or --bands.",
    )  # fmt: skip
