"""How far a radar's plots err, from the plots alone: a target sails nearly straight over three scans.

Of three plots of one target the middle one lies between the others, but for the errors of all three: a second
difference, by the plots' own times, has s^2 = 1 + (1 + rho)^2 + rho^2 times the variance of a plot, rho the ratio of
the two intervals. Triples of plots that belong to nothing lie anywhere: a mixture of a Gaussian and a uniform density,
fitted by expectation and maximisation (Dempster, Laird and Rubin, 1977), tells them apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from elusive.contracts import Array
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.radar_view import RadarView
from elusive.systems.radar.straight import OVERLAP, sharpest

FASTEST_MPS, ROOM_M = 25.0, 60.0  # of what is looked for, and beside it
MOST, COLUMNS = 40_000, 9  # triples that are kept, and what is known of each
WINDOW = 6.0  # deviations in which the mixture is fitted
MOST_FITTED = 8000  # triples
READ = 1e-2, 1e-5, 0.5, 0.5  # least differences of ranges [m], bearings [rad], places [m]; less is of a map's axes
STRAY, MULTIPLES = 3, 50.0  # differences that may be less than a step; of a step, that are looked at
NEARLY, MOSTLY = 0.15, 0.9  # of a step, by which a multiple may be off; share of the differences that are multiples
FEW = 25  # triples of targets, from which errors are known
ENOUGH = 100  # triples of targets whose middle plot is in no other triple, from which they alone are taken
SURE = 0.8  # probability from which a triple is a target's
CROWDED = 3.0  # triples of a middle plot, on the mean
AT_A_PLACE, LATER = 4.0, 20  # deviations within which plots are at one place, scans after which a target has left it
MOST_PLACES = 4000  # that are looked at for that
CUT, FAR = 0.25, 0.75  # deviation, of the widest error, from which some are cut off; quantile of ranges that are far
SCANS, PLOTS = 300, 60  # scans that are looked at once more then, of so many plots at most


class Widest(NamedTuple):
    """How far plots may err to be looked for."""

    range_m: float
    bearing_rad: float
    beside_rad: float  # beside ROOM_M, of a plot from the one before


USUAL, POOR = Widest(120.0, 0.04, 0.0), Widest(400.0, 0.16, 0.16)  # radars; the latter make far more triples of nothing


class PlotErrors(NamedTuple):
    """Errors that the plots of a recording show."""

    range_sd_m: float
    bearing_sd_rad: float
    targets: float  # triples of targets
    share_sd: float  # standard error of the deviations, relative
    places: Array  # (n, 2) where targets pass by [m]
    rates_mps: Array  # (m, 3) of targets: how fast the range grows, Doppler of the middle plot, mean of the others'
    crowded: bool = False  # echoes lie so close to each other that the deviations come out too large
    far_m: float = 0.0  # range of targets that lie far

    @property
    def told(self) -> tuple[float, float]:
        """Deviations of a range [m] and of a bearing [mrad], in as many digits as they are known to."""
        return float(f"{self.range_sd_m:.3g}"), float(f"{1000 * self.bearing_sd_rad:.3g}")

    def cut_off(self, scans: Sequence[Plots]) -> bool:
        """Whether plots err so far that triples as usual lack some."""
        if self.range_sd_m > CUT * USUAL.range_m or self.bearing_sd_rad > CUT * USUAL.bearing_rad:
            return True
        times = [float(scan.times_s.mean()) for scan in scans if len(scan.times_s)]
        room = ROOM_M + 0.5 * FASTEST_MPS * (float(np.median(np.diff(times))) if len(times) > 1 else 0.0)
        return 3 * math.sqrt(2) * math.hypot(self.range_sd_m, self.bearing_sd_rad * self.far_m) > room


class Plots(NamedTuple):
    """Plots of a scan, n of them."""

    places: Array  # (n, 2) [m]
    times_s: Array  # (n,)
    radar: Array  # (2,) [m]
    range_m: Array  # (n,)
    doppler_mps: Array  # (n,)
    bearing_rad: Array  # (n,)

    @classmethod
    def of(cls, scan: RadarScan) -> Plots:
        """Return those of a scan."""
        places, radar = RadarView().places(scan)[0], np.array([scan.own.x_m, scan.own.y_m])
        return cls(places, scan.times_s, radar, scan.range_m, scan.doppler_mps, scan.bearing_rad)


class Triples:
    """Gathers second differences of plots, scan by scan."""

    def __init__(self) -> None:
        self._before: list[Plots] = []  # of the latest scans
        self._first: list[Plots] = []
        self._rows: list[Array] = []
        self._count = self._scans = 0

    def add(self, scan: RadarScan) -> None:
        """Take a scan in, of the order of time."""
        self._before.append(Plots.of(scan))
        self._first += self._before[-1:] if self._scans < SCANS else []
        self._scans += 1
        if len(self._before) == 3:
            if self._count < MOST and all(len(one.times_s) for one in self._before):
                first, middle, last = self._before
                rows = differences(first, middle, last, self._scans, USUAL)
                self._rows.append(rows)
                self._count += len(rows)
            del self._before[0]

    @property
    def rows(self) -> Array:
        """Second differences along and across the line of sight and what is known of each triple, ``(n, 9)``."""
        return np.concatenate(self._rows) if self._rows else np.zeros((0, COLUMNS))

    def fit(self) -> PlotErrors | None:
        """Return the errors; None where too few plots follow each other as a target's do."""
        steps = _steps(self._first)
        found = _of_rows(self.rows, USUAL, steps)
        if found is not None and not found.cut_off(self._first):
            return found
        widest = POOR
        if found is not None and found.range_sd_m < CUT * USUAL.range_m:
            widest = POOR._replace(range_m=WINDOW * found.range_sd_m)
        rows, count = [np.zeros((0, COLUMNS))], 0
        for number, three in enumerate(zip(self._first, self._first[1:], self._first[2:], strict=False), 3):
            if count < MOST and all(0 < len(one.times_s) <= PLOTS for one in three):
                rows.append(differences(*three, number, widest))
                count += len(rows[-1])
        poor = _of_rows(np.concatenate(rows), widest, steps)
        return found if poor is None or poor.crowded else poor


