"""Why a track leaves its bearings: another convention of angles, more than one emitter, or another deviation."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.filters.gaussian.geolocation import Geolocation
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.choices import SeveralEmitters
from elusive.systems.bearings.faults import LEAST_TIMES, bias_of, evidence_of, fault_of, path_of, tried_with
from elusive.systems.bearings.fitting import better, fits, tracked
from elusive.systems.bearings.leftovers import Scale
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.several import track_several
from elusive.systems.bearings.turned import turned_sensor
from elusive.tracking.track import Step

TRIED_TIMES = 400  # of a recording's beginning, on which causes are tried
FEWEST, MOST = 3, 5  # sensors of which one alone may be read otherwise
TOGETHER, EXPLAINED, NEAR = 0.3, 0.7, 4.0  # share of the times with two tracks, of the bearings near one; deviations
HEARD_AT_TIMES, FALSE_AT_TIMES = 0.4, 0.5  # probability, and number
DEVIATIONS = (1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 14.0, 20.0, 30.0, 50.0)  # tried, of the one told
ALONE = 4.0  # times the deviation told up to which a greater one is no second emitter, where no fixes tell
FIXES, CROSSING = 8, 0.5  # times with a fix that are enough, and their deviation to the likeliest of one emitter
LIKELIER = 8.0  # of log evidence for another convention, by chance 3e-4 each
SIGMA_MOST_DEG = 60.0


class Cause(NamedTuple):
    """What a finding says of its cause, and what to do."""

    sentence: str
    remedy: str
    deviation_deg: float | None = None  # that explains it, where nothing else does


class Convention(NamedTuple):
    """How azimuths may be meant, and what they then are clockwise from north [rad]."""

    name: str
    remedy: str
    meant: Callable[[Array], Array]


CONVENTIONS = (
    Convention(
        "anticlockwise from east, or with the sensors' x and y exchanged",
        "Convert the azimuths (90 - azimuth), or exchange the columns x_m and y_m.",
        lambda azimuth: math.pi / 2 - azimuth,
    ),
    Convention(
        "from the emitter to the sensor", "Turn the azimuths by 180 degrees.", lambda azimuth: azimuth + math.pi
    ),
    Convention(
        "anticlockwise from north, or with x towards the west",
        "Change the sign of the azimuths, or of x_m.",
        lambda azimuth: -azimuth,
    ),
    Convention("clockwise from east", "Add 90 degrees to the azimuths.", lambda azimuth: azimuth + math.pi / 2),
    Convention("in radians", "Convert the azimuths to degrees.", lambda azimuth: np.rad2deg(azimuth)),
)
RADIANS = CONVENTIONS[-1]
ELEVATIONS = (
    Convention("from the zenith", "Convert the elevations (90 - elevation).", lambda angle: math.pi / 2 - angle),
    Convention("below the horizon", "Change the sign of the elevations.", lambda angle: -angle),
    Convention("in radians", "Convert the elevations to degrees.", lambda angle: np.rad2deg(angle)),
)


def reread(heard: Sequence[object], convention: Convention, sensor: int | None = None) -> list[BearingSet]:
    """Return bearings as another convention has them, of one sensor or of all."""
    return [
        times._replace(
            azimuth_rad=np.where(
                (times.sensor == sensor) | (sensor is None), convention.meant(times.azimuth_rad), times.azimuth_rad
            )
        )
        for times in heard
        if isinstance(times, BearingSet)
    ]


def _conventions(heard: Sequence[BearingSet]) -> Iterator[tuple[Cause, list[BearingSet]]]:
    """Other ways to read all bearings."""
    for convention in CONVENTIONS:
        yield Cause(f"the azimuths are read {convention.name}", convention.remedy), reread(heard, convention)
    if any(np.isfinite(times.elevation_rad).any() for times in heard):
        for convention in ELEVATIONS:
            other = [times._replace(elevation_rad=convention.meant(times.elevation_rad)) for times in heard]
            yield Cause(f"the elevations are read {convention.name}", convention.remedy), other


def _readings(heard: Sequence[BearingSet], sites: SensorSites) -> Iterator[tuple[Cause, list[BearingSet]]]:
    """Other ways to read bearings: all of them, those of one sensor, or two sensors under each other's names."""
    yield from _conventions(heard)
    used = np.unique(np.concatenate([times.sensor for times in heard])).tolist()
    if not FEWEST <= len(used) <= MOST or any(times.places_m is not None for times in heard):
        return
    for number in used:
        for convention in CONVENTIONS:
            which = f"the azimuths of sensor {sites.names[number]} alone are read {convention.name}"
            yield Cause(which, convention.remedy), reread(heard, convention, number)
    for one, other in combinations(used, 2):
        names = f"sensors {sites.names[one]} and {sites.names[other]}"
        rows = np.arange(len(sites.names))
        rows[[one, other]] = other, one
        exchanged = [times._replace(sensor=rows[times.sensor]) for times in heard]
        yield Cause(f"{names} are exchanged", f"Exchange the names of {names}, or their places."), exchanged


