"""A real drone seen by three cameras on the ground: accuracy, honesty and gaps, against its measured track."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.io.bearings import open_bearings
from elusive.io.sensor_files import read_sensors
from elusive.motion import ConstantVelocity
from elusive.motion.altitude import WithAltitude
from elusive.sensors.bearings import BearingSensors
from tests.charts.shapes import DATA
from tests.longer import longer

FOLDER = DATA / "bearings" / "drone3"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no recording of a drone at {FOLDER}")
PLACE = [0, 2, 4]
CHI2_95 = 7.8147  # of three degrees of freedom
MOTION = WithAltitude(motion=ConstantVelocity(q=8.0), q_vertical=3.0)
# angles of a camera err together for some seconds: its pose, its clock and its lens are not quite known
WANDERING = {"sd_deg": 0.18, "memory_s": 2.5}


@functools.cache
def recording():
    sites = read_sensors(FOLDER / "sensors.csv")
    sets = list(open_bearings(FOLDER / "bearings.csv", sites))
    truth = np.loadtxt(FOLDER / "truth.csv", delimiter=",", skiprows=1)
    times = np.array([each.time_s for each in sets])
    place = np.column_stack([np.interp(times, truth[:, 0], truth[:, k]) for k in (1, 2, 3)])
    cameras = np.array([len(each.sensor) for each in sets])
    sensor = BearingSensors.at(sites, dimensions=3, sigma_deg=0.07)
    return sensor, sets, times, place, cameras


def errors(found):
    place = recording()[3]
    off = found.states[:, PLACE] - place
    spread = found.covariances[:, PLACE][:, :, PLACE]
    inside = np.einsum("ki,kij,kj->k", off, np.linalg.inv(spread), off) < CHI2_95
    return np.linalg.norm(off, axis=1), inside


def rms(values):
    return np.sqrt((values**2).mean())


def settings():
    return {"motion": MOTION, "sensor": recording()[0], "bias": WANDERING}


def test_batch_is_exact_and_honest():
    _, sets, _, _, cameras = recording()
    off, inside = errors(MapSmoother(**settings()).smooth(sets))
    two = cameras >= 2
    assert rms(off[two]) < 0.40
    assert np.median(off[two]) < 0.20
    assert 0.90 < inside[two].mean() < 0.98
    assert 0.90 < inside.mean() < 0.98
    # before the first and after the last fix of two cameras a single one tells no range
    first, last = np.flatnonzero(two)[[0, -1]]
    between = (cameras == 1) & (np.arange(len(sets)) > first) & (np.arange(len(sets)) < last)
    assert between.sum() > 500
    assert rms(off[between]) < 3.5


@pytest.mark.validate
def test_two_seconds_of_lag_are_as_good_where_two_cameras_see_it():
    _, sets, _, _, cameras = recording()
    off, inside = errors(FixedLagSmoother(**settings(), lag_s=2.0).track(sets))
    assert rms(off[cameras >= 2]) < 0.40
    assert 0.90 < inside[cameras >= 2].mean() < 0.98


def test_the_iterated_filter_holds_the_track_too():
    _, sets, _, _, cameras = recording()
    filter = ExtendedKalmanFilter(motion=MOTION, sensor=recording()[0].replace(sigma_deg=0.2))
    off, _ = errors(filter.track(sets))
    smooth, _ = errors(filter.track(sets, smooth=True))
    assert rms(off[cameras >= 2]) < 0.5
    assert rms(smooth[cameras >= 2]) < 0.45


@pytest.mark.parametrize(("gap_s", "most_m"), longer([(1.0, 0.8), (5.0, 3.0)], (1.0, 0.8)))
def test_gaps_of_all_cameras_are_bridged(gap_s, most_m):
    sensor, sets, times, _, cameras = recording()
    hidden = np.zeros(len(sets), bool)
    for start in np.arange(80.0, 600.0, 26.0):
        if (cameras[(times > start - 2) & (times < start + gap_s + 2)] >= 2).sum() > 8:
            hidden |= (times >= start) & (times < start + gap_s)
    assert hidden.sum() > 50
    left = [sensor.nothing(each.time_s) if gone else each for each, gone in zip(sets, hidden, strict=True)]
    off, inside = errors(MapSmoother(**settings()).smooth(left))
    assert rms(off[hidden]) < most_m
    assert inside[hidden].mean() > 0.90
    assert rms(off[(cameras >= 2) & ~hidden]) < 0.40