def _steps(scans: Sequence[Plots]) -> Array:
    """Return the steps that ranges [m], bearings [rad] and places [m] are rounded to, ``(3,)``.

    About the least by which plots differ from the nearest of the scan before: of longitude and latitude steps are
    alike nearby alone.
    """
    found = list[Array]()
    for before, now in pairwise(scans):
        if len(before.times_s) and len(now.times_s):
            _, which = cKDTree(before.places).query(now.places)
            each, other = (np.column_stack([one.range_m, one.bearing_rad, one.places]) for one in (now, before))
            found.append(np.abs(each - other[which]))
    columns = np.concatenate([np.zeros((0, 4)), *found]).T
    along, aside, east, north = (_step(one[one > read], read) for one, read in zip(columns, READ, strict=True))
    return np.array([along, aside, math.sqrt((east**2 + north**2) / 2)])


def _step(differences: Array, read: float) -> float:
    """Return the step of which differences above zero ``(n,)`` are nearly whole multiples; 0: of none."""
    for steps in (differences, np.diff(np.sort(differences))):  # none may be of one step alone
        if len(steps := steps[steps > read]) > FEW:
            step = float(np.partition(steps, STRAY)[STRAY])
            times = differences[differences < MULTIPLES * step] / step
            if len(times) >= FEW and (np.abs(times - np.round(times)) < NEARLY).mean() > MOSTLY:
                return step
    return 0.0


def _of_rows(rows: Array, widest: Widest, steps: Array) -> PlotErrors | None:
    """Return the errors that triples show, ``(n, 9)``, of ranges, bearings and places rounded to steps ``(3,)``."""
    rows, (along, aside, place) = rows.copy(), steps / math.sqrt(12)
    rounding = np.column_stack([np.full(len(rows), math.hypot(along, place)), np.hypot(aside, place / rows[:, 3])])
    # differences of rounded values are alike again and again, and would seem to have no error
    rows[:, :2] += rounding * np.random.default_rng(0).standard_normal(rounding.shape)
    # echoes close to each other make triples of several, which no uniform density describes
    of_each = candidates(rows)
    one = of_each == 1
    alone = _fitted(rows[one], widest, rounding[one])
    if alone is not None and alone.targets >= ENOUGH:
        return alone
    every = _fitted(rows, widest, rounding)
    return None if every is None else every._replace(crowded=len(rows) > CROWDED * float((1 / of_each).sum()))


def candidates(rows: Array) -> NDArray[np.int64]:
    """Count the triples of the middle plot of each, ``(n, 9) -> (n,)``."""
    _, which, counts = np.unique(rows[:, [2, 4, 5]], axis=0, return_inverse=True, return_counts=True)
    return np.asarray(counts[which.ravel()])


