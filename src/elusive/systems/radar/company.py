"""What tracks say of each other: that one begins where another has ended, that many go alike.

Each alone may be a ship. Together they are the marks of a recording that is not what it is taken for: of ships that
are lost again and again, of a radar that moves and does not say so, of drifting rain.
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
WIDE_M = 200.0  # deviation of their places across, from which they sail in no line


def company_findings(paths: Sequence[RadarPath], times_s: Array) -> tuple[Finding, ...]:
    """Judge the tracks of a recording.

    Parameters
    ----------
    paths
        That were confirmed.
    times_s
        Of the scans, ``(T,)``.
    """
    return _again(paths, times_s), _alike(paths)


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
