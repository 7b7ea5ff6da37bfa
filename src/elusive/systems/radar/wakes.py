"""Wakes: plots that trail behind ships, where they have been.

They are clutter whose place is known as far as the ships' is, a Poisson process beside that of all other false alarms
(Kingman, 1993, Poisson processes, section 2.2): so many a ship and scan, exponential behind it and Gaussian across its
course. How many there are and how far behind is counted of ships that are followed, less what lies as far ahead of
them, and to either side. A hull's plots lie on both sides of any one of them that is followed; foam, which may be
followed, too, stays where it is as the ship goes on.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from elusive.checks import Finding
from elusive.contracts import VX, VY, Array, X, Y
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.tracking.detection_targets import Target

START = 1.0, 150.0  # plots a ship and scan, and how far behind [m], that are looked for first
SURE, SLOW_MPS = 0.3, 1.0  # existence from which a target has a wake, and a speed below which it has none
WIDTH_M, ASIDE, REACH_M = 15.0, 3.0, 1000.0  # deviation across, of which so many count, and how far wakes reach
ERRORS, AHEAD = 4.0, 0.2  # standard errors of what is behind, and share of it that is ahead at most
NEAR, LATEST = 2.0, 10  # deviations within which two are at one place; scans in which an earlier one is looked for
NEAREST_M = 20.0  # that wakes are long at least


class Sailing(Protocol):
    """A target as it is expected or known."""

    @property
    def existence(self) -> float:
        """Probability that it is there."""

    @property
    def mean(self) -> Array:
        """Of x, vx, y, vy and what follows."""

    @property
    def covariance(self) -> Array:
        """Of these."""


class _Behind(NamedTuple):
    """Where plots lie behind a ship."""

    along: Array  # (m,) [m]
    variance: Array  # (m,) of that
    aside: Array
    aside_variance: Array


def _behind(ship: Sailing, scan: RadarScan, places: Array, errors: Array) -> _Behind | None:
    """None of a ship that lies still."""
    velocity = ship.mean[[VX, VY]]
    speed = math.hypot(*velocity)
    if speed < SLOW_MPS:
        return None
    course = velocity / speed
    across = np.array([course[1], -course[0]])
    off = ship.mean[[X, Y]] + (scan.times_s - scan.time_s)[:, None] * velocity - places
    spread = ship.covariance[np.ix_([X, Y], [X, Y])] + errors
    turned = float(across @ ship.covariance[np.ix_([VX, VY], [VX, VY])] @ across) / speed**2
    along = off @ course
    wide = WIDTH_M**2 + np.einsum("i,kij,j->k", across, spread, across) + turned * along.clip(0) ** 2
    return _Behind(along, np.einsum("i,kij,j->k", course, spread, course), off @ across, wide)


class _Beside(NamedTuple):
    """What was seen beside a ship."""

    place: Array  # (2,) of the ship [m]
    places: Array  # (m, 2) of plots [m]
    errors: Array  # (m, 2, 2) of these


class Wakes(NamedTuple):
    """What ships leave behind them, as :class:`~elusive.tracking.detections.Trails`."""

    sensor: RadarSensor
    number: float  # plots a ship and scan
    length_m: float  # mean distance behind it

    def log_trailing(self, targets: Sequence[Sailing], measurement: Any) -> Array:
        """Log intensity of plots of wakes at each plot of a scan, ``(m,)`` [1 / (m rad)]; Doppler is uniform."""
        scan, length = measurement, self.length_m
        places, errors = self.sensor.places(scan)
        found = np.zeros(len(places))
        for ship in targets:
            its = _behind(ship, scan, places, errors) if len(places) and ship.existence > SURE else None
            if its is not None:
                sd = np.sqrt(its.variance)
                # an exponential distance behind a place that is known with a Gaussian error
                log_density = log_ndtr(its.along / sd - sd / length) + 0.5 * its.variance / length**2
                log_density -= its.along / length + 0.5 * its.aside**2 / its.aside_variance
                found += ship.existence * np.exp(log_density) / (length * np.sqrt(2 * math.pi * its.aside_variance))
        with np.errstate(divide="ignore"):
            log_place = np.log(self.number * found * np.maximum(scan.range_m, 1.0))
        folds = math.log(2 * (self.sensor.max_doppler_mps or 1.0))
        return np.asarray(log_place - np.where(np.isfinite(scan.doppler_mps), folds, 0.0))

    def explained(self, scan: RadarScan, targets: Sequence[Sailing]) -> NDArray[np.bool_]:
        """Which plots of a scan are of wakes more likely than of other clutter, ``(m,)``."""
        return np.asarray(self.log_trailing(targets, scan) > self.sensor.log_clutter(scan))


class Trailing:
    """Counts plots behind and ahead of ships that are followed, beside theirs, less those as far to either side."""

    def __init__(self, fade: float) -> None:
        self._fade = fade
        self._plots, self._far = np.zeros(2), np.zeros(2)  # behind and ahead
        self._variance = self._scans = 0.0  # of all plots; of ships
        self._before = dict[int, deque[_Beside]]()  # of ships, some scans ago
        self._rest = np.zeros(2)  # pairs of plots beside ships that stay, less others; their number

    def add(
        self, scan: RadarScan, sensor: RadarSensor, ships: Mapping[int, Target], left: NDArray[np.bool_]
    ) -> None:  # fmt: skip
        """Take a scan in: ships that are followed, by their tracks, and which plots are none of theirs, ``(m,)``."""
        self._plots, self._far = self._fade * self._plots, self._fade * self._far
        self._variance, self._scans = self._fade * self._variance, self._fade * self._scans
        rest, every = scan.select_detections(np.flatnonzero(left)), sensor.places(scan)
        places, errors = (one[left] for one in every)
        self._rest *= self._fade
        self._before = {track: held for track, held in self._before.items() if track in ships}
        for track, ship in ships.items():
            its = _behind(ship, rest, places, errors)
            if its is None:
                continue
            self._pair(track, ship, *every)
            self._scans += ship.existence
            aside = np.abs(its.aside) / (ASIDE * np.sqrt(its.aside_variance))
            # in its wake or, in two strips as wide each, beside
            counts = ship.existence * np.where(aside < 1, 1.0, np.where(aside < 3, -0.5, 0.0))
            counts[np.abs(its.along) > REACH_M] = 0.0
            self._variance += float(counts @ counts)
            for row, side in enumerate((its.along > 0, its.along < 0)):
                self._plots[row] += counts[side].sum()
                self._far[row] += counts[side] @ np.abs(its.along[side])

    def _pair(self, track: int, ship: Target, places: Array, errors: Array) -> None:
        """Pair plots beside a ship with earlier ones: what it leaves stays there, what is on board goes along.

        On board one lies as often ahead of another as behind it, whichever came first.
        """
        place, velocity = ship.mean[[X, Y]], ship.mean[[VX, VY]]
        others = np.arange(len(places)) != ship.detection
        near = others & (np.hypot(*(places - place).T) < REACH_M)
        now = _Beside(place, places[near], errors[near])
        held = self._before.setdefault(track, deque(maxlen=LATEST))
        for then in reversed(held):
            gone = place - then.place
            if not len(then.places) or not len(now.places):
                continue
            precision = np.linalg.inv(then.errors[:, None] + now.errors)
            if not (gone @ precision @ gone > NEAR**2).all():
                continue
            for sign, way in ((1.0, np.zeros(2)), (-1.0, 2 * gone)):
                off = now.places - then.places[:, None] - way
                alike = np.einsum("nmi,nmij,nmj->nm", off, precision, off) < NEAR**2
                middle = (then.places[:, None] - then.place + now.places - place) @ velocity
                pairs = ship.existence * alike * -np.sign(middle)
                self._rest += sign * pairs.sum(), np.abs(pairs).sum()
            break
        held.append(now)

    @property
    def stays(self) -> bool:
        """Whether what lies behind ships stays there, as foam does."""
        return bool(self._rest[0] > ERRORS * math.sqrt(self._rest[1]))

    @property
    def behind(self) -> tuple[float, ...]:
        """Plots a ship and scan behind it, and how far on the mean [m]; nothing where chance explains them."""
        more = float(self._plots[0] - self._plots[1])
        if not more > ERRORS * math.sqrt(self._variance):
            return ()
        return more / max(self._scans, 1.0), max(float(self._far[0] - self._far[1]) / more, NEAREST_M)

    @property
    def wakes(self) -> tuple[float, ...]:
        """:attr:`behind`; nothing where much lies ahead, too, or what is behind goes on and on."""
        behind, ahead = self._plots.tolist()
        found = self.behind
        ends = bool(found) and found[1] < REACH_M / 3  # evenly it would be a half
        return found if ends and (self.stays or ahead < AHEAD * behind) else ()


def wakes_finding(wakes: Sequence[float]) -> Finding:
    """Say whether ships have wakes."""
    number, far = wakes or (0.0, 0.0)
    return Finding(
        "radar.wakes", not wakes, 0.0, number,
        f"Ships have {number:.2g} plots a scan behind them, {far:.0f} m off on the mean, and none ahead: they are "
        "taken for wakes, and what follows a ship that closely is found later, or not.",
        "Turn the radar's sea clutter control up, or leave those plots out; with --extent hull they are hulls.",
        grave=False,
    )  # fmt: skip