def _fitted(rows: Array, widest: Widest, rounding: Array) -> PlotErrors | None:
    """Fit the mixture to triples, ``(n, 9)``; None where too few are of targets."""
    if len(rows) < FEW:
        return None
    most = np.array(widest[:2])
    limits, sd = most, most / 4
    for _ in range(4):  # the window closes in on what is found
        inside = np.flatnonzero((np.abs(rows[:, :2]) < limits).all(axis=1))
        inside = inside[:: max(1, len(inside) // MOST_FITTED)]
        inside_rows = rows[inside]
        member, sd = sharpest(inside_rows[:, :2], limits, np.minimum(sd, limits / 2))
        limits = np.minimum(WINDOW * sd, most)
    total = float(member.sum())
    if total < FEW:
        return None
    rounded = member @ rounding[inside] ** 2 / total
    sd = np.sqrt(np.maximum(sd**2 - rounded, rounded))
    sure = inside_rows[member > SURE]
    rates = sure[np.isfinite(sure[:, 6:]).all(axis=1), 6:]
    far_m = float(np.quantile(sure[:, 3], FAR)) if len(sure) else 0.0
    sure = sure[:: max(1, len(sure) // MOST_PLACES)]
    moving = _passing(sure[:, 2], sure[:, 4:6], AT_A_PLACE * np.hypot(sd[0], sd[1] * sure[:, 3]))
    range_sd_m, bearing_sd_rad = sd.tolist()
    share_sd = math.sqrt(OVERLAP / (2 * total))
    return PlotErrors(range_sd_m, bearing_sd_rad, total, share_sd, sure[moving, 4:6], rates, far_m=far_m)


def _passing(scans: Array, places: Array, reach: Array) -> NDArray[np.bool_]:
    """Tell plots at places where there is nothing some time before and after: an echo that rests stays there."""
    if not len(places):
        return np.zeros(0, dtype=bool)
    near = cKDTree(places).query_ball_point(places, reach)
    return np.array(
        [np.abs(scans[found] - scan).max() < LATER for found, scan in zip(near, scans, strict=True)], dtype=bool
    )


def differences(first: Plots, middle: Plots, last: Plots, number: int, widest: Widest) -> Array:
    """Return second differences along and across the line of sight, scan, range and place of the middle; rates."""
    places, times, radar, _, doppler, _ = middle
    interval = float(times.mean() - first[1].mean())
    if not interval > 0:
        return np.zeros((0, COLUMNS))
    sight = np.hypot(*(places - radar).T)
    near = cKDTree(first[0]).query_ball_point(places, FASTEST_MPS * interval + ROOM_M + widest.beside_rad * sight)
    i = np.repeat(np.arange(len(places)), [len(found) for found in near])
    a = np.array([one for found in near for one in found], dtype=np.int64)
    before = times[i] - first[1][a]
    i, a, before = i[before > 0], a[before > 0], before[before > 0]
    # where the third would be after the mean interval; its own time is counted below
    ahead = places[i] + (places[i] - first[0][a]) * (float(last[1].mean() - times.mean()) / before)[:, None]
    reach = 2.5 * np.hypot(widest.range_m, widest.bearing_rad * sight[i])
    then = cKDTree(last[0]).query_ball_point(ahead, reach) if len(i) else []
    pair = np.repeat(np.arange(len(i)), [len(found) for found in then])
    c = np.array([one for found in then for one in found], dtype=np.int64)
    i, a, before = i[pair], a[pair], before[pair]
    rho = (last[1][c] - times[i]) / before
    off = last[0][c] - places[i] - rho[:, None] * (places[i] - first[0][a])
    distance = np.maximum(sight[i], 1e-9)
    along = (places[i] - radar) / distance[:, None]
    scale = np.sqrt(1 + (1 + rho) ** 2 + rho**2)
    dr = (off * along).sum(axis=1) / scale
    db = (off[:, 0] * along[:, 1] - off[:, 1] * along[:, 0]) / (scale * distance)
    rate = (last.range_m[c] - first.range_m[a]) / (last.times_s[c] - first.times_s[a])
    others = (first.doppler_mps[a] + last.doppler_mps[c]) / 2
    rows = np.column_stack([dr, db, np.full(len(i), number), distance, places[i], rate, doppler[i], others])
    return np.asarray(rows[(np.abs(dr) < widest.range_m) & (np.abs(db) < widest.bearing_rad) & (rho > 0)])
