"""Why a track leaves its bearings: another convention of angles, more than one emitter, or another deviation."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence

import numpy as np
from scipy.special import chdtri

from elusive.checks import Finding
from elusive.contracts import X, Y
from elusive.errors import DataError
from elusive.filters.gaussian.geolocation import Geolocation
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.choices import SeveralEmitters
from elusive.systems.bearings.faults import LEAST_TIMES, fault_of
from elusive.systems.bearings.fitting import (
    BETTER,
    FITS_FAR,
    FITS_HALF,
    better,
    bias_of,
    evidence_of,
    fits,
    path_of,
    tracked,
    tried_with,
)
from elusive.systems.bearings.leftovers import FEW, Scale
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.readings import RADIANS, Cause, conventions, readings, reread
from elusive.systems.bearings.several import track_several
from elusive.systems.bearings.turned import turned_sensor
from elusive.tracking.track import Step

TRIED_TIMES = 400  # of a recording's beginning, on which causes are tried
TOGETHER, EXPLAINED, NEAR = 0.3, 0.7, 4.0  # share of the times with two tracks, of the bearings near one; deviations
HEARD_AT_TIMES, FALSE_AT_TIMES = 0.4, 0.5  # probability, and number
DEVIATIONS = (1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 14.0, 20.0, 30.0, 50.0)  # tried, of the one told
ALONE = 4.0  # times the deviation told up to which a greater one is no second emitter, where no fixes tell
FIXES, CROSSING = 8, 0.5  # times with a fix that are enough, and their deviation to the likeliest of one emitter
THIN, HOPELESS, NEARLY = 20, 10.0, 2.0  # times; log evidence by which these may fall short; times that a fit may err
LIKELIER = 8.0  # of log evidence for another convention, by chance 3e-4 each
SIGMA_MOST_DEG = 60.0


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
    # what lies far less often may be any size in the median
    most = NEARLY * scale.half / BETTER if scale.far <= FITS_FAR else math.inf
    likely = (one for one in readings(heard, sites) if _may_fit(one[1], parameters, sites, most))
    read = [(tracked(other, parameters, sites)[1], cause) for cause, other in likely]
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
        few = _most_evidence(_thinned(heard), parameters, sites)
        for cause, other in conventions(heard):
            if _most_evidence(_thinned(other), parameters, sites) < few - HOPELESS:
                continue
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


def _thinned(heard: Sequence[BearingSet]) -> Sequence[BearingSet]:
    """Return some of the times, evenly spread, by which most readings are seen to be wrong."""
    return heard[:: max(len(heard) // THIN, 1)]


def _may_fit(
    heard: Sequence[BearingSet], parameters: BearingTracking, sites: SensorSites, most: float = math.inf
) -> bool:
    """Say whether bearings of some of the times nearly fit, their residuals ``most`` in the median, or are too few."""
    scale = tracked(_thinned(heard), parameters, sites)[1]
    return scale is not None and (scale.number < FEW or scale.half < min(NEARLY * FITS_HALF, most))


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
    read = reread(heard, RADIANS)
    scale = tracked(read, parameters, sites)[1] if _may_fit(read, parameters, sites) else None
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
