"""The deviation of bearings that nobody tells: that of the sensors, and none where something else is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import chdtri

from elusive.contracts import Array
from elusive.metrics.consistency import squared_deviations
from elusive.sensors.arrival_times import ArrivalSet
from elusive.sensors.bearing_sets import BearingSet
from elusive.systems.bearings.deviation import errors_found
from elusive.systems.bearings.live_checks import checked
from elusive.systems.bearings.parameters import BearingTracking
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
    found = errors_found(UNTOLD, SITES, sets)
    # 60 times, four bearings, of which two tell the place
    assert found.sigma_deg == pytest.approx(sigma_deg, rel=4 / math.sqrt(2 * 120))
    assert all(one.holds for one in checked(found, SITES, list(track(sets, found, SITES))))


@pytest.mark.thorough
def test_sensors_that_are_not_alike_are_weighed_so():
    """Taken as alike, the least precise drew the path with it."""
    true_deg = (0.3, 1.0, 1.0, 3.0)
    way, _ = flown(5, 1.0)
    sensors = SENSORS.replace(sensor_sigma_deg=true_deg)
    sets = sensors.simulate(way, np.arange(float(len(way))), np.random.default_rng(5))
    found = errors_found(UNTOLD, SITES, sets)
    # 60 bearings each, of which two in four tell the place
    np.testing.assert_allclose(np.divide(found.sensor_sigma_deg, true_deg), 1.0, rtol=4 * 1.17 / math.sqrt(60))
    (named,) = (one for one in checked(found, SITES, list(track(sets, found, SITES))) if not one.holds)
    assert named.name == "bearings.uneven"
    assert not named.grave
    assert errors_found(UNTOLD.replace(sigma_deg=1.0), SITES, sets).sensor_times is None


@pytest.mark.thorough
def test_what_is_wrong_in_another_way_is_not_hidden_by_a_larger_one():
    """Azimuths anticlockwise from east leave their path by tens of degrees, and are named; read so they tell theirs."""
    sets = [one._replace(azimuth_rad=np.pi / 2 - one.azimuth_rad) for one in heard(2, 1.0)]
    found = errors_found(UNTOLD, SITES, sets)
    assert found.sigma_deg == pytest.approx(1.0, rel=4 / math.sqrt(2 * 120))
    named = [one for one in checked(found, SITES, list(track(sets, found, SITES))) if not one.holds]
    assert any("anticlockwise from east" in one.sentence for one in named)


def test_it_is_the_usual_one_where_nothing_tells_it():
    sets = heard(3, 3.0)
    alone = [BearingSet(one.time_s, one.sensor[:1], one.azimuth_rad[:1], one.elevation_rad[:1]) for one in sets]
    biased = UNTOLD.replace(filter={"kind": "map", "bias": {"sd_deg": 1.0}})
    arrived = [ArrivalSet(float(k), np.arange(4), np.full(4, 1e-6)) for k in range(20)]
    for parameters, given in ((UNTOLD, alone), (UNTOLD, sets[:5]), (UNTOLD, arrived)):
        assert errors_found(parameters, SITES, given).sigma_deg == 1.0
    told = biased.replace(sigma_deg=0.5)
    assert errors_found(told, SITES, sets) == told


def test_a_bias_that_is_told_is_kept():
    told = UNTOLD.replace(filter={"kind": "map", "bias": {"sd_deg": 2.0}})
    found = errors_found(told, SITES, heard(3, 3.0))
    assert found.filter == told.filter
    assert found.sigma_deg == pytest.approx(3.0, rel=4 / math.sqrt(2 * 120))


def persisting(
    seed: int, norths_deg: float, wander_deg: float, memory_s: float = 15.0
) -> tuple[Array, list[BearingSet]]:
    """States of an emitter and bearings of a degree beside norths that are off and errors that wander."""
    way, sets = flown(seed, 1.0)
    rng, kept = np.random.default_rng([seed, 5]), math.exp(-1 / memory_s)
    norths, error = norths_deg * rng.standard_normal(4), wander_deg * rng.standard_normal(4)
    erring = []
    for one in sets:
        error = kept * error + wander_deg * math.sqrt(1 - kept**2) * rng.standard_normal(4)
        erring.append(one._replace(azimuth_rad=one.azimuth_rad + np.deg2rad(norths + error)[one.sensor]))
    return way, erring


@pytest.mark.thorough
@pytest.mark.parametrize(("norths_deg", "wander_deg"), longer([(2.0, 0.0), (0.0, 2.0)], (0.0, 2.0)))
def test_ellipses_hold_where_errors_persist(norths_deg, wander_deg):
    """In 95 % of the times; those of one flight err alike, so that a flight is about one draw."""
    inside, exact = [], []
    for seed in range(3):
        way, sets = persisting(seed, norths_deg, wander_deg)
        found = errors_found(UNTOLD, SITES, sets)
        for parameters, kept in ((found, inside), (UNTOLD.replace(sigma_deg=1.0), exact)):
            steps = list(track(sets, parameters, SITES))
            off = np.array([step.tracks[0].mean[[0, 2]] for step in steps]) - way[:, [0, 2]]
            spread = np.array([step.tracks[0].covariance[np.ix_([0, 2], [0, 2])] for step in steps])
            kept.append(np.mean(squared_deviations(off, spread) < chdtri(2, 0.05)))
    assert np.mean(inside) > 0.95 - 3 * math.sqrt(0.95 * 0.05 / 3)
    assert np.mean(exact) < 0.5


@pytest.mark.thorough
def test_norths_that_are_right_are_found_so():
    """Four sensors tell: what persists is taken for a small part of a bearing's deviation."""
    found = [errors_found(UNTOLD, SITES, heard(seed, 1.0)).filter.bias.sd_deg for seed in range(2)]
    assert max(found) < 0.5
