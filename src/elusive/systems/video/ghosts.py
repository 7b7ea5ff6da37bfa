"""Echoes of echoes among the tracks: what keeps to a stronger ship's bearing, or to its range, wherever that sails.

Between a strong ship and the radar's own a pulse goes to and fro twice: the second echo is on the ship's bearing at
twice its range. By way of a mast, a bridge or a quay it is at its range, or behind it, at an offset that stays (Bole,
Wall and Norris, 2014, Radar and ARPA manual, section 3.9). A ship of its own would have to sail so by chance. Behind a
ship that comes or goes straight one in its company sails so, too: an echo of its echo is as strong as that is, turn by
turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.tracking.track import Track

KEPT, FEWEST = 12, 6  # turns by which two ways are held against each other: at most, and at least
WEAKER = math.log(4.0)  # than what it is an echo of, at least: in the logarithm of power
LIKE_BEAMS, LIKE_CELLS = 0.5, 1.5  # by which a ghost strays from where it would be, root mean square
SAILED_BEAMS, SAILED_CELLS = 2.0, 6.0  # that a ship has gone, from which chance is no explanation
STEADY_CELLS = 0.5  # by which one behind a ship that comes or goes straight strays, so that it is as fast
ALIKE = 0.7  # correlation of their powers from turn to turn: of 12 turns of two ships it is more once in 170
IN_COMPANY = 0.5  # probability that what keeps to a ship so is one in its company: as likely as not


class Ghosts(NamedTuple):
    """What is known of tracks as echoes of each other."""

    ways: dict[int, tuple[tuple[float, float, float], ...]]  # of each track: range, azimuth, power over the sea's
    found: frozenset[int]  # tracks that are an echo of another


def ghosts_after(before: Ghosts | None, tracks: Sequence[Track], turn: EvidenceTurn, sensor: RadarVideo) -> Ghosts:
    """Return what is known after a turn, by where its confirmed tracks are and how strong it is there."""
    old, found = before or Ghosts({}, frozenset()), set[int]()
    ways = dict[int, tuple[tuple[float, float, float], ...]]()
    for track in tracks:
        if track.status == "deleted":
            continue
        if track.track in old.found:
            found.add(track.track)
        if track.status == "confirmed":
            place = track.mean[None, [X, Y]]
            ((x, y),) = place - turn.seen_from(place)
            here = float(math.hypot(x, y)), math.atan2(x, y), _strength(place, turn, sensor)
            ways[track.track] = (*old.ways.get(track.track, ()), here)[-KEPT:]
    held = {number: np.array(way) for number, way in ways.items() if len(way) >= FEWEST}
    power = {number: float(way[:, 2].mean()) for number, way in held.items()}
    for other, way in held.items():
        if other not in found and any(
            _is_echo(way, strong, sensor)
            for ship, strong in held.items()
            if ship not in found and power[ship] - power[other] > WEAKER
        ):
            found.add(other)
    return Ghosts(ways, frozenset(found))


def without_ghosts(tracks: Sequence[Track], ghosts: Ghosts) -> tuple[Track, ...]:
    """Return tracks, of which those that may be another's echo exist less surely, and are candidates at most."""
    return tuple(
        track._replace(
            status="candidate" if track.status == "confirmed" else track.status, existence=IN_COMPANY * track.existence
        )
        if track.track in ghosts.found
        else track
        for track in tracks
    )


def told_of(ghosts: int) -> Finding:
    """Whether any track was an echo of another's."""
    return Finding(
        "video.ghosts", ghosts == 0, 0.0, ghosts,
        f"{ghosts} track{'s' * (ghosts != 1)} kept to the bearing or the range of a stronger ship, as an echo of its "
        "echo does: told as candidates once that shows, be one a ship in company.",
        "Look at the report for ships that sail in company.", grave=False,
    )  # fmt: skip


def _is_echo(way: Array, ship: Array, sensor: RadarVideo) -> bool:
    """Whether one way ``(n, 3)`` is that of an echo of a ship's ``(m, 3)``, both up to the same turn."""
    n = min(len(way), len(ship))
    (far, towards, powers), (near, bearing, strong) = way[-n:].T, ship[-n:].T
    beam, cell = math.radians(sensor.beam_deg), sensor.cell_m
    aside, bearing = np.unwrap(towards - bearing), np.unwrap(bearing)
    in_line = _rms((aside + math.pi) % (2 * math.pi) - math.pi) < LIKE_BEAMS * beam
    sailed = np.ptp(near) > SAILED_CELLS * cell, np.ptp(bearing) > SAILED_BEAMS * beam
    twice = in_line and any(sailed) and _rms(far - 2 * near) < 2 * LIKE_CELLS * cell
    strays = float(np.std(far - near)) / cell
    across = sailed[1] and strays < LIKE_CELLS
    straight = sailed[0] and n == KEPT and strays < STEADY_CELLS and _correlation(powers, strong) > ALIKE
    behind = in_line and far.mean() > near.mean() and (across or straight)
    beside = (
        not in_line and sailed[0] and _rms(far - near) < LIKE_CELLS * cell and float(np.std(aside)) < LIKE_BEAMS * beam
    )
    return bool(twice or behind or beside)


def _correlation(first: Array, second: Array) -> float:
    first, second = first - first.mean(), second - second.mean()
    size = math.sqrt(float((first @ first) * (second @ second)))
    return float(first @ second) / size if size > 0 else 0.0


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _strength(place: Array, turn: EvidenceTurn, sensor: RadarVideo) -> float:
    """Logarithm of the greatest power about a place ``(1, 2)``, over what is expected of the sea."""
    (row,), (column,) = sensor.cells(place, turn)
    near = np.arange(-1, 2)
    columns = np.clip(column + near, 0, sensor.shape[1] - 1)
    return float(np.nanmax(turn.over_sea((row + near)[:, None] % sensor.shape[0], columns), initial=0.0))
