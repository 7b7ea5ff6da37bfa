"""Whether what stands still does so as a radar sails past it, or would if bearings, ranges or clocks were meant else.

Buoys, rocks and buildings seen from two places are echoes at the same place only where bearings, ranges and the radar's
own way are as told: with another north, unit or clock each is smeared as the radar goes on. No chart is needed. Of a
part of the way, plots of the first third are paired with those of the last that lie beside them, as told and as other
readings place them: a map is sharpest where it is right (Maddern, Harrison and Newman, 2012, Lost in translation (and
rotation)).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.registered import FACTORS

SCANS, MOST = 20, 1000  # of a part that can be judged, and plots of each of its thirds that are looked at
REACH, PARTS = 0.5, 3  # share of the greatest range that the radar sails in a part, and how many are looked at
NEAR = 2.0  # deviations of a plot's place within which two are of one echo
FEW, STAYS = 8, 0.2  # echoes that another reading must let stand, each in this share of the last third's scans
BETTER = 1.25  # times as many pairs: right recordings reach 1.01, echoes of islands 30 m wide 1.2
TURNS_DEG = (*np.arange(-10.0, 10.0, 0.5).tolist(), *np.arange(-180.0, 180.0, 1.0).tolist())
SHIFTS_M = np.arange(-500.0, 501.0, 25.0)
DELAYS_S = (-20.0, -10.0, -5.0, -2.0, -1.0, 1.0, 2.0, 5.0, 10.0, 20.0)


class _Plots(NamedTuple):
    """Plots of a third of a part, n of them."""

    range_m: Array  # (n,)
    bearing_rad: Array  # (n,)
    own: Array  # (n, 4) x, vx, y, vy of the radar [m, m/s]
    course_rad: Array  # (n,) of the radar


class _Reading(NamedTuple):
    """A way in which a recording may be meant."""

    what: str = ""
    remedy: str = ""
    turn_rad: float = 0.0  # that bearings lack
    sense: float = 1.0  # -1: bearings count the other way round
    courses: float = 0.0  # of the radar, that bearings lack
    times: float = 1.0  # as far
    more_m: float = 0.0  # farther
    later_s: float = 0.0  # the radar's own place is

    def places(self, plots: _Plots) -> Array:
        """Where plots lie then, ``(n, 2)`` [m]."""
        far = self.times * plots.range_m + self.more_m
        angle = self.sense * plots.bearing_rad + self.turn_rad + self.courses * plots.course_rad
        sight = far[:, None] * np.column_stack([np.sin(angle), np.cos(angle)])
        found: Array = plots.own[:, [0, 2]] + self.later_s * plots.own[:, [1, 3]] + sight
        return found


class _Part(NamedTuple):
    """Two thirds of a part of the way."""

    first: _Plots
    last: _Plots
    scans: float  # of the last third, by the share of its plots that are looked at
    near_m: float


def still_finding(scans: Sequence[RadarScan], range_sd_m: float, bearing_sd_rad: float) -> Finding:
    """Judge a recording of a radar that sails, by what stands still.

    Parameters
    ----------
    scans
        Of the whole way.
    range_sd_m, bearing_sd_rad
        How far plots err.
    """
    parts = list(_parts(scans, range_sd_m, bearing_sd_rad))
    best = _Reading()
    before = most = _pairs(parts, best)
    for one in _readings():
        if (pairs := _pairs(parts, one)) > most:
            best, most = one, pairs
    staying = _staying(parts, best) if most > BETTER * before else 0
    holds = staying < FEW
    return Finding(
        "radar.still", holds, BETTER, most / max(before, 1),
        f"{staying} echoes stay where they are, as the radar sails past them, if {best.what}; as told, they move: "
        "ships are drawn in wrong places, and what stands still is a ship under way."
        if not holds
        else "No other reading of bearings, ranges or clocks lets more stand still as the radar sails.",
        "" if holds else best.remedy,
    )  # fmt: skip


def _readings() -> Iterator[_Reading]:
    """Other ways in which bearings, ranges and the radar's own way may be meant; of equal ones the first is told."""
    for turn in sorted({one for one in TURNS_DEG if one}, key=abs):
        what = f"bearings are {abs(turn):g} degrees too {'small' if turn > 0 else 'large'}"
        yield _Reading(what, f"Add {turn:g} degrees to bearings or headings.", turn_rad=math.radians(turn))
    yield _Reading("bearings count anticlockwise", "Take the bearings from 360 degrees.", sense=-1.0)
    yield _Reading("bearings are from the bow", "Name the column relative_bearing_deg.", courses=1.0)
    yield _Reading("bearings are from north, not from the bow", "Name the column bearing_deg.", courses=-1.0)
    for name, times in FACTORS.items():
        yield _Reading(f"ranges are in {name}", "Convert range_m to metres.", times=times)
    for more in SHIFTS_M[SHIFTS_M != 0].tolist():
        what = f"ranges are {abs(more):g} m too {'short' if more > 0 else 'long'}"
        yield _Reading(what, f"Add {more:g} m to the ranges.", more_m=more)
    for delay in DELAYS_S:
        by = f"{abs(delay):g} s {'late' if delay > 0 else 'early'}"
        yield _Reading(f"the radar's own places are {by}", "Set clocks of log and plots alike.", later_s=delay)


