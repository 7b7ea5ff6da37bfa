"""What tracks say of each other: that one begins where another has ended, that many go alike, that some are brief.

Each alone may be a ship. Together they are the marks of a recording that is not what it is taken for: of ships that
are lost again and again, of a radar that moves and does not say so, of drifting rain, of birds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.systems.radar.report import RadarPath

FEW, OFTEN = 3, 0.25  # tracks that begin where another has just ended, and their share of all
SCANS, REACH_M = 10, 250.0  # in which it has, and how far from it, beside what it sailed since
MANY, MOST = 8, 0.5  # tracks of one velocity, and their share of those of a time
ALIKE_MPS, SLOW_MPS = 0.5, 1.0  # speeds within which velocities are one, or none
ALONG = 20  # scans before and after a time, in which a velocity is known to some tenths of a metre a second
WIDE_M = 200.0  # deviation of their places across, from which they sail in no line
LONG, MIDST = 40, 0.7  # scans of tracks that last, and share of their farthest range, up to which ships do not end
SELDOM = 0.1  # share of the tracks, up to which some that are brief are boats


def company_findings(paths: Sequence[RadarPath], times_s: Array, way: Array) -> tuple[Finding, ...]:
    """Judge the tracks of a recording.

    Parameters
    ----------
    paths
        That were confirmed.
    times_s
        Of the scans, ``(T,)``.
    way
        Times and places of the radar, ``(S, 3)`` [s, m].
    """
    return _again(paths, times_s), _alike(paths), _brief(paths, times_s, way)


def _brief(paths: Sequence[RadarPath], times_s: Array, way: Array) -> Finding:
    """Count tracks that come and go where others are followed farther away."""

    def ranges(path: RadarPath) -> Array:
        radar = np.column_stack([np.interp(path.times_s, way[:, 0], way[:, k]) for k in (1, 2)])
        return np.asarray(np.hypot(*(path.places - radar)[path.confirmed].T))

    midst_m = MIDST * max((float(ranges(path).max()) for path in paths if path.confirmed.sum() >= LONG), default=0.0)
    usual_s, found = _usual_s(times_s), list[int]()
    for path in paths:
        its_ranges = ranges(path)
        begins, gone = np.searchsorted(times_s, path.times_s[[0, -1]])
        if begins < SCANS or gone >= len(times_s) - SCANS or max(its_ranges[0], its_ranges[-1]) > midst_m:
            continue
        if not any(_follows(*two, times_s, usual_s) for its in paths for two in ((its, path), (path, its))):
            found.append(path.track)
    names = ", ".join(map(str, sorted(found)))
    return Finding(
        "radar.brief", len(found) < max(FEW, SELDOM * len(paths)), 0.0, float(len(found)),
        f"Tracks {names}, of {len(paths)}, come and go in the midst of what the radar sees, where ships do not: birds, "
        "rain, groups of waves or wakes do, and boats that start from a ship, or a coast that is not seen."
        if found
        else "Tracks begin and end where the radar begins to see ships, or go on as others.",
        "Look at these tracks; turn the radar's sea or rain clutter control up.", grave=False,
    )  # fmt: skip


def _again(paths: Sequence[RadarPath], times_s: Array) -> Finding:
    """Count tracks that begin where another has ended, or is about to."""
    usual_s = _usual_s(times_s)
    anew = sum(any(_follows(path, other, times_s, usual_s) for other in paths) for path in paths)
    share = anew / max(len(paths), 1)
    return Finding(
        "radar.again", not (anew >= FEW and share > OFTEN), 0.0, share,
        f"{anew} of {len(paths)} tracks begin where another ends: ships are lost and begun anew, as those are that "
        "turn harder than the motion allows, or whose plots are not as they were told.",
        "Tell a larger --q where ships turn hard; look at the other findings.", grave=False,
    )  # fmt: skip


def _usual_s(times_s: Array) -> float:
    return float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0


def _follows(path: RadarPath, other: RadarPath, times_s: Array, usual_s: float) -> bool:
    """Whether a track begins where another ends."""
    number, end = np.searchsorted(times_s, [path.times_s[0], other.times_s[-1]])
    if other is path or other.times_s[0] >= path.times_s[0] or end >= len(times_s) - 1:
        return False
    last = min(int(np.searchsorted(other.times_s, path.times_s[0])), len(other.times_s) - 1)
    if abs(int(number) - int(end)) > SCANS or other.spread[last] > REACH_M:  # it is anywhere
        return False
    gone_s = max(float(path.times_s[0] - other.times_s[last]), 0.0)
    if gone_s > SCANS * usual_s:  # nobody looked
        return False
    reach = REACH_M + gone_s * float(np.hypot(*other.velocity[last]))
    return bool(np.hypot(*(path.places[0] - other.places[last])) < reach)


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
        velocity = np.array([np.median(path.velocity[max(k - ALONG, 0) : k + ALONG + 1], axis=0) for path, k in around])
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