def cause_of(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, scale: Scale) -> Cause:
    """Say why one emitter's track leaves its bearings further than their deviation allows."""
    heard = [step.measurement for step in steps[:TRIED_TIMES]]
    if all(isinstance(times, BearingSet) for times in heard):
        read = reading_of(steps, parameters, sites, scale)
        if read is not None:
            return read
        fault = fault_of([steps], parameters, sites)
        if fault is not None and fault.fits:
            return Cause(f"they fit if {fault.what}", fault.remedy)
        likeliest = _likeliest(heard, parameters, sites)
        if of_several(steps, likeliest, parameters, sites):
            return Cause(
                "they are of more than one emitter, as two tracks or more explain them",
                "Do not rely on the track; take --emitters several.",
            )
        if likeliest is not None:
            return Cause(
                f"they fit with a deviation of {likeliest:.2g} degrees; the ellipses are too small",
                f"Tell --sigma-deg {likeliest:.2g}, or find it by elusive fit bearings.",
                likeliest,
            )
    return Cause(
        "they are of another emitter, or less precise than was told, or sensors stand elsewhere",
        "Do not rely on the track; look at the sensors' places and clocks. --emitters several follows more than one.",
    )


def reading_of(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, scale: Scale) -> Cause | None:
    """Return another way to read the bearings, which fits far better; None where there is none."""
    heard = [step.measurement for step in steps[:TRIED_TIMES]]
    radians = in_radians(steps, parameters, sites)
    if radians is not None:
        return radians
    read = [(tracked(other, parameters, sites)[1], cause) for cause, other in _readings(heard, sites)]
    fitting = [(one, cause) for one, cause in read if one is not None and better(one, scale)]
    if fitting:
        other, cause = min(fitting, key=lambda one: one[0].half)
        return Cause(f"they fit, to {other.half:.2g} times, if {cause.sentence}", cause.remedy)
    turned = turned_sensor(heard, parameters, sites, scale)
    return None if turned is None else Cause(*turned)


def of_several(
    steps: Sequence[Step], likeliest_deg: float | None, parameters: BearingTracking, sites: SensorSites
) -> bool:
    """Say whether several emitters explain bearings, and not rather one of a greater deviation."""
    heard = [step.measurement for step in steps[:TRIED_TIMES]]
    return not _one_scatters(heard, likeliest_deg, parameters, sites) and several_explain(heard, parameters, sites)


def convention_finding(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, said: str) -> Finding:
    """Check that bearings that fit as they are read fit no better in another way, by the evidence of the path.

    Where sensors stand nearly in a line from north to south an emitter in the east and one in the west differ little.
    """
    heard = [step.measurement for step in steps[:TRIED_TIMES] if isinstance(step.measurement, BearingSet)]
    gain, best = 0.0, Cause("", "")
    base = _most_evidence(heard, parameters, sites) if len(heard) >= LEAST_TIMES else -math.inf
    if base > -math.inf:
        for cause, other in _conventions(heard):
            rise = _most_evidence(other, parameters, sites) - base
            if rise > gain:
                gain, best = rise, cause
    radians = in_radians(steps, parameters, sites) if gain > LIKELIER else None
    if radians is not None:  # so close together that most readings nearly fit
        return Finding(
            "bearings.convention",
            False,
            0.0,
            gain,
            f"{said}The bearings fit many readings: {radians.sentence}.",
            radians.remedy,
        )
    return Finding(
        "bearings.convention", gain <= LIKELIER, 0.0, gain,
        f"{said}The bearings fit, and fit better (their log evidence rises by {gain:.0f}) if {best.sentence}: then the "
        "emitter is elsewhere.", best.remedy,
    )  # fmt: skip


def _most_evidence(heard: Sequence[BearingSet], parameters: BearingTracking, sites: SensorSites) -> float:
    """Return the log evidence of a path, with the errors of sensors that were found or with none."""
    ways = [tried_with(parameters, biased=False)]
    ways += [tried_with(parameters)] if bias_of(parameters) is not None else []
    paths = (path_of(heard, asked, sites) for asked in ways)
    return max((evidence_of(path) for path in paths if path is not None), default=-math.inf)


