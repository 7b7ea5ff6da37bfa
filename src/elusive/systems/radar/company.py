"""What tracks say of each other: that one begins where another has ended, that many go alike, that one copies another.

Each alone may be a ship. Together they are the marks of a recording that is not what it is taken for: of ships that
are lost again and again, of a radar that moves and does not say so, of drifting rain, of two radars in one file, of
echoes that come by a second way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.systems.radar.report import RadarPath

FEW, OFTEN = 3, 0.25  # tracks that begin where another has just ended, and their share of all
SCANS, REACH_M = 10, 250.0  # in which it has, and how far from it, beside what it sailed since
MANY, MOST = 8, 0.5  # tracks of one velocity, and their share of those of a time
ERRORS, ALIKE_MPS, SLOW_MPS = 3.0, 0.5, 1.0  # deviations and speeds within which velocities are one, or none
WIDE_M = 200.0  # deviation of their places across, from which they sail in no line
OVERLAP, SAILED = 15, 10.0  # scans of two tracks together, and times what they may differ by that they go
LONGEST = 40  # tracks that are compared
COPIES, APART_MPS = 2, 1.0  # that are copied in one way, and by how much their velocities differ
AWAY_M, TURN_RAD, SHIFT_M = 100.0, math.radians(1.0), 60.0  # of a copy, and within which ways are one


class _Copy(NamedTuple):
    """A track that goes as another does."""

    how: str
    by: Array  # (2,) how far away, or turned [m, or rad]
    velocity: Array  # (2,) of the track that is copied [m/s]
    source: int
    track: int


def company_findings(paths: Sequence[RadarPath], times_s: Array, radar: Array | None) -> tuple[Finding, ...]:
    """Judge the tracks of a recording.

    Parameters
    ----------
    paths
        That were confirmed.
    times_s
        Of the scans, ``(T,)``.
    radar
        Its place, ``(2,)`` [m]; None: it moves.
    """
    found = _again(paths, times_s), _alike(paths)
    return found if radar is None else (*found, _copied(paths, radar))


def _again(paths: Sequence[RadarPath], times_s: Array) -> Finding:
    """Count tracks that begin where another has ended, or is about to."""
    anew, usual_s = 0, float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0
    for path in paths:
        number = np.searchsorted(times_s, path.times_s[0])
        for other in paths:
            end = np.searchsorted(times_s, other.times_s[-1])
            if other is path or other.times_s[0] >= path.times_s[0] or end >= len(times_s) - 1:
                continue
            if abs(int(number) - int(end)) > SCANS:
                continue
            last = min(int(np.searchsorted(other.times_s, path.times_s[0])), len(other.times_s) - 1)
            if other.spread[last] > REACH_M:  # it is anywhere
                continue
            gone_s = max(float(path.times_s[0] - other.times_s[last]), 0.0)
            if gone_s > SCANS * usual_s:  # nobody looked
                continue
            reach = REACH_M + gone_s * float(np.hypot(*other.velocity[last]))
            if np.hypot(*(path.places[0] - other.places[last])) < reach:
                anew += 1
                break
    share = anew / max(len(paths), 1)
    return Finding(
        "radar.again", not (anew >= FEW and share > OFTEN), 0.0, share,
        f"{anew} of {len(paths)} tracks begin where another ends: ships are lost and begun anew, as those are that "
        "turn harder than the motion allows, or whose plots are not as they were told.",
        "Tell a larger --q where ships turn hard; look at the other findings.", grave=False,
    )  # fmt: skip


def _alike(paths: Sequence[RadarPath]) -> Finding:
    """Look for many that go at one velocity, side by side."""
    count = of = 0
    said = ""
    for time_s in np.unique(np.concatenate([np.zeros(0), *(path.times_s[[len(path.times_s) // 2]] for path in paths)])):
        there = [path for path in paths if path.times_s[0] <= time_s <= path.times_s[-1]]
        if len(there) < MANY:
            continue
        middle = [int(np.searchsorted(path.times_s, time_s)) for path in there]
        around = zip(there, middle, strict=True)
        velocity = np.array([np.median(path.velocity[max(k - 5, 0) : k + 6], axis=0) for path, k in around])
        near = np.hypot(*(velocity[:, None] - velocity).transpose(2, 0, 1)) < ALIKE_MPS
        best = near[near.sum(axis=1).argmax()]
        mean = velocity[best].mean(axis=0)
        places = np.array([path.places[k] for path, k in zip(there, middle, strict=True)])[best]
        across = math.sqrt(max(float(np.linalg.eigvalsh(np.cov(places.T))[0]), 0.0)) if best.sum() > 2 else 0.0
        enough = best.sum() >= MANY and best.sum() > MOST * len(there)
        if enough and np.hypot(*mean) > SLOW_MPS and across > WIDE_M and best.sum() > count:
            count, of = int(best.sum()), len(there)
            said = f"{np.hypot(*mean):.1f} m/s towards {math.degrees(math.atan2(*mean)) % 360:.0f} degrees"
    return Finding(
        "radar.alike", not count, 0.0, float(count),
        f"{count} of {of} tracks go at one velocity side by side, {said}: so does what stands still past a radar that "
        "moves and does not say so, and rain that drifts. Such tracks are no ships under way, unless they sail in "
        "company.",
        "Tell the radar's own way (own_x_m, own_y_m or --own-ship); leave out rain.",
    )  # fmt: skip


def _copied(paths: Sequence[RadarPath], radar: Array) -> Finding:
    """Look for tracks that go as others do, elsewhere."""
    longest = sorted(paths, key=lambda path: -int(path.confirmed.sum()))[:LONGEST]
    copies = [one for pair in permutations(longest, 2) for one in _ways(*pair, radar)]
    tracks = set[int]()
    best: _Copy | None = None
    for one in copies:
        same = [two for two in copies if two.how == one.how and _alike_ways(one, two)]
        differ = max(float(np.hypot(*(two.velocity - one.velocity))) for two in same) > APART_MPS
        lobes = one.how == "turned" and sum(two.source == one.source for two in same) >= COPIES
        if (one.how == "twice" or differ or lobes) and len(names := {two.track for two in same}) > len(tracks):
            best, tracks = one, names
    what, remedy = _said(best)
    return Finding(
        "radar.copies", best is None, 0.0, float(len(tracks)),
        f"Tracks {', '.join(map(str, sorted(tracks)))} go as others do, {what}.", remedy,
    )  # fmt: skip


def _alike_ways(one: _Copy, other: _Copy) -> bool:
    """Whether two copies are made in one way; side lobes of a ship lie to either side of it."""
    room = {"shifted": SHIFT_M, "turned": TURN_RAD, "mirrored": TURN_RAD, "twice": math.inf}[one.how]
    lobes = one.how == "turned" and one.source == other.source
    return lobes or float(np.hypot(*(one.by - other.by))) < room


def _said(copy: _Copy | None) -> tuple[str, str]:
    if copy is None:
        return "", ""
    if copy.how == "twice":
        return (
            "at their bearing and twice their range: echoes that went to and fro between ship and radar twice, and no "
            "ship is there"
        ), "Leave out what is seen at twice the range of a ship."
    if copy.how == "turned":
        return (
            f"at their range, turned by {abs(math.degrees(copy.by[0])):.0f} degrees: a second antenna with another "
            "north, or side lobes; one of the two is no ship"
        ), "Track each antenna's plots by themselves; raise the radar's threshold against side lobes."
    if copy.how == "mirrored":
        return (
            f"at their range and all at a bearing of {math.degrees(copy.by[0]) % 360:.0f} degrees: echoes by way of "
            "something there that reflects, and no ship is there"
        ), "Leave out that bearing; look for a mast or a wall in the antenna's way."
    return (
        f"{np.hypot(*copy.by):.0f} m away: plots of two radars are in one file, and places of one of them are taken "
        "from the other"
    ), "Track each radar's plots by themselves, or give places (x_m, y_m or lon_deg, lat_deg) instead of ranges."


def _ways(path: RadarPath, other: RadarPath, radar: Array) -> list[_Copy]:
    """How the other copies a track, if it does."""
    _, mine, its = np.intersect1d(path.times_s, other.times_s, return_indices=True)
    known = np.maximum(path.spread[mine], other.spread[its]) < SHIFT_M
    mine, its = mine[known], its[known]
    if len(mine) < OVERLAP:
        return []
    one, two = path.places[mine] - radar, other.places[its] - radar
    spread = math.hypot(float(np.median(path.spread[mine])), float(np.median(other.spread[its])))
    room = min(ERRORS * spread, SHIFT_M)
    velocity = np.median(path.velocity[mine], axis=0)
    ways = list[_Copy]()

    def fits(where: Array, gone: float) -> bool:
        """Whether the other is there, within less than what both have gone."""
        off = float(np.sqrt(np.mean(((where - two) ** 2).sum(axis=1))))
        return off < room and gone > SAILED * off

    shift = np.median(two - one, axis=0)
    if np.hypot(*shift) < AWAY_M:
        return []
    sailed = float(np.hypot(*(one[-1] - one[0])))
    if fits(one + shift, sailed):
        ways.append(_Copy("shifted", shift, velocity, path.track, other.track))
    far = np.hypot(*one.T)
    turn = np.angle(np.mean((two[:, 1] + 1j * two[:, 0]) / (one[:, 1] + 1j * one[:, 0])))
    turned = far * np.exp(1j * (np.arctan2(one[:, 0], one[:, 1]) + turn))
    nears = float(np.ptp(far))
    if fits(np.column_stack([turned.imag, turned.real]), nears):
        ways.append(_Copy("turned", np.array([turn, 0.0]), velocity, path.track, other.track))
    if fits(2 * one, sailed):
        ways.append(_Copy("twice", np.zeros(2), velocity, path.track, other.track))
    sight = two.mean(axis=0) / np.hypot(*two.mean(axis=0))
    mirrored = (far + np.median(two @ sight - far))[:, None] * sight
    passes = np.ptp(np.unwrap(np.arctan2(one[:, 0], one[:, 1]))) > TURN_RAD
    if passes and fits(mirrored, nears):
        ways.append(_Copy("mirrored", np.array([math.atan2(*sight), 0.0]), velocity, path.track, other.track))
    return ways
