"""The deviation of bearings that nobody tells: that of the sensors, and none where something else is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.sensors.arrival_times import ArrivalSet
from elusive.sensors.bearing_sets import BearingSet
from elusive.systems.bearings.deviation import deviation_found
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.run import checked
from elusive.systems.bearings.track import track
from tests.longer import longer
from tests.systems.bearings.test_powers import SENSORS, SITES, flown

UNTOLD = BearingTracking(emitters={"kind": "one"})


def heard(seed: int, sigma_deg: float) -> list[BearingSet]:
    """Bearings of an emitter that flies as `flown` does, by sensors of another deviation."""
    way, _ = flown(seed, 1.0)
    return SENSORS.replace(sigma_deg=sigma_deg).simulate(way, np.arange(float(len(way))), np.random.default_rng(seed))


@pytest.mark.parametrize("sigma_deg", longer([0.3, 3.0], 3.0))
def test_it_is_found_and_nothing_is_found_wrong(sigma_deg):
    sets = heard(1, sigma_deg)
    found = deviation_found(UNTOLD, SITES, sets)
    # 60 times, four bearings, of which two tell the place
    assert found.sigma_deg == pytest.approx(sigma_deg, rel=4 / math.sqrt(2 * 120))
    assert all(one.holds for one in checked(found, SITES, list(track(sets, found, SITES))))


def test_what_is_wrong_in_another_way_is_not_hidden_by_a_larger_one():
    """Azimuths anticlockwise from east leave their path by tens of degrees, and are named."""
    sets = [one._replace(azimuth_rad=np.pi / 2 - one.azimuth_rad) for one in heard(2, 1.0)]
    found = deviation_found(UNTOLD, SITES, sets)
    assert found.sigma_deg == 1.0
    named = [one for one in checked(found, SITES, list(track(sets, found, SITES))) if not one.holds]
    assert any("anticlockwise from east" in one.sentence for one in named)


def test_it_is_the_usual_one_where_nothing_tells_it():
    sets = heard(3, 3.0)
    alone = [BearingSet(one.time_s, one.sensor[:1], one.azimuth_rad[:1], one.elevation_rad[:1]) for one in sets]
    biased = UNTOLD.replace(filter={"kind": "map", "bias": {"sd_deg": 1.0}})
    arrived = [ArrivalSet(float(k), np.arange(4), np.full(4, 1e-6)) for k in range(20)]
    for parameters, given in ((UNTOLD, alone), (UNTOLD, sets[:5]), (biased, sets), (UNTOLD, arrived)):
        assert deviation_found(parameters, SITES, given).sigma_deg == 1.0
    told = UNTOLD.replace(sigma_deg=0.5)
    assert deviation_found(told, SITES, sets) == told
