"""Paths with the errors of sensors that their bearings tell: within their ellipses, where others are sure and wrong."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.metrics.consistency import squared_deviations
from elusive.sensors.bearing_sets import SensorSites
from elusive.systems.bearings.checks import judged
from elusive.systems.bearings.mended import mended
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.track import track
from tests.cli.test_bearing_checks import RIGHT, SIGMA_DEG, SITES_M, erring, flown, mathematical
from tests.longer import longer

SITES = SensorSites(("1", "2", "3"), np.column_stack([SITES_M, np.zeros(3)]))
ELSEWHERE = SITES._replace(positions_m=np.add(SITES.positions_m, [(0, 0, 0), (25, -10, 0), (0, 0, 0)]))
TRACKING = BearingTracking(sigma_deg=SIGMA_DEG, motion={"kind": "cv", "q": 1.0}, emitters={"kind": "one"})
TRUTH = RIGHT.flight().states[:, [0, 2]]


def wrong(steps):
    """Share of the times at which the truth lies beyond 99.99 % of the ellipse."""
    off = TRUTH[: len(steps)] - [step.tracks[0].mean[[0, 2]] for step in steps]
    spread = np.array([step.tracks[0].covariance[np.ix_([0, 2], [0, 2])] for step in steps])
    return np.mean(squared_deviations(off, spread) > 18.42)


DRAWN = {
    "elsewhere": (flown, ELSEWHERE, "sensor 2 stands"),
    "north": (lambda seed: erring(seed, turned_deg=12.0), SITES, "the azimuths of sensor 2 are 1"),
    "clock": (lambda seed: erring(seed, late=3), SITES, "the bearings of sensor 2 come"),
    "mathematical": (lambda seed: mathematical(flown(seed)), SITES, "anticlockwise from east"),
}


@pytest.mark.parametrize("name", longer(DRAWN, "north", "clock", "mathematical"))
def test_places_are_as_of_what_fits_best(name):
    draw, sites, what = DRAWN[name]
    steps = list(track(draw(3), TRACKING, sites))
    fault = judged(steps, TRACKING, sites).fault
    assert what in fault.what
    better = mended(steps, fault, TRACKING, sites)
    assert [step.time_s for step in better] == [step.time_s for step in steps]
    # two of 64 are beside sharp corners
    assert wrong(better) < 0.04 < wrong(steps)


def test_nothing_is_mended_of_a_right_recording():
    steps = list(track(flown(3), TRACKING, SITES))
    assert mended(steps, judged(steps, TRACKING, SITES).fault, TRACKING, SITES) == steps