def _parts(scans: Sequence[RadarScan], range_sd_m: float, bearing_sd_rad: float) -> Iterator[_Part]:
    """Cut the way into parts, and take some of them."""
    own = np.array([scan.own for scan in scans]).reshape(-1, 4)
    times = np.array([scan.time_s for scan in scans])
    if len(scans) < SCANS or not np.isfinite(own).all() or not np.ptp(times) > 0:
        return
    reach = REACH * max(float(scan.range_m.max(initial=0.0)) for scan in scans)
    gone = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(own[:, [0, 2]], axis=0).T))])
    count = max(1, math.ceil(gone[-1] / max(reach, 1.0)))
    course = np.unwrap(np.arctan2(own[:, 1], own[:, 3]))
    for number in np.unique(np.linspace(0, count - 1, PARTS).astype(np.int64)):
        within = np.flatnonzero((gone >= gone[-1] * number / count) & (gone <= gone[-1] * (number + 1) / count))
        if len(within) < SCANS:
            continue
        thirds = within[: len(within) // 3], within[-(len(within) // 3) :]
        (first, _), (last, share) = (_gathered(scans, own, course, third) for third in thirds)
        if len(first.range_m) and len(last.range_m):
            far = float(np.median(first.range_m))
            yield _Part(first, last, share * len(thirds[1]), NEAR * math.hypot(range_sd_m, bearing_sd_rad * far))


def _gathered(scans: Sequence[RadarScan], own: Array, course: Array, which: NDArray[np.intp]) -> tuple[_Plots, float]:
    """Gather plots of scans, not too many; return them and their share of all."""
    number = np.repeat(which, [scans[k].detections for k in which.tolist()])
    far = np.concatenate([scans[k].range_m for k in which.tolist()])
    bearing = np.concatenate([scans[k].bearing_rad for k in which.tolist()])
    taken = np.unique(np.linspace(0, len(far) - 1, min(MOST, len(far))).astype(np.int64))
    rows = number[taken]
    return _Plots(far[taken], bearing[taken], own[rows], course[rows]), len(taken) / max(len(far), 1)


def _pairs(parts: list[_Part], reading: _Reading) -> int:
    """Count plots of first thirds with plots of last ones near."""
    trees = ((cKDTree(reading.places(one.first)), cKDTree(reading.places(one.last)), one.near_m) for one in parts)
    return sum(int(first.count_neighbors(last, near)) for first, last, near in trees)


def _staying(parts: list[_Part], reading: _Reading) -> int:
    """Count places of first thirds at which last ones see something again and again."""
    count = 0
    for one in parts:
        places = reading.places(one.first)
        again = cKDTree(reading.places(one.last)).query_ball_point(places, one.near_m, return_length=True)
        stays = places[again >= max(STAYS * one.scans, 2)]
        count += len(np.unique(np.floor(stays / (4 * one.near_m)), axis=0))
    return count
