"""Errors that a sensor may have, and bearings as they were without: its north, a drift of it, its clock, its place."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import VX, VY, Array, X, Y
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.heard import part_of
from elusive.tracking.track import Step

Heard = list[BearingSet]
Sizes = tuple[float, ...]
Mended = tuple[Heard, SensorSites]


class SensorError(NamedTuple):
    """An error that a sensor or all may have."""

    units: Sizes  # that are tried first
    kind: str
    said: Callable[[Sizes], tuple[str, str]]  # what is wrong, and what to do
    without: Callable[[Heard, SensorSites, Sizes], Mended]
    rows: tuple[int, ...] = ()  # of the sensors that err, where it is not all
    first: Sizes = ()  # where a search may begin as well as at nought
    likelier: float = 0.0  # log likelihood that each bearing gains since numbers then are further apart


def errors_of(
    heard: Sequence[Heard],
    base: Sequence[Sequence[Step]],
    sites: SensorSites,
    used: list[int],
    sigma_deg: float,
    without: Mapping[int, Sequence[Sequence[Step]]],
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
    without
        Paths by all others of some sensors.
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
            found.append(_drifting(name, row, 0.5 * (first_s + last_s), 2 * sigma_deg / (last_s - first_s), sigma_deg))
        if all(times.places_m is None for times in every):
            there = _resected(heard, without[row], row) if row in without else sites.positions_m[row, :2]
            found.append(_placed(name, row, spread)._replace(first=tuple(there - sites.positions_m[row, :2])))
    return found


def shifted(times: BearingSet, rows: Iterable[int], by: Array) -> BearingSet:
    """Turn the bearings of some sensors by angles ``(n,)`` [rad], one of each bearing."""
    return times._replace(azimuth_rad=times.azimuth_rad + np.where(np.isin(times.sensor, [*rows]), by, 0.0))


def also_at(times_s: Iterable[float], heard: Heard) -> Heard:
    """Return bearings, none at those times that lack them: a clock that is set has times of its own."""
    none = (np.empty(0, np.intp), np.empty(0), np.empty(0))
    gone = sorted({*times_s} - {times.time_s for times in heard})
    return sorted([*heard, *(BearingSet(time_s, *none) for time_s in gone)], key=lambda times: times.time_s)


def _turned(who: str, rows: list[int], unit: float) -> SensorError:
    def says(sizes: Sizes) -> tuple[str, str]:
        way = "too large" if sizes[0] > 0 else "too small"
        remedy = "Look at how its north was found, or let it be estimated: --bias-sd-deg with --bias-memory-s 1e6."
        return f"{who} are {abs(sizes[0]):.2g} degrees {way}", remedy

    def without(heard: Heard, sites: SensorSites, sizes: Sizes) -> Mended:
        by = -math.radians(sizes[0])
        return [shifted(times, rows, np.full(len(times.sensor), by)) for times in heard], sites

    return SensorError((unit,), "north", says, without, tuple(rows))


def _drifting(name: str, row: int, middle_s: float, rate: float, off: float) -> SensorError:
    def says(sizes: Sizes) -> tuple[str, str]:
        way = "clockwise" if sizes[0] > 0 else "anticlockwise"
        return (
            f"the north of sensor {name} drifts by {60 * abs(sizes[0]):.2g} degrees a minute {way}",
            f"Mend the heading of {name}, or let it be estimated: --bias-sd-deg with --bias-memory-s.",
        )

    def without(heard: Heard, sites: SensorSites, sizes: Sizes) -> Mended:
        by = [-math.radians(sizes[0] * (times.time_s - middle_s) + sizes[1]) for times in heard]
        turned = [shifted(one, [row], np.full(len(one.sensor), by_rad)) for one, by_rad in zip(heard, by, strict=True)]
        return turned, sites

    return SensorError((rate, off), "drift", says, without, (row,))


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
                    parts.setdefault(time_s, []).append(part_of(times, rows))
        return [_joined(time_s, parts[time_s]) for time_s in sorted(parts)], sites

    return SensorError((unit,), "clock", says, without, (row,))


def _placed(name: str, row: int, unit: float) -> SensorError:
    def says(sizes: Sizes) -> tuple[str, str]:
        east, north = (
            f"{abs(size):.2g} m further {ways[size > 0]}"
            for size, ways in zip(sizes, (("west", "east"), ("south", "north")), strict=True)
        )
        return f"sensor {name} stands {east} and {north} than was told", f"Measure the place of {name}."

    def without(heard: Heard, sites: SensorSites, sizes: Sizes) -> Mended:
        places = sites.positions_m.copy()
        places[row, :2] += sizes
        return heard, sites._replace(positions_m=places)

    return SensorError((unit, unit), "place", says, without, (row,))


def _resected(heard: Sequence[Heard], paths: Sequence[Sequence[Step]], row: int) -> Array:
    """Return where a sensor would stand by what it hears of paths, ``(2,)``: its lines back from these meet there."""
    rows, right = list[Array](), list[float]()
    for part, path in zip(heard, paths, strict=True):
        places = {step.time_s: step.tracks[0].mean[[X, Y]] for step in path}
        for times in part:
            for azimuth in times.azimuth_rad[times.sensor == row].tolist() if times.time_s in places else ():
                rows.append(np.array([math.cos(azimuth), -math.sin(azimuth)]))
                right.append(float(rows[-1] @ places[times.time_s]))
    return np.asarray(np.linalg.lstsq(np.array(rows), np.array(right))[0]) if len(rows) > 1 else np.full(2, math.nan)


def swinging(name: str, row: int) -> SensorError:
    """Return an error of one sensor that leaves its bearings as likely in any direction."""

    def says(sizes: Sizes) -> tuple[str, str]:
        return (
            f"the azimuths of sensor {name} are turned by angles that change, as the others fit without it: they are "
            "from a bow that turns, or its heading, its place or its clock is wrong",
            f"Add the heading of each time to the azimuths of {name}, or leave {name} out.",
        )

    def without(heard: Heard, sites: SensorSites, sizes: Sizes) -> Mended:
        parts = [(times, times.sensor != row) for times in heard]
        return [part_of(times, kept) for times, kept in parts if kept.any()], sites

    return SensorError((), "any", says, without, (row,))


def _joined(time_s: float, parts: list[BearingSet]) -> BearingSet:
    if len(parts) == 1:
        return parts[0]._replace(time_s=time_s)
    sensor, azimuth, elevation = (np.concatenate(of) for of in zip(*(part[1:4] for part in parts), strict=True))
    places = [part.places_m for part in parts if part.places_m is not None]
    return BearingSet(time_s, sensor, azimuth, elevation, np.concatenate(places) if places else None)
