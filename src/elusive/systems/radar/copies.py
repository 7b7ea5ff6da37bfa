"""Whether a track is a second echo of another's ship: a side lobe, by way of a mast, to and fro, by another radar.

A copy lies at its original's place, moved in one way, but for the errors of plots: what is left between the two is
white (von Neumann, 1941, Distribution of the ratio of the mean square successive difference to the variance) and no
greater than errors are. Ships in company drift about each other, and where they do not, their errors are independent:
the second differences of their plots (:mod:`elusive.systems.radar.triples`) are not correlated. So a copy is told by
errors that it shares with its original, by following the bends of its range as that passes, which no ship in company
does at another bearing, or by several that are moved in one way while their originals go differently.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Mapping, Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.contracts import VX, VY, Array
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.radar_view import wrapped
from elusive.tracking.detection_targets import Target

LONGEST, SCANS = 40, 15  # tracks that are compared, and scans that show both
ERRORS = 3.0  # standard errors beyond which chance does not reach
SAILED, AWAY_M = 10.0, 100.0  # times the errors of plots that copies go; how far away they are
TURNED_RAD = math.radians(1.0)  # of a ship whose bearing its copy does not follow
SEVERAL, DIFFER_MPS = 2, 1.0  # that are moved in one way, and by how much the velocities of their originals differ
CLEAR, ALIKE = 4.0, 0.3  # deviations of chance, and the correlation, from which errors are shared
WIDER = 4.0  # times a bearing's error, that the bearing of a weak echo by a side lobe from its ship's may have
BENT = 1.5  # times a range's variance, beyond which ranges bend
LOBES_RAD = math.radians(45)  # to each side of a ship, within which echoes by side lobes lie
HALF, CLIPPED = 0.67449, 3.0  # deviations within which half of a Gaussian's errors lie; a stray counts as so many
OVERLAP = 1 + 2 * (0.444 + 0.028)  # of products of second differences one and two scans apart, which share plots
NEAR = 4.0  # times the least interval, in which second differences are taken


class Sightings:
    """Keeps where plots of tracks lie, moved to their scans' times."""

    def __init__(self) -> None:
        self._rows: dict[int, array[float]] = {}

    def add(self, scan: RadarScan, targets: Iterable[Target], sensor: RadarSensor) -> None:
        """Take in a scan, and the confirmed targets after it."""
        seen = [target for target in targets if target.detection >= 0]
        plots = scan.select_detections(np.array([target.detection for target in seen], dtype=np.int64))
        places = sensor.places(plots)[0] - np.array([scan.own.x_m, scan.own.y_m])
        for target, place, later in zip(seen, places, plots.times_s - scan.time_s, strict=True):
            at = place - later * target.mean[[VX, VY]]
            self._rows.setdefault(target.life.track or 0, array("d")).extend((scan.time_s, *at.tolist()))

    @property
    def of(self) -> dict[int, Array]:
        """Of each track, ``(k, 3)`` times and places from the radar [s, m]."""
        return {track: np.array(rows).reshape(-1, 3) for track, rows in self._rows.items()}


def _velocity(times_s: Array, places: Array) -> Array:
    since = times_s - times_s.mean()
    return np.asarray(since @ places / (since @ since))


class _Way(NamedTuple):
    """In which one track may be a copy of another."""

    how: str
    by: Array  # how it is moved
    covariance: Array  # of that
    times_s: Array  # (k,) of scans that show both
    places: Array  # (k, 2) of the original then [m]
    original: int
    copy: int
    shared: bool  # errors, or bends of the range
    lobe: bool = False  # at its ship's range, which changes, and not far to the side

    def like(self, other: _Way) -> bool:
        """Whether another copy is moved in the same way; those in side lobes lie to either side of their ships."""
        if self.how == "turned" and (self.original == other.original or self._both_lobes(other)):
            return True
        off = self.by - other.by if self.how == "shifted" else wrapped(self.by - other.by, 2 * math.pi)
        return bool(off @ np.linalg.solve(self.covariance + other.covariance, off) < ERRORS**2)

    def _both_lobes(self, other: _Way) -> bool:
        return self.lobe and other.lobe and self.original != other.copy and self.copy != other.original

    def differs(self, other: _Way) -> bool:
        """Whether the originals of both go differently at one time."""
        if self.how == "turned" and self.original == other.original and self.copy != other.copy:
            return True
        _, mine, its = np.intersect1d(self.times_s, other.times_s, return_indices=True)
        if len(mine) < SCANS:
            both = _velocity(self.times_s, self.places) - _velocity(other.times_s, other.places)
            return self._both_lobes(other) and bool(np.hypot(*both) > 2 * DIFFER_MPS)
        return bool(np.hypot(*_velocity(self.times_s[mine], self.places[mine] - other.places[its])) > DIFFER_MPS)