def in_radians(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites) -> Cause | None:
    """Say that azimuths are radians, if no number is beyond a turn of them and they fit so.

    As degrees such numbers lie so close together that most readings nearly fit: each is 57 times likelier as a radian.
    """
    heard = [step.measurement for step in steps[:TRIED_TIMES] if isinstance(step.measurement, BearingSet)]
    if not heard or len(set[int]().union(*(set(times.sensor.tolist()) for times in heard))) < 2:
        return None  # whatever one sensor alone says fits
    numbers = np.abs(np.rad2deg(wrapped(np.concatenate([times.azimuth_rad for times in heard]))))
    if numbers.max() > 2 * math.pi:
        return None
    scale = tracked(reread(heard, RADIANS), parameters, sites)[1]
    if scale is None or not fits(scale):
        return None
    return Cause(f"they fit, to {scale.half:.2g} times, if the azimuths are read {RADIANS.name}", RADIANS.remedy)


def several_explain(heard: Sequence[object], parameters: BearingTracking, sites: SensorSites) -> bool:
    """Say whether two tracks or more at a time explain the bearings."""
    # an emitter may be heard at some of the times alone
    several = SeveralEmitters(detection_probability=HEARD_AT_TIMES, false_bearings=FALSE_AT_TIMES)
    asked = parameters.replace(motion=parameters.plain_motion, emitters=several)
    places, sigma = sites.positions_m[:, :2], math.radians(parameters.deviation_deg)
    together, near, count, times = 0, 0, 0, 0
    for step in track_several(heard, asked, sites):  # type: ignore[arg-type]
        sure = np.array([track.mean[[X, Y]] for track in step.tracks if track.status == "confirmed"]).reshape(-1, 2)
        times, together = times + 1, together + (len(sure) > 1)
        if len(sure) and times > len(heard) / 4:
            off = sure[None] - places[step.measurement.sensor][:, None]
            angle = np.arctan2(off[..., 0], off[..., 1])
            away = np.abs(wrapped(step.measurement.azimuth_rad[:, None] - angle)).min(axis=1)
            near, count = near + int((away < NEAR * sigma).sum()), count + len(away)
    return together > TOGETHER * times and near > EXPLAINED * max(count, 1)


def _one_scatters(
    heard: Sequence[BearingSet], likeliest_deg: float | None, parameters: BearingTracking, sites: SensorSites
) -> bool:
    """Say whether one emitter's bearings of a greater deviation are likelier than several emitters'.

    Where three sensors or more hear one emitter, their lines miss a point of their own time by their deviation,
    wherever it goes: several emitters leave a quarter of the times, at least, too close for that.
    """
    if likeliest_deg is None:
        return False
    missed = []
    for times in heard:
        places = sites.positions_m[times.sensor] if times.places_m is None else times.places_m
        if len(times.sensor) > 2:
            with contextlib.suppress(DataError):  # lines that meet nowhere
                fix = Geolocation().locate(times.azimuth_rad, places[:, :2])
                missed.append((fix.residuals_rad**2).sum() / chdtri(len(times.sensor) - 2, 0.75))
    if len(missed) < FIXES:
        return likeliest_deg < ALONE * parameters.deviation_deg
    return math.degrees(math.sqrt(np.quantile(missed, 0.25))) > CROSSING * likeliest_deg


def _likeliest(heard: Sequence[object], parameters: BearingTracking, sites: SensorSites) -> float | None:
    """Return the deviation of most evidence, if the bearings then lie about the track as it says [deg]."""
    tried = [
        times * parameters.deviation_deg for times in DEVIATIONS if times * parameters.deviation_deg <= SIGMA_MOST_DEG
    ]
    found = [(sigma_deg, tracked(heard, parameters.replace(sigma_deg=sigma_deg), sites)) for sigma_deg in tried]
    known = [(steps[-1].state.log_evidence, sigma_deg, scale) for sigma_deg, (steps, scale) in found if steps]
    known = [row for row in known if math.isfinite(row[0])]
    if not known:
        return None
    _, sigma_deg, scale = max(known, key=lambda row: row[0])
    # a robust loss, heavier in its tails than the noise, likes a smaller one best
    return sigma_deg * max(scale.half, 1.0) if scale is not None and not scale.wide else None
