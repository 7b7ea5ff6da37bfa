"""Errors that a sensor may have, and bearings as they were without: its north, a drift of it, its clock, its place."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from elusive.contracts import VX, VY, Array, X, Y
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.tracking.track import Step

Heard = list[BearingSet]
Sizes = tuple[float, ...]
Mended = tuple[Heard, SensorSites]


class SensorError(NamedTuple):
    """An error, or two at once."""

    units: Sizes  # of each part, that are tried first
    kind: str  # which of it may be one of two
    sensors: frozenset[int]
    said: Callable[[Sizes], tuple[str, str]]  # what is wrong, and what to do
    without: Callable[[Heard, SensorSites, Sizes], Mended]


def errors_of(
    heard: Sequence[Heard], base: Sequence[Sequence[Step]], sites: SensorSites, used: list[int], sigma_deg: float
) -> list[SensorError]:
    """Return the errors of one sensor each, and a north that is another for all.

    Parameters
    ----------
    heard
        Bearings of each emitter.
    base
        Its path through them; the first sizes are taken from these.
    sites, used
        The sensors, and the rows of those that report.
    sigma_deg
        Deviation of a bearing.
    """
    steps, every = [step for path in base for step in path], [times for part in heard for times in part]
    spread = float(np.median([math.sqrt(step.tracks[0].covariance[X, X]) for step in steps]))
    means = np.array([step.tracks[0].mean for step in steps])
    speed = float(np.median(np.hypot(means[:, VX], means[:, VY]))) or 1e-9
    away = np.linalg.norm(means[:, None, [X, Y]] - sites.positions_m[used, :2], axis=2)
    seconds = math.radians(sigma_deg) * float(np.median(away)) / speed
    first_s, last_s = (of(times.time_s for times in every) for of in (min, max))
    found = [_turned("all azimuths", used, sigma_deg)]
    for row in used:
        name = sites.names[row]
        found.append(_turned(f"the azimuths of sensor {name}", [row], sigma_deg))
        found.append(_clocked(name, row, seconds))
        if last_s > first_s:
            found.append(_drifting(name, row, 0.5 * (first_s + last_s), 2 * sigma_deg / (last_s - first_s)))
        if all(times.places_m is None for times in every):
            found += [_placed(name, row, axis, spread) for axis in (0, 1)]
    return found


def pairs_of(errors: Sequence[SensorError]) -> list[SensorError]:
    """Return the north or clock of one sensor with that of another, and a north that is off and drifts."""
    parts = [error for error in errors if error.kind in {"north", "clock"} and len(error.sensors) == 1]
    apart = [_both(one, other) for one, other in combinations(parts, 2) if one.sensors != other.sensors]
    drifts = [error for error in errors if error.kind == "drift"]
    return apart + [
        _both(one, other) for other in drifts for one in parts if one.kind == "north" and one.sensors == other.sensors
    ]


def shifted(times: BearingSet, rows: Iterable[int], by: Array) -> BearingSet:
    """Turn the bearings of some sensors by angles ``(n,)`` [rad], one of each bearing."""
    return times._replace(azimuth_rad=times.azimuth_rad + np.where(np.isin(times.sensor, [*rows]), by, 0.0))


def _both(one: SensorError, other: SensorError) -> SensorError:
    cut = len(one.units)

    def says(sizes: Sizes) -> tuple[str, str]:
        (what, do), (also, more) = one.said(sizes[:cut]), other.said(sizes[cut:])
        return f"{what} and {also}", do if more == do else f"{do} {more}"

    def without(heard: Heard, sites: SensorSites, sizes: Sizes) -> Mended:
        return other.without(*one.without(heard, sites, sizes[:cut]), sizes[cut:])

    return SensorError(one.units + other.units, "both", one.sensors | other.sensors, says, without)


def _turned(who: str, rows: list[int], unit: float) -> SensorError:
    def says(sizes: Sizes) -> tuple[str, str]:
        way = "too large" if sizes[0] > 0 else "too small"
        remedy = "Look at how its north was found, or let it be estimated: --bias-sd-deg with --bias-memory-s 1e6."
        return f"{who} are {abs(sizes[0]):.2g} degrees {way}", remedy

    def without(heard: Heard, sites: SensorSites, sizes: Sizes) -> Mended:
        by = -math.radians(sizes[0])
        return [shifted(times, rows, np.full(len(times.sensor), by)) for times in heard], sites

    return SensorError((unit,), "north", frozenset(rows), says, without)


def _drifting(name: str, row: int, middle_s: float, unit: float) -> SensorError:
    def says(sizes: Sizes) -> tuple[str, str]:
        way = "clockwise" if sizes[0] > 0 else "anticlockwise"
        return (
            f"the north of sensor {name} drifts by {60 * abs(sizes[0]):.2g} degrees a minute {way}",
            f"Mend the heading of {name}, or let it be estimated: --bias-sd-deg with --bias-memory-s.",
        )

    def without(heard: Heard, sites: SensorSites, sizes: Sizes) -> Mended:
        rate = -math.radians(sizes[0])
        turned = [
            shifted(times, [row], np.full(len(times.sensor), rate * (times.time_s - middle_s))) for times in heard
        ]
        return turned, sites

    return SensorError((unit,), "drift", frozenset([row]), says, without)


def _clocked(name: str, row: int, unit: float) -> SensorError:
    def says(sizes: Sizes) -> tuple[str, str]:
        way = "late" if sizes[0] > 0 else "early"
        return (
            f"the bearings of sensor {name} come {abs(sizes[0]):.2g} s {way} beside the others'",
            f"Set the clock of {name}, or shift its times.",
        )

    def without(heard: Heard, sites: SensorSites, sizes: Sizes) -> Mended:
        parts = dict[float, list[BearingSet]]()
        for times in heard:
            ours = times.sensor == row
            for rows, time_s in ((~ours, times.time_s), (ours, times.time_s - sizes[0])):
                if rows.any():
                    parts.setdefault(time_s, []).append(_rows(times, rows))
        return [_joined(time_s, parts[time_s]) for time_s in sorted(parts)], sites

    return SensorError((unit,), "clock", frozenset([row]), says, without)


def _placed(name: str, row: int, axis: int, unit: float) -> SensorError:
    def says(sizes: Sizes) -> tuple[str, str]:
        way = (("west", "east"), ("south", "north"))[axis][sizes[0] > 0]
        return (
            f"sensor {name} stands {abs(sizes[0]):.2g} m further {way} than was told",
            f"Measure the place of {name}.",
        )

    def without(heard: Heard, sites: SensorSites, sizes: Sizes) -> Mended:
        places = sites.positions_m.copy()
        places[row, axis] += sizes[0]
        return heard, sites._replace(positions_m=places)

    return SensorError((unit,), "place", frozenset([row]), says, without)


def _rows(times: BearingSet, rows: Array) -> BearingSet:
    places = None if times.places_m is None else times.places_m[rows]
    return BearingSet(times.time_s, times.sensor[rows], times.azimuth_rad[rows], times.elevation_rad[rows], places)


def _joined(time_s: float, parts: list[BearingSet]) -> BearingSet:
    if len(parts) == 1:
        return parts[0]._replace(time_s=time_s)
    sensor, azimuth, elevation = (np.concatenate(of) for of in zip(*(part[1:4] for part in parts), strict=True))
    places = [part.places_m for part in parts if part.places_m is not None]
    return BearingSet(time_s, sensor, azimuth, elevation, np.concatenate(places) if places else None)
