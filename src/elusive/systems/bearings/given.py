"""Whether places, directions and times are given as they are told: in metres, each measured anew, not rounded."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding, share_of
from elusive.contracts import VX, VY, Array, X, Y
from elusive.report.clock import moment
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import wrapped
from elusive.sensors.placed import Z
from elusive.systems.bearings.parameters import BearingTracking
from elusive.tracking.track import Step

DEGREES_MOST, DEGREES_APART = 5.0, 5.0  # extent of sensors in degrees, and how much further off (0, 0) is
AT_ONCE = 3.0  # bearings of a sensor at the only time there is
STUCK, BY_CHANCE = 5, 1e-4  # equal readings in a row, and how probable the longest such row may be
BENEATH = 3.0  # deviations
CERTAIN = 5.0  # standard errors


def units_finding(sites: SensorSites) -> Finding:
    """Check that the sensors' places look like metres."""
    places = sites.positions_m[:, :2]
    extent, centre = float(np.ptp(places, axis=0).max()), np.abs(places.mean(axis=0))
    degrees = bool(
        (np.abs(places) <= (180, 90)).all() and 0 < extent <= DEGREES_MOST and centre.max() > DEGREES_APART * extent
    )
    return Finding(
        "bearings.units", not degrees, math.nan, extent,
        f"The sensors' places are read as metres and look like longitudes and latitudes: they lie within {extent:.3g} "
        f"of each other about ({places[:, 0].mean():.4g}, {places[:, 1].mean():.4g}).",
        "Convert them to metres east and north, or name the columns lon_deg and lat_deg.",
    )  # fmt: skip


def times_finding(heard: Sequence[object], said: str = "") -> Finding:
    """Check that a recording is of more than one time."""
    count = sum(len(times.sensor) for times in heard if isinstance(times, BearingSet))
    sensors = set[int]().union(*(set(times.sensor.tolist()) for times in heard if isinstance(times, BearingSet)))
    most = count / max(len(sensors), 1)
    return Finding(
        "bearings.times", len(heard) > 1 or most <= AT_ONCE, AT_ONCE, most,
        f"{said}All {count} bearings of {len(sensors)} sensors have one and the same time: an emitter is taken to "
        "stand still, and a sensor to hear it again and again at once.",
        "Tell in time_s when each was measured; elusive locate takes bearings without times.",
    )  # fmt: skip


def beneath_finding(steps: Sequence[Step], sites: SensorSites, said: str = "") -> Finding:
    """Check that an emitter is not beneath the ground that sensors stand on, as one above it is if angles are down.

    Parameters
    ----------
    steps
        Of an emitter whose height is tracked.
    """
    lowest = float(sites.positions_m[:, 2].min())
    height = np.array([step.tracks[0].mean[Z] for step in steps])
    spread = np.sqrt([step.tracks[0].covariance[Z, Z] for step in steps])
    share = float((height + BENEATH * spread < 0).mean())
    below = float(np.median(-height))
    return Finding(
        "bearings.beneath", lowest < 0 or share <= 0.5, 0.0, share,
        f"{said}The emitter lies {below:.2g} m beneath a height of zero, and all sensors above: a place as far above "
        "them fits as well if elevations are positive downwards.",
        "Change the sign of the elevations if they are; if the sensors stand high, tell their heights, z_m.",
        grave=False,
    )  # fmt: skip


def repeated_finding(heard: Sequence[object], sites: SensorSites, sigma_deg: float, said: str = "") -> Finding:
    """Check that no sensor reports again and again what it has just reported, to the last digit."""
    its = dict[int, list[tuple[float, Array]]]()
    for times in heard:
        if isinstance(times, BearingSet):
            for number in np.unique(times.sensor).tolist():
                its.setdefault(number, []).append((times.time_s, times.azimuth_rad[times.sensor == number]))
    share, chance, name, row = 0.0, 0.0, "", ""
    for number, rows in its.items():
        hits, expected, longest, since_s = _again(rows, math.radians(sigma_deg))
        fact = share_of(hits.sum(), len(hits), expected)
        stuck = longest >= STUCK and len(hits) * expected**longest < BY_CHANCE
        often = len(hits) >= STUCK and not fact.holds and fact.seen > expected
        if (stuck or often) and hits.mean() > share:
            share, chance, name = float(hits.mean()), expected, sites.names[number]
            row = f", {longest} in a row from {moment(since_s)} on" if longest >= STUCK else ""
    return Finding(
        "bearings.repeated", not name, chance, share,
        f"{said}Sensor {name} reports exactly what it has just reported in {100 * share:.0f} % of its readings "
        f"({100 * chance:.0f} % by chance){row}: it is stuck, or read more often than it measures, or lines stand "
        "twice. Each reading counts as a new one, and the ellipses are too small.",
        "Leave out the lines that say the same again; look at that sensor.",
    )  # fmt: skip


