"""Parts of one long ship among the tracks: between them its echo goes on, where between two ships the sea would show.

A tracker of points follows several places of a long ship. On the line between two tracks power is remembered in their
own frame, wherever they sail. Where it nowhere sinks to the sea's they are one ship, told by the earliest number that
any part of it has had.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from elusive.contracts import VX, VY, Array, X, Y
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.systems.video.echoes import LONGEST_M, OVER_SEA
from elusive.tracking.track import Track

PLACE, VELOCITY = [X, Y], [VX, VY]
BETWEEN = np.linspace(0, 1, 11)[:, None]  # of the way from one track to another, where power is looked at
ABOUT = [(down, right) for down in (-1, 0, 1) for right in (-1, 0, 1)]  # a track's cell, where its echo is strongest
APART = 4.5  # cells or rows between two tracks, from which two echoes would leave the sea between them
LATEST = 0.85  # share of what is remembered of it that counts a turn later
FEWEST = 3  # turns after which it is believed
OF_ENDS = 0.5  # of the least between, to the fainter of both: of the logarithms over the sea's, as receivers differ
PARTED = 0.5  # of all that, below which parts are two ships again


class Hulls(NamedTuple):
    """What is known of tracks as parts of one ship."""

    between: dict[tuple[int, int], tuple[int, Array]]  # of two: turns, and logarithm of power over the sea's, there
    ships: dict[int, int]  # of a track that is a part: the number it is told by
    joined: frozenset[int]  # tracks that have become a part this turn


def hulls_after(
    before: Hulls | None, tracks: Sequence[Track], turn: EvidenceTurn, sensor: RadarVideo, deviation: float
) -> Hulls:
    """Return what is known after a turn; ``deviation`` is the sea's."""
    old = before or Hulls({}, {}, frozenset())
    alive = {track.track: track for track in tracks if track.status != "deleted"}
    between = {pair: kept for pair, kept in old.between.items() if set(pair) <= alive.keys()}
    for one, other in combinations(alive.values(), 2):
        pair = one.track, other.track
        if "confirmed" not in (one.status, other.status):
            continue
        if math.dist(one.mean[PLACE], other.mean[PLACE]) > LONGEST_M:
            between.pop(pair, None)
        elif (line := _line(one, other, turn, sensor)) is not None:
            turns, kept = between.get(pair, (0, line))
            between[pair] = turns + 1, kept + max(1 / (turns + 1), 1 - LATEST) * (line - kept)
    told = {number: old.ships.get(number, number) for number in alive}
    least = OVER_SEA * deviation
    one_ship = [
        pair
        for pair, (turns, line) in between.items()
        if _goes_on(line, turns, least, together=told[pair[0]] == told[pair[1]])
    ]
    ended = {one.track: old.ships[one.track] for one in tracks if one.track not in alive and one.track in old.ships}
    ships = _named(told, one_ship) | ended  # a part that ends is not a ship's end
    return Hulls(between, ships, frozenset(ships.keys() - old.ships.keys()))


def as_ships(tracks: Sequence[Track], hulls: Hulls) -> tuple[Track, ...]:
    """Return tracks, each ship once: by the surest of its parts, with the number that it is told by."""
    parts = dict[int, list[Track]]()
    for track in tracks:
        parts.setdefault(hulls.ships.get(track.track, track.track), []).append(track)
    ships = [
        max(some, key=lambda part: (part.status == "confirmed", part.existence))._replace(track=number)
        for number, some in parts.items()
    ]
    ended = [
        track._replace(status="deleted", existence=0.0)
        for track in tracks
        if track.track in hulls.joined and track.status != "deleted"
    ]
    return tuple(sorted(ships + ended, key=lambda track: track.track))


def _named(told: dict[int, int], pairs: Iterable[tuple[int, int]]) -> dict[int, int]:
    """Return the number that each part is told by, of tracks' numbers so far and pairs that are one ship."""
    groups = {number: {number} for number in told}
    for one, other in pairs:
        both = groups[one] | groups[other]
        groups |= dict.fromkeys(both, both)
    named = dict[int, int]()
    for group in (group for number, group in sorted(groups.items()) if number == min(group)):
        name = min(told[part] for part in group)
        name = min(group) if name in named.values() else name  # they have parted
        named |= dict.fromkeys(group, name)
    return {number: name for number, name in named.items() if number != name}


def _goes_on(line: Array, turns: int, least: float, *, together: bool) -> bool:
    """Whether an echo goes on from end to end; that of one ship so far, unless it clearly does not."""
    if turns < FEWEST:
        return together
    asked = max(least, OF_ENDS * min(float(line[0]), float(line[-1])))
    return float(line[1:-1].min()) > (PARTED if together else 1.0) * asked


def _line(one: Track, other: Track, turn: EvidenceTurn, sensor: RadarVideo) -> Array | None:
    """Logarithm of power over the sea's on the way from one track to another; None if they are near each other."""
    (first, step, pitch), (rows, columns) = sensor.grid, sensor.shape
    mean = np.array([one.mean, other.mean])
    passed = turn.time_s - sensor.arrival_s(mean[:, PLACE], turn)
    ends = mean[:, PLACE] - passed[:, None] * mean[:, VELOCITY]
    line = ends[0] + BETWEEN * (ends[1] - ends[0])
    off = line - turn.seen_from(line)
    row, column = np.unwrap(np.arctan2(*off.T)) / pitch - 1, (np.hypot(*off.T) - first) / step
    near = math.hypot(row[-1] - row[0], column[-1] - column[0]) < APART
    row, column = np.round(row).astype(np.int64), np.round(column).astype(np.int64)
    if near or column.min() < 1 or column.max() > columns - 2:
        return None
    power = turn.over_sea(row % rows, column)
    for end in (0, -1):
        power[end] = max(float(turn.over_sea((row[end] + down) % rows, column[end] + right)) for down, right in ABOUT)
    return power if np.isfinite(power).all() else None
