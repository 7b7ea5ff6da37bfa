"""Why a track leaves its bearings: another convention of angles, more than one emitter, or another deviation."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from elusive.contracts import X, Y
from elusive.errors import DataError
from elusive.filters.gaussian.geolocation import Geolocation
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.choices import SeveralEmitters
from elusive.systems.bearings.faults import Fault, fault_of
from elusive.systems.bearings.fitting import tracked
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.settled import ROUNDS, scattered
from elusive.systems.bearings.several import track_several
from elusive.tracking.track import Step


class Cause(NamedTuple):
    """What a finding says of its cause, and what to do."""

    sentence: str
    remedy: str


TRIED_TIMES = 400  # of a recording's beginning, on which causes are tried
TOGETHER, EXPLAINED, NEAR = 0.3, 0.7, 4.0  # share of the times with two tracks, of the bearings near one; deviations
HEARD_AT_TIMES, FALSE_AT_TIMES = 0.4, 0.5  # probability, and number
ALONE = 4.0  # times the deviation told up to which a greater one is no second emitter, where no fixes tell
FIXES, CROSSING = 8, 0.5  # times with a fix that are enough, and their deviation to the likeliest of one emitter
SIGMA_MOST_DEG = 60.0


def cause_of(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites) -> tuple[Cause, Fault | None]:
    """Say why one emitter's track leaves its bearings further than their deviation allows; and with which sensor."""
    heard = [step.measurement for step in steps[:TRIED_TIMES]]
    if all(isinstance(times, BearingSet) for times in heard):
        fault = fault_of([steps], parameters, sites)
        if fault is not None and fault.fits:
            return Cause(f"they fit if {fault.what}", fault.remedy), fault
        likeliest = _likeliest(heard, parameters, sites)
        if of_several(steps, likeliest, parameters, sites):
            cause = Cause(
                "they are of more than one emitter, as two tracks or more explain them",
                "Do not rely on the track; take --emitters several.",
            )
            return cause, None
        if likeliest is not None:
            cause = Cause(
                f"they fit with a deviation of {likeliest:.2g} degrees; the ellipses are too small",
                f"Tell --sigma-deg {likeliest:.2g}, or find it by elusive fit bearings.",
            )
            return cause, None
    cause = Cause(
        "they are of another emitter, or less precise than was told, or sensors stand elsewhere",
        "Do not rely on the track; look at the sensors' places and clocks. --emitters several follows more than one.",
    )
    return cause, None


def of_several(
    steps: Sequence[Step], likeliest_deg: float | None, parameters: BearingTracking, sites: SensorSites
) -> bool:
    """Say whether several emitters explain bearings, and not rather one of a greater deviation."""
    heard = [step.measurement for step in steps[:TRIED_TIMES]]
    return not _one_scatters(heard, likeliest_deg, parameters, sites) and several_explain(heard, parameters, sites)


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


def _likeliest(heard: Sequence[BearingSet], parameters: BearingTracking, sites: SensorSites) -> float | None:
    """Return the deviation by which bearings lie about their path, if they then lie as it says [deg]."""
    for _ in range(ROUNDS):
        parameters = parameters.replace(sigma_deg=scattered(parameters, sites, [heard]))
    scale = tracked(heard, parameters, sites)[1]
    fits = scale is not None and not scale.wide and parameters.deviation_deg < SIGMA_MOST_DEG
    return parameters.deviation_deg if fits else None
