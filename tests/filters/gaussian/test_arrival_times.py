"""Times of arrival: their noise, their contrasts against all differences, filters on them alone and with bearings."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from elusive.errors import DataError, ParameterError
from elusive.filters.gaussian._bearing_kernels import bearing_rows, curvature
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.motion import ConstantVelocity
from elusive.motion.altitude import WithAltitude
from elusive.sensors.arrival_times import ArrivalSet, ArrivalTimeSensors
from elusive.sensors.bearing_table import tabulated
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.hybrid import HybridSensors, HybridSet
from tests.longer import longer
from tests.reference import bearings as twin

PLACES = ((0.0, 0.0, 1.0), (70.0, 12.0, 0.0), (-60.0, 81.0, 5.0), (20.0, -50.0, 2.0))
KNOWN = ArrivalTimeSensors(positions_m=PLACES, sigma_s=2e-9)
DIFFERENCES = KNOWN.replace(emission_known=False)
ANGLES = BearingSensors(positions_m=PLACES[:2], sigma_deg=1.0)
HYBRID = HybridSensors(bearings=ANGLES, arrivals=KNOWN)
MOTION = ConstantVelocity(q=0.5)
TIMES = np.arange(1.0, 21.0)


def track(rng, start=(20.0, 4.0, 30.0, 3.0), motion=MOTION):
    state = np.array([start])
    path = [state[0]]
    for _ in TIMES[1:]:
        state = motion.propagate(state, 1.0, rng)
        path.append(state[0])
    return np.array(path)


def test_noise_is_of_the_clock():
    n, rng = 4000, np.random.default_rng(0)
    states = np.tile([[30.0, 0, 40, 0]], (n, 1))
    sets = KNOWN.replace(positions_m=PLACES[:2]).simulate(states, np.arange(n), rng)
    error = np.array([s.arrival_s for s in sets]) - np.hypot([30, 40], [40, 28]) / 299_792_458.0
    assert error.std(axis=0) == pytest.approx([2e-9, 2e-9], rel=4 / np.sqrt(2 * n))
    assert (np.abs(error.mean(axis=0)) < 4 * 2e-9 / np.sqrt(n)).all()


@pytest.mark.parametrize("counts", [(1, 1, 1, 1), (3, 1, 2, 1)])
def test_contrasts_are_worth_all_differences_to_any_reference(counts):
    rng = np.random.default_rng(1)
    sensor = np.repeat(np.arange(4), counts)
    measurement = ArrivalSet(0.0, sensor, rng.normal(size=len(sensor)) * 1e-8 + 5.0)
    states = np.column_stack([rng.normal(0, 40, (6, 4))])
    told = DIFFERENCES.log_likelihood(states, measurement)
    mean = np.array([measurement.arrival_s[sensor == k].mean() for k in range(4)]) * KNOWN.speed_mps
    ranges = np.hypot(states[:, :1] - DIFFERENCES.places[:, 0], states[:, 2:3] - DIFFERENCES.places[:, 1])
    noise = np.diag((KNOWN.speed_mps * KNOWN.sigma_s) ** 2 / np.array(counts))
    for reference in range(4):
        less = np.delete(np.eye(4), reference, axis=0)
        less[:, reference] = -1.0
        spread = less @ noise @ less.T
        exact = np.array([multivariate_normal(less @ r, spread).logpdf(less @ mean) for r in ranges])
        # densities of other coordinates: they differ by a constant
        np.testing.assert_allclose(told - told[0], exact - exact[0], atol=1e-6 * np.abs(exact).max())


@pytest.mark.parametrize("sensors", [KNOWN, DIFFERENCES, KNOWN.replace(dimensions=3)], ids=["toa", "tdoa", "solid"])
def test_information_is_the_curvature_of_the_exact_measurement(sensors):
    d = 2 * sensors.dimensions
    state = np.array([30.0, 1, 40, -1, 25, 0])[:d]
    exact = ArrivalSet(0.0, np.arange(4), sensors.measured(state[None])[0])
    step, curved = 1e-3, np.empty((d, d))
    for i in range(d):
        for j in range(d):
            corners = [state + step * (a * np.eye(d)[i] + b * np.eye(d)[j]) for a in (1, -1) for b in (1, -1)]
            pp, pm, mp, mm = sensors.log_likelihood(np.array(corners), exact)
            curved[i, j] = -(pp - pm - mp + mm) / (4 * step**2)
    np.testing.assert_allclose(sensors.information(state[None])[0], curved, atol=1e-4 * curved.max())


@pytest.mark.parametrize("sensors", [KNOWN, DIFFERENCES, HYBRID], ids=["toa", "tdoa", "hybrid"])
def test_rows_are_those_of_the_models(sensors):
    problem = MapSmoother(motion=MOTION, sensor=sensors, loss="squares")
    rng = np.random.default_rng(2)
    states = track(rng)
    table = tabulated(sensors.simulate(states, TIMES, rng), sensors)
    transitions = problem.transitions(TIMES)
    residual, H = np.empty(2), np.empty((2, 4))
    for k in (0, 7):
        for row in range(table.first[k], table.first[k + 1]):
            assert bearing_rows(table, row, states[k], transitions, residual, H, 0) == 1
            expected = twin.misfit(problem, table, row, states[k])
            np.testing.assert_allclose(residual[:1], expected, atol=1e-9)
            slope = twin.numeric_jacobian(lambda s, row=row: twin.misfit(problem, table, row, s), states[k])
            np.testing.assert_allclose(H[:1], -slope, atol=1e-7)
            far = np.array([1e5, 0, 0, 0])
            assert curvature(table, row, far, 9.0, False) < curvature(table, row, states[k], 9.0, False)


def test_the_most_probable_path_is_the_dense_solvers():
    rng = np.random.default_rng(3)
    problem = MapSmoother(motion=MOTION, sensor=HYBRID, loss="squares", tolerance=1e-9)
    states = track(rng)[:6]
    sets = HYBRID.simulate(states, TIMES[:6], rng)
    found, table = problem.smooth(sets), tabulated(sets, HYBRID)
    expected, _, cost = twin.least(problem, table, found.states + rng.normal(size=(6, 4)) * 1e-2)
    deviation = np.sqrt(np.diagonal(found.covariances, axis1=1, axis2=2))
    assert (np.abs(found.states - expected) < 1e-4 * deviation).all()
    assert found.cost == pytest.approx(cost, rel=1e-7)


@pytest.mark.parametrize("sensors", longer([KNOWN, DIFFERENCES, HYBRID], KNOWN), ids=["toa", "tdoa", "hybrid"])
@pytest.mark.parametrize("kind", [ExtendedKalmanFilter, FixedLagSmoother, MapSmoother])
def test_filters_find_the_path_and_are_as_sure_as_they_may_be(kind, sensors):
    rng = np.random.default_rng(4)
    filter = kind(motion=MOTION, sensor=sensors, loss="squares", start_speed_sd_mps=8.0)
    worth = []
    for _ in range(40):
        states = track(rng)
        sets = sensors.replace(arrivals=KNOWN.replace(detection_probability=0.9)) if sensors is HYBRID else sensors
        recorded = sets.simulate(states, TIMES, rng)
        found = filter.smooth(recorded) if kind is MapSmoother else filter.track(recorded)
        error = (found.states - states)[5:, [0, 2]]
        spread = found.covariances[5:, [0, 2]][:, :, [0, 2]]
        worth.append(np.einsum("ki,kij,kj->k", error, np.linalg.inv(spread), error).mean())
    assert np.mean(worth) == pytest.approx(2.0, abs=4 * np.std(worth) / np.sqrt(len(worth)))
    assert np.mean(worth) < 2.6


def test_one_place_with_bearing_and_range_is_enough():
    rng = np.random.default_rng(5)
    sensors = HybridSensors(
        bearings=ANGLES.replace(positions_m=PLACES[:1]), arrivals=KNOWN.replace(positions_m=PLACES[:1])
    )
    states = track(rng)
    found = ExtendedKalmanFilter(motion=MOTION, sensor=sensors).track(sensors.simulate(states, TIMES, rng))
    assert np.hypot(*(found.states - states)[3:, [0, 2]].T).max() < 4.0


def test_heights_from_arrivals():
    rng = np.random.default_rng(6)
    motion = WithAltitude(motion=MOTION, q_vertical=0.2)
    raised = tuple((x, y, z + 15.0 * (k % 2)) for k, (x, y, z) in enumerate(PLACES))
    sensors = KNOWN.replace(positions_m=raised, dimensions=3)
    states = track(rng, (20.0, 4.0, 30.0, 3.0, 40.0, 1.0), motion)
    found = MapSmoother(motion=motion, sensor=sensors).smooth(sensors.simulate(states, TIMES, rng))
    assert np.abs(found.states - states)[:, [0, 2, 4]].max() < 5.0


def test_refused():
    good = ArrivalSet(0.0, np.array([0]), np.array([1.0]))
    state = np.zeros((1, 4))
    for bad, sentence in (
        (good._replace(arrival_s=np.array([np.nan])), "a number is not finite"),
        (good._replace(sensor=np.array([4])), "sensors are numbered 0 to 3"),
        (good._replace(arrival_s=np.empty(0)), "give each arrival a sensor"),
        ("later", "give an ArrivalSet"),
    ):
        with pytest.raises(DataError, match=sentence):
            KNOWN.log_likelihood(state, bad)
    with pytest.raises(DataError, match="have shapes"):
        KNOWN.simulate(state, [0.0, 1.0], np.random.default_rng(0))
    with pytest.raises(DataError, match="give a HybridSet"):
        tabulated([good], HYBRID)
    with pytest.raises(DataError, match="are of other times"):
        tabulated([HybridSet(1.0, ANGLES.nothing(1.0), good)], HYBRID)
    with pytest.raises(ParameterError, match="give both 2 or both 3"):
        HybridSensors(bearings=ANGLES, arrivals=KNOWN.replace(dimensions=3))
    with pytest.raises(ParameterError, match="bias: is of angles"):
        MapSmoother(motion=MOTION, sensor=KNOWN, bias={"sd_deg": 1.0})
    assert len(tabulated([KNOWN.nothing(0.0), good._replace(time_s=1.0)], KNOWN).sensor) == 1