def copies_finding(sightings: Mapping[int, Array], range_sd_m: float, bearing_sd_rad: float) -> Finding:
    """Look for tracks that are copies of others.

    Parameters
    ----------
    sightings
        From :attr:`Sightings.of`, of a radar at rest.
    range_sd_m, bearing_sd_rad
        How far plots err.
    """
    longest = sorted(sightings, key=lambda track: -len(sightings[track]))[:LONGEST]
    sd = np.array([range_sd_m, bearing_sd_rad])
    ways = [way for pair in permutations(longest, 2) for way in _ways(*pair, sightings, sd)]
    tracks, best = set[int](), None
    for one in ways:
        alike = [two for two in ways if two.how == one.how and one.like(two)]
        beside = {two.copy for two in alike if two.copy != one.copy and one.differs(two)}
        by_itself = {two.copy for two in alike if two.shared or two.how == "twice"}
        copied = {one.copy} | beside | by_itself
        if (one.copy in by_itself or len(beside) >= SEVERAL - 1) and len(copied) > len(tracks):
            best, tracks = one, copied
    what, remedy = _said(best)
    names = ", ".join(map(str, sorted(tracks)))
    goes = f"Track {names} goes as another does" if len(tracks) == 1 else f"Tracks {names} go as others do"
    return Finding(
        "radar.copies", best is None, 0.0, float(len(tracks)),
        f"{goes}, {what}." if best else "No track repeats another elsewhere.", remedy,
    )  # fmt: skip


def _said(way: _Way | None) -> tuple[str, str]:
    if way is None:
        return "", ""
    if way.how == "twice":
        return (
            "at the same bearing and twice the range: echoes that went to and fro between ship and radar twice, and no "
            "ship is there"
        ), "Leave out what is seen at twice the range of a ship."
    if way.how == "turned":
        return (
            f"at the same range, turned by {abs(math.degrees(way.by[0])):.0f} degrees: a second antenna with another "
            "north, or side lobes; one of the two is no ship"
        ), "Track each antenna's plots by themselves; raise the radar's threshold against side lobes."
    if way.how == "mirrored":
        return (
            f"at the same range and all at a bearing of {math.degrees(way.by[0]) % 360:.0f} degrees: echoes by way of "
            "something there that reflects, and no ship is there"
        ), "Leave out that bearing; look for a mast or a wall in the antenna's way."
    return (
        f"{np.hypot(*way.by):.0f} m away: plots of two radars are in one file, and places of one of them are taken "
        "from the other"
    ), "Track each radar's plots by themselves, or give places (x_m, y_m or lon_deg, lat_deg) instead of ranges."


def _ways(original: int, copy: int, sightings: Mapping[int, Array], sd: Array) -> list[_Way]:
    """In which a track may be a copy of another, all the time or, as where two copies cross, for two thirds of it."""
    rows, its_rows = sightings[original], sightings[copy]
    times_s, mine, its = np.intersect1d(rows[:, 0], its_rows[:, 0], return_indices=True)
    both, third = (rows[mine], its_rows[its]), len(times_s) // 3
    if len(times_s) < SCANS or not _may(*both, sd):
        return []
    parts = slice(None), slice(-third), slice(third, None)
    each = (_ways_in(original, copy, both[0][part], both[1][part], sd) for part in parts)
    found = next((found for found in each if found), [])
    fainter = len(its_rows) < len(rows)
    return [one._replace(lobe=one.lobe and fainter) for one in found]


def _ways_in(original: int, copy: int, rows: Array, its_rows: Array, sd: Array) -> list[_Way]:
    """Of scans that show both, ``(k, 3)`` each."""
    times_s, one, two, n = rows[:, 0], rows[:, 1:], its_rows[:, 1:], len(rows)
    if n < SCANS:
        return []
    if np.hypot(*(two - one).mean(axis=0)) < AWAY_M:
        return []
    (far, angle), (its_far, its_angle) = _polar(one), _polar(two)
    range_sd, bearing_sd = sd.tolist()
    nears = float(np.ptp(far)) > SAILED * range_sd
    sails = nears or float(np.ptp(np.unwrap(angle))) > SAILED * bearing_sd
    found = list[_Way]()

    def keep(
        how: str, by: Array, covariance: Array, both: Sequence[tuple[Array, Array]], *, alone: bool = False
    ) -> None:
        lobe = how == "turned" and nears and abs(float(by[0])) < LOBES_RAD
        found.append(_Way(how, by, covariance, times_s, one, original, copy, alone or _shared(times_s, both), lobe))

    ranges = [(far, its_far)]  # which err together where the echo is the same one, by another way
    # a ship that follows the bends of another's range, as that passes, would turn about the radar with it
    bent = far - np.polynomial.Polynomial.fit(times_s, far, 1)(times_s)
    bends = float(np.mean(bent**2)) > (BENT + ERRORS * math.sqrt(2 / n)) * range_sd**2
    turns = wrapped(its_angle - angle, 2 * math.pi)
    turn = float(np.angle(np.exp(1j * turns).mean()))
    across = wrapped(turns - turn, 2 * math.pi)
    across /= min(max(math.sqrt(2) * bearing_sd, _by_steps(across)), WIDER * bearing_sd)
    if sails and _white((its_far - far) / (math.sqrt(2) * range_sd), across):
        keep("turned", np.array([turn]), np.array([[2 * bearing_sd**2 / n]]), ranges, alone=bends)
    if nears and _white((its_far - 2 * far) / (math.sqrt(5) * range_sd), turns / (math.sqrt(2) * bearing_sd)):
        keep("twice", np.zeros(1), np.eye(1), ranges)
    sight = float(np.angle(np.exp(1j * its_angle).mean()))
    more = float(np.median(its_far - far))
    passes = np.ptp(np.unwrap(angle)) > TURNED_RAD and -ERRORS * math.sqrt(2 / n) * range_sd < more < AWAY_M
    aside = wrapped(its_angle - sight, 2 * math.pi)
    aside_sd = min(max(bearing_sd, _by_steps(aside)), WIDER * bearing_sd)
    if nears and passes and _white((its_far - far - more) / (math.sqrt(2) * range_sd), aside / aside_sd):
        keep("mirrored", np.array([sight]), np.array([[aside_sd**2 / n]]), ranges, alone=bends)
    covariance = _covariance(far, angle, sd) + _covariance(its_far, its_angle, sd)
    precision = np.linalg.inv(covariance)
    shift = np.linalg.solve(precision.sum(axis=0), np.einsum("kij,kj->i", precision, two - one))
    left = np.einsum("kij,kj->ki", np.linalg.inv(np.linalg.cholesky(covariance)), two - one - shift)
    goes = np.hypot(*(one[-1] - one[0])) > SAILED * math.sqrt(np.trace(covariance.mean(axis=0)))
    if goes and _white(*left.T):
        keep("shifted", shift, np.linalg.inv(precision.sum(axis=0)), list(zip(one.T, two.T, strict=True)))
    return found


