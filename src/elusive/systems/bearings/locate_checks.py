"""Whether bearings are of one emitter that stands still, as precise as told, and read as they are meant."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtri

from elusive.checks import Finding, lag_of, scale_of
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.gaussian.geolocation import Fix, Geolocation
from elusive.preprocess.robust import MAD
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.geometry import geometry_findings
from elusive.systems.bearings.given import repeated_finding, units_finding
from elusive.systems.bearings.heard import starts_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.readings import CONVENTIONS

FEW = 6  # bearings below which residuals tell nothing
TOLERANCE = 1.35  # of the deviation
ROUGH_DEG = 10.0  # bearings that agree no better are of no one place
BETTER = 3.0  # times by which another reading must fit better
LEVEL = 1e-4  # probability to call a resting emitter a moving one
SHARED = 0.85  # of the bearings, that two emitters must explain, the second at least a quarter of that
CROSSINGS = 400  # pairs of bearings that are tried
NEAR = 3.0  # deviations
FINEST_DEG = 2.0  # deviation that is assumed of two emitters' bearings where none is told


class Taken(NamedTuple):
    """Bearings with their times and the places they were taken at."""

    times_s: Array  # (n,)
    sensor: NDArray[np.intp]  # (n,)
    azimuth_rad: Array  # (n,)
    places_m: Array  # (n, 2)


def taken(heard: Sequence[BearingSet], sites: SensorSites) -> Taken:
    """Return the bearings of a recording one by one."""
    times = np.repeat([one.time_s for one in heard], [len(one.sensor) for one in heard])
    sensor = np.concatenate([one.sensor for one in heard]).astype(np.intp)
    azimuth = np.concatenate([one.azimuth_rad for one in heard])
    return Taken(times, sensor, azimuth, starts_of(heard, sites))


def place_findings(
    fix: Fix, heard: Sequence[BearingSet], sites: SensorSites, estimator: Geolocation
) -> tuple[Finding, ...]:
    """Check a place that bearings gave."""
    rows, n, told = taken(heard, sites), len(fix.residuals_rad), estimator.sigma_deg
    found = [units_finding(sites)]
    sigma = fix.sigma_rad if math.isfinite(fix.sigma_rad) else math.nan
    if n < FEW or not sigma > 0:
        return tuple(found)
    found.append(repeated_finding(heard, sites, math.degrees(sigma)))
    free = math.sqrt((n - 2) / n)
    scale = scale_of(fix.residuals_rad / (sigma * free), tolerance=TOLERANCE, independent=free**2)
    ratio = MAD * float(np.median(np.abs(fix.residuals_rad))) / (sigma * free)
    wide = told is not None and not scale.holds and scale.worst.seen > 1
    rough = told is None and math.degrees(sigma) > ROUGH_DEG
    moves = _moves(fix, rows)
    if wide or rough:
        seen = (
            f"residuals are {ratio:.2g} times what --sigma-deg {told:g} allows in the median"
            if told is not None
            else f"bearings agree to {math.degrees(sigma):.0f} degrees alone"
        )
        cause, remedy = _cause(fix, rows, estimator, moves=not moves.holds)
        found.append(
            Finding("bearings.residuals", False, 1.0, ratio, f"{seen[:1].upper()}{seen[1:]}: {cause}.", remedy)
        )
    else:
        narrow = told is not None and not scale.median.holds and ratio < 1
        found.append(
            Finding(
                "bearings.residuals", not narrow, 1.0, ratio,
                f"Residuals are {ratio:.2g} times what is told in the median: the ellipse is too large.",
                "Tell a smaller --sigma-deg, or leave it out.", grave=False,
            )
        )  # fmt: skip
    found.append(moves)
    if math.isfinite(float(fix.covariance[0, 0])):
        precise = BearingTracking(sigma_deg=min(math.degrees(sigma), BearingTracking.most_sigma_deg))
        found += geometry_findings(fix.position_m[None], fix.covariance[None], heard, precise, sites, "")
    return tuple(found)


def _moves(fix: Fix, rows: Taken) -> Finding:
    """Compare a place with a place and a velocity, linearised about the place; and residuals with those just before."""
    n, sigma = len(rows.times_s), max(fix.sigma_rad, 1e-12)
    moves, speed, lag = False, math.nan, math.nan
    times = rows.times_s - rows.times_s.mean()
    if np.ptp(times) > 0 and n > FEW:
        east, north = (fix.position_m - rows.places_m).T
        gradient = np.column_stack([north, -east]) / np.maximum(east**2 + north**2, 1e-12)[:, None]
        white = np.clip(fix.residuals_rad / sigma, -5.0, 5.0)
        moving = np.column_stack([gradient, gradient * times[:, None]]) / sigma
        left = []
        for design in (moving[:, :2], moving):
            found, *_ = np.linalg.lstsq(design, white)
            left.append(float(((white - design @ found) ** 2).sum()))
            speed = float(np.hypot(*found[-2:]))
        better = (left[0] - left[1]) / 2 / max(left[1] / (n - 4), 1e-12)
        # by the residuals' own size, and by that which was told
        moves = better > fdtri(2, n - 4, 1 - LEVEL) and left[0] - left[1] > chdtri(2, LEVEL)
        series = np.full((n, int(rows.sensor.max()) + 1), np.nan)
        for number in np.unique(rows.sensor).tolist():
            its = white[rows.sensor == number]
            series[: len(its), number] = its - its.mean()
        persists = lag_of(series, tolerance=0.4, level=LEVEL)
        lag = persists.seen
        moves |= not persists.holds and lag > 0
    return Finding(
        "bearings.rests", not moves, 0.0, speed,
        f"The bearings drift as of an emitter that moves, at about {speed:.2g} m/s, or their errors persist "
        f"(correlation {lag:.2f} from one to the next): it is at no one place, and the ellipse is too small.",
        "Take elusive track bearings, or the bearings of a shorter time.",
    )  # fmt: skip


def _cause(fix: Fix, rows: Taken, estimator: Geolocation, *, moves: bool) -> tuple[str, str]:
    now = float(np.median(np.abs(fix.residuals_rad)))
    for convention in CONVENTIONS:
        try:
            other = estimator.locate(convention.meant(rows.azimuth_rad), rows.places_m)
        except DataError:
            continue
        if float(np.median(np.abs(other.residuals_rad))) < now / BETTER:
            return f"they fit if the azimuths are read {convention.name}", convention.remedy
    if moves:
        return "the emitter moves", "Take elusive track bearings."
    sigma_deg = estimator.sigma_deg or min(FINEST_DEG, math.degrees(fix.sigma_rad) / BETTER)
    if two_places(rows, math.radians(sigma_deg)):
        return (
            "they are of two emitters, at two places",
            "Locate each by its own bearings; or take elusive track bearings.",
        )
    spread = math.degrees(MAD * now)
    return (
        f"they are as of a deviation of {spread:.2g} degrees, or of several emitters, or sensors stand elsewhere",
        "Leave --sigma-deg out to find it from the bearings; look at the azimuths and the sensors' places.",
    )


def two_places(rows: Taken, sigma: float) -> bool:
    """Say whether two places explain the bearings and one does not: the best of crossings of two bearings, twice."""
    rng, left, shares = np.random.default_rng(0), np.arange(len(rows.azimuth_rad)), list[float]()
    for _ in range(2):
        if len(left) < FEW:
            return False
        first, second = rng.choice(left, (2, CROSSINGS))
        towards = np.column_stack([np.sin(rows.azimuth_rad), np.cos(rows.azimuth_rad)])
        apart = rows.places_m[second] - rows.places_m[first]
        turn = towards[first, 0] * towards[second, 1] - towards[first, 1] * towards[second, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = (apart[:, 0] * towards[second, 1] - apart[:, 1] * towards[second, 0]) / turn
        crossing = (rows.places_m[first] + reach[:, None] * towards[first])[np.isfinite(reach) & (reach > 0)]
        if not len(crossing):
            return False
        off = crossing[:, None] - rows.places_m[left]
        near = np.abs(wrapped(rows.azimuth_rad[left] - np.arctan2(off[..., 0], off[..., 1]))) < NEAR * sigma
        best = near[near.sum(axis=1).argmax()]
        shares.append(float(best.sum()) / len(rows.azimuth_rad))
        left = left[~best]
    return sum(shares) > SHARED and shares[1] > SHARED / 4
