"""A track that one sensor alone hears tells no place: two may share one emitter's bearings."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.listeners import LEAST_TIMES, UNHEARD, UNLIKELY, UNTOLD, of_one_sensor
from elusive.systems.bearings.pairings import lowered
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.several_checks import crowd_scale
from elusive.tracking.track import Step, Track

SITES = SensorSites(("a", "b"), np.array([[-1000.0, 0.0, 0.0], [1000.0, 0.0, 0.0]]))
EMITTER, BEYOND, BEFORE = np.array([0.0, 1000.0]), np.array([800.0, 1800.0]), np.array([500.0, 500.0])
TOLD = BearingTracking(sigma_deg=0.3, emitters={"kind": "several"})
TIMES = 40


def heard(rng):
    """Bearings of the emitter, of which either sensor misses three in ten."""
    east, north = (EMITTER - SITES.positions_m[:, :2]).T
    for k in range(TIMES):
        sensor = np.flatnonzero(rng.random(2) < 0.7)
        azimuth = np.arctan2(east, north)[sensor] + np.radians(0.3) * rng.standard_normal(len(sensor))
        yield BearingSet(float(k), sensor.astype(np.intp), azimuth, np.full(len(sensor), np.nan))


def at(number, place, along=None):
    """A track that is known to 5 m across a direction, and to 300 m along it."""
    spread = 25.0 * np.eye(2)
    if along is not None:
        spread += (300.0**2 - 25.0) * np.outer(along, along) / (along @ along)
    covariance = np.diag([0.0, 1.0, 0.0, 1.0])
    covariance[np.ix_([0, 2], [0, 2])] = spread
    return Track(number, "confirmed", 1.0, np.array([place[0], 0.0, place[1], 0.0]), covariance)


@pytest.mark.parametrize(
    ("tracks", "alone"),
    [
        ((at(1, EMITTER),), ()),
        ((at(1, BEYOND, BEYOND - [-1000, 0]), at(2, BEFORE, BEFORE - [1000, 0])), (1, 2)),
    ],
)
def test_two_tracks_that_share_an_emitter_are_of_one_sensor_each(tracks, alone):
    steps = [Step(one.time_s, one, None, tracks) for one in heard(np.random.default_rng(1))]
    found = crowd_scale(steps, SITES, TOLD).alone
    assert found == alone
    for one in lowered(steps, dict.fromkeys(found, UNTOLD))[-1].tracks:
        assert (one.status, one.existence) == (("candidate", 0.5) if alone else ("confirmed", 1.0))


@pytest.mark.parametrize("near", range(0, 25, 4))
def test_a_sensor_hears_less_beyond_chance(near):
    times = 30
    by_sensor = {0: [1] * 27 + [0] * 3, 1: [1] * near + [0] * (times - near)}
    assert of_one_sensor({4: by_sensor}) == ((4,) if binom.cdf(near, times, UNHEARD * 0.9) < UNLIKELY else ())
    assert of_one_sensor({4: by_sensor | {2: by_sensor[0]}}) == ()  # two others hear it


def test_what_is_young_or_heard_by_the_one_that_listens_tells_nothing():
    assert of_one_sensor({1: {0: [1] * (LEAST_TIMES - 1), 1: [0] * 40}}) == ()
    assert of_one_sensor({1: {0: [1] * 40}}) == ()
