"""What is wrong with one sensor, where all fit together only roughly: its north, its clock, its place.

Three bearings of a time are one more than a place needs, and as an emitter moves these tell each sensor's systematic
error. Each error is tried by the evidence of the path with and without it (MacKay, 2003, section 28.1), to second order
in its size.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.errors import ElusiveError
from elusive.metrics.consistency import squared_deviations
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import Cruise, Estimation, Interacting, OneEmitter, Turn
from elusive.systems.bearings.given import turning
from elusive.systems.bearings.leftovers import leftovers, scale_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.track import track
from elusive.tracking.track import Step

TIMES, SENSORS = 200, 8  # of the recording's middle; sensors at most
LEAST_TIMES = 12
GAIN = 15.0  # of log evidence, by chance 4e-8 each, and 1e-3 where errors persist a little
MOVED = 1.0  # deviations that the path moves, from which its ellipses are wrong
ALIKE = 0.7  # of the gain, with which another error may be it as well
LONGEST = 2000  # times, of a motion that is tried
FREER = 4.0  # times the power of the motion's noise that is tried
MANOEUVRES, HARDLY = 20.0, 0.5  # of log evidence (flights with sharp corners reach 14), and deviations of the path
ROUNDS = 2  # steps of the search for a size

Heard = list[BearingSet]


class Fault(NamedTuple):
    """An error that explains what the sensors leave."""

    what: str  # what is said of it, with its size
    remedy: str
    gain: float  # of log evidence
    moved: float  # how far the path lies off without it, in its deviations
    fits: bool  # whether nothing is left to be explained


class _Trial(NamedTuple):
    unit: float  # size that is tried first
    said: Callable[[float], tuple[str, str]]
    heard: Callable[[float], tuple[Heard, SensorSites]]


def tried_with(parameters: BearingTracking) -> BearingTracking | None:
    """Return what a path is estimated with to try an error of a sensor; None: a bias is estimated already."""
    motion = Cruise() if isinstance(parameters.motion, Interacting) else parameters.motion
    asked = parameters.replace(motion=motion, emitters=OneEmitter()).by("map")
    return asked if isinstance(asked.filter, Estimation) and asked.filter.bias is None else None


def fault_of(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites) -> Fault | None:
    """Return the error of a sensor that explains an emitter's bearings best, if one does and matters.

    Parameters
    ----------
    steps
        Of one emitter.
    parameters, sites
        What it was tracked with.
    """
    start = max(0, (len(steps) - TIMES) // 2)
    heard: Heard = [step.measurement for step in steps[start : start + TIMES]]
    if len(heard) < LEAST_TIMES or not all(isinstance(times, BearingSet) for times in heard):
        return None
    used = np.unique(np.concatenate([times.sensor for times in heard])).tolist()
    if not 3 <= len(used) <= SENSORS:
        return None
    asked = tried_with(parameters)
    if asked is None or not isinstance(asked.filter, Estimation):
        return None
    base = path_of(heard, asked, sites)
    if base is None:
        return None
    found = list[tuple[float, float, list[Step], _Trial]]()
    for trial in _trials(heard, base, sites, used, parameters.sigma_deg):
        sized = _sized(trial, asked, base)
        if sized is not None and sized[1] > GAIN:
            found.append((*sized, trial))
    if not found:
        return None
    found.sort(key=lambda one: -one[1])
    size, gain, path, trial = found[0]
    what, remedy = trial.said(size)
    # over a short path a turned sensor looks like one that stands elsewhere
    others = [one[-1].said(one[0])[0] for one in found[1:] if one[1] > ALIKE * gain]
    sensor = asked.sensor_of(trial.heard(size)[1], BearingSet, "z" in base[0].state.state_names)
    fits = not scale_of(leftovers(path, sensor, asked.filter)).wide
    fault = Fault(", or ".join([what, *others[:1]]), remedy, gain, apart_by(base, path), fits)
    return fault if fault.moved > MOVED else None


def motion_finding(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, said: str) -> Finding:
    """Check that the emitter moves as it may, by the evidence of its path where it may manoeuvre more."""
    heard = [step.measurement for step in steps[:LONGEST]]
    motion = parameters.motion
    gain = moved = 0.0
    if len(heard) >= LEAST_TIMES and not isinstance(motion, Interacting | Turn):
        asked = parameters.replace(emitters=OneEmitter()).by("map")
        freer = asked.replace(motion=motion.replace(q=FREER * motion.q))
        base, other = path_of(heard, asked, sites), path_of(heard, freer, sites)
        if base is not None and other is not None:
            gain, moved = evidence_of(other) - evidence_of(base), apart_by(base, other)
    return Finding(
        "bearings.motion", gain <= MANOEUVRES or moved <= HARDLY, 0.0, gain,
        f"{said}The emitter turns harder than the motion allows: with {FREER:g} times the --q the bearings' log "
        f"evidence rises by {gain:.0f}, and the path moves by {moved:.1f} of its deviations. Corners are cut, and the "
        "ellipses there too small.", f"Tell --q {FREER * getattr(motion, 'q', math.nan):.3g} or more; "
        "elusive fit bearings finds it.",
    )  # fmt: skip


def fault_finding(fault: Fault | None, said: str) -> Finding:
    """Say which sensor errs, and how."""
    what, remedy = (fault.what, fault.remedy) if fault else ("", "")
    moved, gain = (fault.moved, fault.gain) if fault else (0.0, 0.0)
    return Finding(
        "bearings.sensors", fault is None, 0.0, moved,
        f"{said}The bearings together say that {what} (their log evidence rises by {gain:.0f}): as it is the path lies "
        f"{moved:.1f} of its deviations off, and its ellipses cannot be trusted.", remedy,
    )  # fmt: skip


def _trials(heard: Heard, base: list[Step], sites: SensorSites, used: list[int], sigma_deg: float) -> list[_Trial]:
    """Return all errors that are tried."""
    spread = float(np.median([math.sqrt(step.tracks[0].covariance[X, X]) for step in base]))
    rates = [turning(times, step.tracks[0].mean, sites) for times, step in zip(heard, base, strict=True)]
    fastest = float(np.median(np.abs(np.concatenate(rates)))) or 1e-9
    trials = []
    whose: list[tuple[str, list[int]]] = [(sites.names[row], [row]) for row in used]
    for name, rows in [*whose, ("", used)]:

        def turned(size: float, rows: list[int] = rows) -> tuple[Heard, SensorSites]:
            return [shifted(times, rows, np.full(len(times.sensor), -math.radians(size))) for times in heard], sites

        def clocked(size: float, rows: list[int] = rows) -> tuple[Heard, SensorSites]:
            later = zip(heard, rates, strict=True)
            return [shifted(times, rows, size * rate) for times, rate in later], sites

        who = f"the azimuths of sensor {name}" if name else "all azimuths"
        trials.append(_Trial(sigma_deg, lambda size, who=who: _says_turned(who, size), turned))  # type: ignore[misc]
        if name:
            unit = math.radians(sigma_deg) / fastest
            trials.append(_Trial(unit, lambda size, name=name: _says_clocked(name, size), clocked))  # type: ignore[misc]
            if all(times.places_m is None for times in heard):
                trials += [_placed(name, rows[0], axis, spread, heard, sites) for axis in (0, 1)]
    return trials


def _placed(name: str, row: int, axis: int, unit: float, heard: Heard, sites: SensorSites) -> _Trial:
    def moved(size: float) -> tuple[Heard, SensorSites]:
        places = sites.positions_m.copy()
        places[row, axis] += size
        return heard, sites._replace(positions_m=places)

    def says(size: float) -> tuple[str, str]:
        way = ("east" if size > 0 else "west") if axis == 0 else ("north" if size > 0 else "south")
        return f"sensor {name} stands {abs(size):.2g} m further {way} than was told", f"Measure the place of {name}."

    return _Trial(unit, says, moved)


def _says_turned(who: str, size: float) -> tuple[str, str]:
    way = "too large" if size > 0 else "too small"
    remedy = "Look at how its north was found, or let it be estimated: --bias-sd-deg with --bias-memory-s 1e6."
    return f"{who} are {abs(size):.2g} degrees {way}", remedy


def _says_clocked(name: str, size: float) -> tuple[str, str]:
    way = "late" if size > 0 else "early"
    return (
        f"the bearings of sensor {name} come {abs(size):.2g} s {way}",
        f"Set the clock of {name}, or shift its times.",
    )


def shifted(times: BearingSet, rows: list[int], by: Array) -> BearingSet:
    """Turn the bearings of some sensors by angles ``(n,)`` [rad], one of each bearing."""
    return times._replace(azimuth_rad=times.azimuth_rad + np.where(np.isin(times.sensor, rows), by, 0.0))


def _sized(trial: _Trial, asked: BearingTracking, base: list[Step]) -> tuple[float, float, list[Step]] | None:
    """Return the size of most evidence, what is gained by it, and the path with it."""
    at, unit, begun = 0.0, trial.unit, evidence_of(base)
    level, best = begun, base
    for _ in range(ROUNDS):
        sides = [path_of(*_of(trial, at + way * unit, asked)) for way in (1.0, -1.0)]
        if sides[0] is None or sides[1] is None:
            return None
        up, down = evidence_of(sides[0]), evidence_of(sides[1])
        bend = 2 * level - up - down
        step = 0.5 * (up - down) / bend if bend > 0 else math.copysign(3.0, up - down)
        if bend > 0 and level - begun + 0.5 * step**2 * bend < 0.5 * GAIN:
            return None
        at += min(max(step, -6.0), 6.0) * unit
        there = path_of(*_of(trial, at, asked))
        if there is None:
            return None
        level, best = evidence_of(there), there
        unit *= 0.5
    return at, level - begun, best


def _of(trial: _Trial, size: float, asked: BearingTracking) -> tuple[Heard, BearingTracking, SensorSites]:
    heard, sites = trial.heard(size)
    return heard, asked, sites


def path_of(heard: Sequence[PlaceSet], asked: BearingTracking, sites: SensorSites) -> list[Step] | None:
    """Track one emitter; None where that cannot be done."""
    try:
        steps = list(track(heard, asked, sites))
    except ElusiveError:
        return None
    return steps if math.isfinite(evidence_of(steps)) and all(step.tracks for step in steps) else None


def evidence_of(steps: list[Step]) -> float:
    """Log evidence of a path."""
    return float(steps[-1].state.log_evidence)


def apart_by(base: list[Step], other: list[Step]) -> float:
    """How far two paths lie apart, in deviations of the first."""
    ground = np.ix_([X, Y], [X, Y])
    off = np.array([a.tracks[0].mean[[X, Y]] - b.tracks[0].mean[[X, Y]] for a, b in zip(base, other, strict=True)])
    spread = np.array([step.tracks[0].covariance[ground] for step in base])
    return math.sqrt(float(np.mean(squared_deviations(off, spread))) / 2)