def _polar(places: Array) -> tuple[Array, Array]:
    return np.hypot(*places.T), np.arctan2(*places.T)


def _may(rows: Array, its_rows: Array, sd: Array) -> bool:
    """Whether most sightings of one lie about as far from those of another, or from the radar."""
    (far, _), (its_far, _) = _polar(rows[:, 1:]), _polar(its_rows[:, 1:])
    away, more = its_rows[:, 1:] - rows[:, 1:], its_far - far
    apart = np.hypot(*(away - np.median(away, axis=0)).T) / (sd[0] + sd[1] * (far + its_far))
    beyond = np.abs(more - np.median(more)) / sd[0], np.abs(more - far) / sd[0]
    return any(np.median(one) < ERRORS for one in (apart, *beyond))


def _covariance(far: Array, angle: Array, sd: Array) -> Array:
    """Of places of plots, ``(k, 2, 2)`` [m^2]."""
    along = np.column_stack([np.sin(angle), np.cos(angle)])
    aside = np.column_stack([along[:, 1], -along[:, 0]])
    axes = np.stack([sd[0] * along, (sd[1] * far)[:, None] * aside], axis=-1)
    return np.asarray(axes @ axes.transpose(0, 2, 1))


def _white(*left: Array) -> bool:
    """Whether what is left, in deviations, is about zero, of the size of errors, and goes nowhere."""
    n = len(left[0])
    for all_of_it in left:
        one = np.clip(all_of_it, -CLIPPED, CLIPPED)  # a plot may be a false alarm
        square = float((one**2).mean())
        if abs(one.mean()) > ERRORS / math.sqrt(n) or square > 1 + ERRORS * math.sqrt(2 / n):
            return False
        centred = one - one.mean()
        if (np.diff(one, append=one[0]) ** 2).sum() < 2 * (1 - ERRORS / math.sqrt(n)) * (centred @ centred):
            return False
    return True


def _by_steps(values: Array) -> float:
    """Deviation of values by half of their steps, which the middle of their distribution tells."""
    return float(np.median(np.abs(np.diff(values)))) / HALF / math.sqrt(2)


def _shared(times_s: Array, pairs: Sequence[tuple[Array, Array]]) -> bool:
    """Whether plots of both err together: by second differences, of which large ones are turns of ships."""
    steps = np.diff(times_s)
    near = steps[1:] + steps[:-1] <= NEAR * float(steps.min())
    rho = (steps[1:] / steps[:-1])[near]
    total = chance = 0.0
    for both in pairs:
        a, b = (_second_differences(values, near, rho) for values in both)
        kept = np.maximum(np.abs(a), np.abs(b)) < CLIPPED
        total += float(a[kept] @ b[kept])
        chance += float(a[kept] @ a[kept]) * float(b[kept] @ b[kept]) / max(int(kept.sum()), 1)
    count = len(pairs) * len(rho)
    return count >= SCANS and total > ALIKE * count and total > CLEAR * math.sqrt(OVERLAP * chance)


def _second_differences(values: Array, near: NDArray[np.bool_], rho: Array) -> Array:
    """Of values of three scans near to each other, in their own deviations."""
    off = (values[2:] - values[1:-1])[near] - rho * (values[1:-1] - values[:-2])[near]
    return np.asarray(off / max(float(np.median(np.abs(off))) / HALF, 1e-9)) if len(off) else off
