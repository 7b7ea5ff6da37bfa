"""Live filters after a manoeuvre beyond their motion, while one sensor alone heard: found, and never sure."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.recovering import RecoveringFilter, recovers
from elusive.motion import ConstantVelocity
from elusive.sensors.bearings import BearingSensors
from tests.filters.gaussian.bearing_scenes import FLAT, PROBLEMS, recorded
from tests.filters.gaussian.test_random_scenes import MOTION, scene
from tests.longer import longer

FILTERS = {"iekf": ExtendedKalmanFilter, "lag": FixedLagSmoother}
ALONE = slice(40, 80)  # times at which one sensor alone hears
AFTER = ALONE.stop + 1  # the second update


def flight(seed, turns=True):
    """12 m/s past three sensors, bearings of .5 degrees each half second; while one alone hears it turns by 1.7 rad."""
    rng = np.random.default_rng(seed)
    heading, place, way, states = rng.uniform(0, 2 * np.pi), np.zeros(2), 1 if seed % 2 else -1, []
    for k in range(160):
        velocity = 12 * np.array([np.cos(heading), np.sin(heading)])
        states.append([place[0], velocity[0], place[1], velocity[1]])
        place = place + 0.5 * velocity
        heading += 0.06 * way if turns and 48 <= k < 76 else 0
    states = np.array(states)
    states[:, [0, 2]] += rng.uniform(-60, 60, 2) - states[60, [0, 2]]
    sensor = BearingSensors(positions_m=FLAT.positions_m, sigma_deg=0.5)
    sets = sensor.simulate(states, 0.5 * np.arange(160), rng)
    for k in range(ALONE.start, ALONE.stop):
        kept = sets[k].sensor == seed % 3
        arrays = {name: getattr(sets[k], name)[kept] for name in ("sensor", "azimuth_rad", "elevation_rad")}
        sets[k] = sets[k]._replace(**arrays)
    return sensor, states, sets


def errors(flt, sets, states):
    """Distance to the truth at each time, and the squared error in deviations."""
    rng, off, squared = np.random.default_rng(0), [], []
    state = flt.init(rng)
    for truth, one in zip(states, sets, strict=True):
        state = flt.step(state, one.time_s, one, rng)
        off.append((state.mean - truth)[[0, 2]])
        squared.append(off[-1] @ np.linalg.solve(state.covariance[np.ix_([0, 2], [0, 2])], off[-1]))
    return np.hypot(*np.array(off).T), np.array(squared)


@pytest.mark.parametrize("name", longer(FILTERS, "lag"))
def test_the_second_update_after_a_stretch_of_one_sensor_is_near_and_none_is_sure_and_wrong(name):
    seeds = range(10)
    near, squared, before = [], [], []
    for seed in seeds:
        sensor, states, sets = flight(seed)
        flt = FILTERS[name](sensor=sensor, motion=ConstantVelocity(q=0.1))
        off, its = errors(RecoveringFilter(flt), sets, states)
        near.append(off[AFTER])
        squared.append(its)
        before.append(errors(flt, sets, states)[0][AFTER])
    squared = np.array(squared)
    assert np.median(near) < 3
    assert max(near) < 15
    assert np.median(before) > 20  # without a second belief
    # beyond 5 deviations: hardly while one hears, as good as never after it
    assert (squared[:, ALONE] > 25).mean() < 0.1
    assert (squared[:, ALONE.stop :] > 25).mean() < 0.01


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("problem", PROBLEMS)
def test_what_is_expected_is_filtered_as_by_the_filter_itself(name, problem):
    _, _, sets = recorded(PROBLEMS[problem], steps=20)
    flt, rng = FILTERS[name](**PROBLEMS[problem]), np.random.default_rng(0)
    assert recovers(flt)
    recovering = RecoveringFilter(flt)
    state, own = recovering.init(rng), flt.init(rng)
    for one in [*sets, None]:
        time_s = sets[-1].time_s + 1 if one is None else one.time_s
        state, own = recovering.step(state, time_s, one, rng), flt.step(own, time_s, one, rng)
        assert state.other is None
        np.testing.assert_array_equal(state.mean, own.mean)
        np.testing.assert_array_equal(state.covariance, own.covariance)
    assert not state.reopened


@pytest.mark.parametrize("name", longer(FILTERS, "lag"))
def test_a_sensor_that_reports_garbage_is_no_manoeuvre(name):
    whole, plain = [], []
    for seed in range(3, 100, 8):
        sensor, path, sets = scene(seed)
        flt = FILTERS[name](motion=MOTION, sensor=sensor, start_speed_sd_mps=10.0)
        whole.append(errors(RecoveringFilter(flt), sets, path)[0])
        plain.append(errors(flt, sets, path)[0])
    assert np.sqrt(np.mean(np.square(whole))) < 1.1 * np.sqrt(np.mean(np.square(plain)))


def test_others_are_left_as_they_are():
    assert not recovers(FixedLagSmoother(sensor=FLAT, motion=MOTION, loss="squares"))
    recovering = RecoveringFilter(ExtendedKalmanFilter(sensor=FLAT, motion=MOTION))
    rng, (_, _, sets) = np.random.default_rng(0), recorded(PROBLEMS["cv"])
    state = recovering.init(rng)
    for one in sets:
        state = recovering.step(state, one.time_s, one, rng)
    with pytest.raises(DataError, match="sort the measurements by time"):
        recovering.step(state, sets[0].time_s, sets[0], rng)