def _again(rows: Sequence[tuple[float, Array]], sigma: float) -> tuple[Array, float, int, float]:
    """Which readings of a sensor are equal to one of that time or of the time before; by chance; the longest row."""
    every = np.sort(np.concatenate([azimuth for _, azimuth in rows]))
    gaps = np.diff(every)
    step = float(gaps[gaps > 1e-9].min()) if (gaps > 1e-9).any() else 0.0
    alike = min(step / (2 * math.sqrt(math.pi) * sigma), 1.0)  # of two with one direction
    hits, chances, before = list[bool](), list[float](), np.empty(0)
    most, since_s, row, row_s = 0, math.nan, 0, math.nan
    for time_s, azimuth in rows:
        for place, one in enumerate(azimuth.tolist()):
            others = np.append(before, azimuth[:place])
            if len(others):
                hits.append(bool((np.abs(others - one) < 1e-9).any()))
                chances.append(1 - (1 - alike) ** len(others))
                row, row_s = (row + 1, row_s if row else time_s) if hits[-1] else (0, math.nan)
                most, since_s = (row, row_s) if row > most else (most, since_s)
        before = azimuth
    return np.array(hits or [False]), float(np.mean(chances or [0.0])), most, since_s


def clock_finding(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, said: str = "") -> Finding:
    """Check that readings of one time were taken at one: they do not drift in their order as an emitter passes."""
    products, squares, longest, sigma = 0.0, 0.0, 1, math.radians(parameters.deviation_deg)
    for step in steps:
        times = step.measurement
        if not step.tracks or not isinstance(times, BearingSet) or len(np.unique(times.sensor)) == len(times.sensor):
            continue
        rate = turning(times, step.tracks[0].mean, sites)
        for number in np.unique(times.sensor).tolist():
            its = times.sensor == number
            count = int(its.sum())
            order = np.arange(count) - (count - 1) / 2
            azimuth, pace = times.azimuth_rad[its], rate[its]
            off = wrapped(azimuth - azimuth[0])
            off = np.clip(off - np.median(off), -CERTAIN * sigma, CERTAIN * sigma)  # a stray is none of the drift
            products += float((pace * order) @ off)
            squares += float(((pace * order) ** 2).sum())
            longest = max(longest, count)
    apart_s = products / squares if squares else 0.0
    error_s = sigma / math.sqrt(squares) if squares else math.inf
    known = [step.tracks[0] for step in steps if step.tracks]
    speed = float(np.median([math.hypot(one.mean[VX], one.mean[VY]) for one in known])) if known else 0.0
    spread = float(np.median([math.sqrt(max(one.covariance[X, X], one.covariance[Y, Y])) for one in known] or [1.0]))
    away_m = 0.5 * (longest - 1) * apart_s * speed
    return Finding(
        "bearings.clock", apart_s < CERTAIN * error_s or away_m < 0.5 * spread, 0.0, apart_s,
        f"{said}Readings of one sensor and time drift in their order, as if they came {apart_s:.2g} s after each "
        f"other: times are rounded, and places are as much as {2 * away_m:.2g} m off along the way, where {spread:.2g} "
        "m is claimed.",
        "Give times of more digits, or one reading of each time.",
    )  # fmt: skip


def turning(times: BearingSet, mean: Array, sites: SensorSites) -> Array:
    """How fast the directions of a time's bearings to an emitter turn [rad/s]."""
    places = sites.positions_m[times.sensor] if times.places_m is None else times.places_m
    east, north = mean[X] - places[:, 0], mean[Y] - places[:, 1]
    rate: Array = (mean[VX] * north - mean[VY] * east) / np.maximum(east**2 + north**2, 1.0)
    return rate
