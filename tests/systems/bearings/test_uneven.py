"""How precise each sensor is, from several emitters' own bearings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.sensors.bearings import BearingSensors
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.several import tracker_of
from elusive.systems.bearings.uneven import with_sensor_times
from tests.systems.bearings.crowd import PLACES, SITES, crowd

ASKED = BearingTracking(emitters={"kind": "several"}, motion={"kind": "cv", "q": 0.5}, sigma_deg=1.0)


def own(each_deg):
    """Bearings of two emitters, each by itself."""
    sensors, rng = BearingSensors(positions_m=PLACES, sensor_sigma_deg=each_deg), np.random.default_rng(3)
    truth = crowd(3, 2)[0]
    return [sensors.simulate(path, np.arange(60.0), rng) for path in truth.swapaxes(0, 1)]


def _of_first(one, sensors):
    """Bearings of the first sensors."""
    rows = one.sensor < sensors
    return one._replace(
        sensor=one.sensor[rows], azimuth_rad=one.azimuth_rad[rows], elevation_rad=one.elevation_rad[rows]
    )


def test_each_sensors_deviation_is_found_where_they_are_not_alike():
    true = (0.5, 1.0, 1.0, 4.0)
    found = with_sensor_times(ASKED, SITES, own(true))
    # 120 bearings each, of which the path of the precise one takes some
    np.testing.assert_allclose(found.sensor_times, true, rtol=4 * 1.17 / math.sqrt(120))
    assert tracker_of(found, SITES).sensor.bearings.sensor_sigma_deg == found.sensor_times
    assert with_sensor_times(found, SITES, own(true)) == found


@pytest.mark.parametrize("sensors", [2, 4])
def test_sensors_that_are_alike_and_two_have_none_of_their_own(sensors):
    alone = own((1.0,) * 4 if sensors == 4 else (1.0, 4.0, 1.0, 1.0))
    kept = [[_of_first(one, sensors) for one in part] for part in alone]
    assert with_sensor_times(ASKED, SITES, kept) == ASKED
