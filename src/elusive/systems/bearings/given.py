"""Whether places and azimuths are given as they are told: sensors in metres, directions not rounded to wide steps."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.leftovers import FEW
from elusive.systems.bearings.parameters import BearingTracking
from elusive.tracking.track import Step

DEGREES_MOST, DEGREES_APART = 5.0, 5.0  # extent of sensors in degrees, and how much further off (0, 0) is
STEPS_DEG = (
    0.1,
    0.2,
    0.25,
    0.5,
    1.0,
    2.0,
    2.5,
    5.0,
    10.0,
    15.0,
    22.5,
    30.0,
    45.0,
    90.0,
)  # that azimuths are rounded to
COARSE = 2.0  # deviations of a bearing: steps up to which rounding is a small part of it


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


def rounding_finding(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, said: str = "") -> Finding:
    """Check that no sensor's azimuths are rounded to steps of more than their deviation allows."""
    heard = [step.measurement for step in steps if isinstance(step.measurement, BearingSet)]
    sensors = np.concatenate([np.empty(0, np.intp), *(times.sensor for times in heard)])
    degrees = np.rad2deg(np.concatenate([np.empty(0), *(times.azimuth_rad for times in heard)]))
    widest, name = 0.0, ""
    for number in np.unique(sensors).tolist():
        its = degrees[(sensors == number) & np.isfinite(degrees)]
        whole = [step for step in STEPS_DEG if np.abs(its / step - np.round(its / step)).max(initial=0.0) < 1e-5]
        if len(its) >= FEW and np.ptp(np.round(its, 6)) > 0 and whole and whole[-1] > widest:
            widest, name = whole[-1], sites.names[number]
    sigma = parameters.sigma_deg
    return Finding(
        "bearings.rounding", widest <= COARSE * sigma, sigma, widest,
        f"{said}All azimuths of sensor {name} are whole multiples of {widest:g} degrees, and --sigma-deg "
        f"{sigma:g} is told: rounding alone has a deviation of {widest / math.sqrt(12):.2g}, and errs alike for as "
        "long as the direction stays within a step.",
        f"Tell --sigma-deg {math.hypot(sigma, widest / 2):.2g}, or take azimuths of more digits.",
        grave=widest > math.sqrt(12) * sigma,
    )  # fmt: skip
