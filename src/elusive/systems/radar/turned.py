"""Whether a radar's whole picture turns from scan to scan, as bearings do that are from a bow that swings.

Two signs, both of plots alone. The middle of three plots of a target lies beside the others by its own error
(:mod:`elusive.systems.radar.triples`), and errors of different targets of a scan are independent: their products are
zero in the mean, but for what turns all of the scan, whose variance they are (Fisher, 1925, Statistical methods for
research workers, section 40: intraclass correlation). A larger turn leaves no triples: the scan then fits the one
before if that is turned, and hardly as it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import pdtrc

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.report.clock import moment
from elusive.sensors.own_track import FASTEST_MPS
from elusive.sensors.radar_scans import RadarScan

FEW_PAIRS = 100  # of plots of a scan, from which something is said
CLEAR, ALIKE = 4.0, 0.3  # deviations beyond chance; of the plots' own deviation, from which what is alike counts
OVERLAP = 1 + 2 * (0.444 + 0.028)  # of products of triples one and two scans apart, which share plots
HALF, CLIPPED = 0.67449, 3.0  # deviations within which half of a Gaussian's errors lie; a stray counts as so many
LEAST = 0.3  # of their root mean square, where rounded bearings leave most errors zero
ROOM_M = 60.0  # of a range from one scan to the next, beside what a target sails
NEAR_DEG = 2  # turns that are one turn: targets move on, too
FEW, SELDOM, HARDLY = 4, 1e-6, 0.3  # plots that fit if turned; how seldom so many would; share of these as it is
MOST = 100  # plots of a scan that are looked at
SPOKE, ACROSS = 8, 0.5  # plots of one bearing, and the share of the farthest range across which they lie


class Together(NamedTuple):
    """What bearings of one scan have in common."""

    sd_rad: float = 0.0  # deviation of what is common to a scan's plots
    own_rad: float = 0.0  # and of what is each plot's own
    clear: float = 0.0  # how far beyond none, in deviations of what chance makes


class Turn(NamedTuple):
    """A scan that fits the one before if that is turned."""

    time_s: float
    turn_deg: float


def common_of(numbers: Array, errors: Array) -> Together:
    """Tell what errors ``(n,)`` [rad] of plots of different targets have in common, by their scans ``(n,)``."""
    _, group, counts = np.unique(numbers, return_inverse=True, return_counts=True)
    pairs = int((counts * (counts - 1)).sum())
    if pairs < FEW_PAIRS or not errors.any():
        return Together()
    size = max(float(np.median(np.abs(errors))) / HALF, LEAST * float(np.sqrt(np.mean(errors**2))), 1e-9)
    clipped = np.clip(errors / size, -CLIPPED, CLIPPED)
    products = float((np.bincount(group, clipped) ** 2 - np.bincount(group, clipped**2)).sum())
    square = float((clipped**2).mean())
    common = max(products / pairs, 0.0)
    clear = products / (square * math.sqrt(2 * OVERLAP * pairs))
    return Together(size * math.sqrt(common), size * math.sqrt(max(square - common, 0.0)), clear)


class Turned(NamedTuple):
    """Scans that fit the one before if that is turned, of how many."""

    turns: tuple[Turn, ...] = ()
    scans: int = 0


class Turns:
    """Compares each scan with the one before."""

    def __init__(self) -> None:
        self._before: RadarScan | None = None
        self._scans = 0
        self._turns: list[Turn] = []

    @property
    def turned(self) -> Turned:
        """What was found."""
        return Turned(tuple(self._turns), self._scans)

    def add(self, scan: RadarScan) -> None:
        """Take a scan in, of the order of time."""
        before, self._before = self._before, scan
        self._scans += 1
        if before is None or min(before.detections, scan.detections) < FEW:
            return
        (far, angle), (far_before, angle_before) = (_some(one) for one in (scan, before))
        if min(len(far), len(far_before)) < FEW:
            return
        room = ROOM_M + FASTEST_MPS * (scan.time_s - before.time_s)
        now, then = np.nonzero(np.abs(far[:, None] - far_before) < room)
        degrees = np.floor(np.degrees(angle[now] - angle_before[then])).astype(np.int64) % 360
        hit = np.zeros((len(far), 360), dtype=bool)
        hit[now, degrees] = True
        wide = np.any([np.roll(hit, k, axis=1) for k in range(-NEAR_DEG, NEAR_DEG + 1)], axis=0)
        fitting = wide.sum(axis=0)
        most, as_it_is = int(fitting.max()), int(max(fitting[0], fitting[-1]))
        chance = float(pdtrc(most - 1, fitting.mean()))
        if most >= FEW and chance < SELDOM and as_it_is <= HARDLY * most:
            best = np.exp(1j * np.radians(np.flatnonzero(fitting == most) + 0.5)).mean()
            self._turns.append(Turn(scan.time_s, math.degrees(float(np.angle(best)))))


def turned_finding(together: Together, turned: Turned) -> Finding:
    """Say whether the picture turns, by how much, and when."""
    shakes = together.clear > CLEAR and together.sd_rad > ALIKE * together.own_rad
    times = turned.turns
    if times:
        first = times[0]
        way = "to the right" if first.turn_deg > 0 else "to the left"
        scans = "one scan" if len(times) == 1 else f"{len(times)} of {turned.scans} scans"
        seen = abs(first.turn_deg)
        what = (
            f"In {scans} all bearings are turned together against the scan before, first at {moment(first.time_s)}, by "
            f"{seen:.0f} degrees {way}"
        )
    else:
        seen = math.degrees(together.sd_rad)
        what = (
            f"Bearings of a scan err together, by {1000 * together.sd_rad:.2g} mrad beside "
            f"{1000 * together.own_rad:.2g} mrad of each alone"
        )
    return Finding(
        "radar.turned", not (times or shakes), 0.0, seen,
        f"{what}: the whole picture turns, as if bearings were from a bow that swings, or headings were late, rounded "
        "or set anew. Tracks turn with it: ships are lost and begun anew, or are where none is.",
        "Give the heading of each scan (relative_bearing_deg, heading_deg), or bearings from true north.",
    )  # fmt: skip


def without_spoke(scan: RadarScan) -> RadarScan:
    """Return a scan without plots of one bearing and many ranges: another radar's pulses, which go round."""
    far, degrees = scan.range_m, np.degrees(scan.bearing_rad).astype(np.int64) % 360
    each = np.bincount(degrees, minlength=360)
    along = np.sum([np.roll(each, k) for k in range(-NEAR_DEG, NEAR_DEG + 1)], axis=0)
    spoke = np.abs((degrees - along.argmax() + 180) % 360 - 180) <= NEAR_DEG
    if spoke.sum() < SPOKE or np.ptp(far[spoke]) < ACROSS * far.max():
        return scan
    return scan.select_detections(np.flatnonzero(~spoke))


def _some(scan: RadarScan) -> tuple[Array, Array]:
    """Ranges and bearings of a scan, not too many."""
    scan = without_spoke(scan)
    taken = np.unique(np.linspace(0, scan.detections - 1, min(MOST, scan.detections)).astype(np.int64))
    return scan.range_m[taken], scan.bearing_rad[taken]
