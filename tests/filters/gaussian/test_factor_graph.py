"""The paper's factor graph against scalar messages, an independent prototype's values, and what it leaves out.

The values are of a NumPy prototype with other random numbers, 100 runs; a root mean square error may differ from them
by 3.5 standard errors of the difference (which the runs tell, for both sides) and by half a unit of the last digit.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.experiments.jiang2024.scenario import PLACES_M, SIGMAS_DEG, FlightCase
from elusive.filters.gaussian.factor_graph import FactorGraphFilter
from elusive.filters.gaussian.factor_graph_fix import FactorGraphFix
from elusive.runner import run
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearings import BearingSensors
from tests.reference import factor_graph as twin

RUNS, DEVIATIONS = 100, 3.5
SENSORS = BearingSensors(positions_m=PLACES_M, sigma_deg=1.0)
EKF = {
    "cv": (0.65, 1.76, 4.85, 9.14, 15.8),
    "ca": (0.60, 1.68, 6.16, 13.7, 22.4),
    "ctrv": (1.00, 3.91, 12.8, 19.8, 27.6),
}
EKS = {
    "cv": (0.67, 1.81, 6.30, 9.25, 12.5),
    "ca": (0.61, 1.79, 6.03, 9.37, 13.4),
    "ctrv": (0.99, 5.26, 15.4, 18.1, 21.1),
}


@cache
def flights(motion: str, sigma_deg: float) -> tuple[np.ndarray, np.ndarray]:
    case = FlightCase(motion=motion, sigma_deg=sigma_deg)
    drawn = [case.simulate(np.random.default_rng((3, number))) for number in range(RUNS)]
    return np.stack([each.states[:, [0, 2]] for each in drawn]), np.stack([each.azimuth_rad for each in drawn])


def squares(motion: str, sigma_deg: float, **parameters) -> np.ndarray:
    """Mean square error of each run."""
    truth, azimuth = flights(motion, sigma_deg)
    sensor = FlightCase(motion=motion, sigma_deg=sigma_deg).sensors
    graph = FactorGraphFilter(sensor=sensor, accelerates=motion != "cv", **parameters)
    return ((graph.track(azimuth).mean - truth) ** 2).sum(axis=-1).mean(axis=-1)


def rmse(squares: np.ndarray) -> tuple[float, float]:
    """Root of the mean and its standard error."""
    found = np.sqrt(squares.mean())
    return found, squares.std(ddof=1) / np.sqrt(len(squares)) / 2 / found


def test_fixes_are_the_scalar_messages() -> None:
    rng = np.random.default_rng(1)
    azimuth = rng.uniform(-np.pi, np.pi, (30, 3))
    azimuth[::4, 1] = np.nan
    spread = rng.uniform(1e-5, 1e-2, (30, 3))
    graph = FactorGraphFix(sensor=SENSORS, iterations=7, start_variance_m2=2e4)
    found = graph.locate(azimuth, spread)
    for k in range(30):
        told = [None if np.isnan(a) else a for a in azimuth[k]]
        x, y = twin.fix(told, spread[k], [place[:2] for place in PLACES_M], 7, 2e4)
        np.testing.assert_allclose(found.mean[k], [x[0], y[0]], rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(found.variance[k], [x[1], y[1]], rtol=1e-6)
    blind = graph.locate(np.array([[0.3, np.nan, np.nan]]))
    assert np.isnan(blind.mean).all()
    assert np.isinf(blind.variance).all()


def test_bearings_along_the_axes_are_fixed() -> None:
    square = BearingSensors(positions_m=((0, 0, 0), (100, 100, 0), (100, 0, 0)), sigma_deg=1)
    azimuth = np.arctan2([0, -100, -100], [100, 0, 100])  # of (0, 100): due north, due west, north-west
    found = FactorGraphFix(sensor=square, iterations=200).locate(azimuth)
    np.testing.assert_allclose(found.mean, [0, 100], atol=1e-3)


@pytest.mark.parametrize(
    ("smooth", "accelerates", "alpha"), [(False, True, 1.0), (True, True, 1.0), (True, False, 0.9), (False, False, 1.0)]
)
def test_tracks_are_the_scalar_messages(smooth: bool, accelerates: bool, alpha: float) -> None:
    _, azimuth = flights("ctrv", 15.0)
    graph = FactorGraphFilter(
        sensor=FlightCase(sigma_deg=15).sensors,
        smooth=smooth,
        accelerates=accelerates,
        forgetting=alpha,
        step_noise_m=0.7,
    )
    found, fixes = graph.track(azimuth[0]), graph.locate(azimuth[0])
    for axis in (0, 1):
        given = list(zip(fixes.mean[:, axis], fixes.variance[:, axis], strict=True))
        expected = twin.track(given, smooth=smooth, accelerates=accelerates, alpha=alpha, noise=0.7, start=1.0)
        np.testing.assert_allclose(found.mean[:, axis], [mean for mean, _ in expected], rtol=1e-9)
        np.testing.assert_allclose(found.variance[:, axis], [variance for _, variance in expected], rtol=1e-9)


@pytest.mark.parametrize(("iterations", "value"), [(5, 27), (10, 6.15), (20, 1.40), (50, 0.90)])
def test_fixes_converge_as_the_prototypes(iterations: int, value: float) -> None:
    truth, azimuth = flights("cv", 1.0)
    found = FactorGraphFix(sensor=FlightCase().sensors, iterations=iterations).locate(azimuth).mean
    each = ((found - truth) ** 2).sum(axis=-1).mean(axis=-1)
    found, error = rmse(each)
    assert found == pytest.approx(value, abs=DEVIATIONS * np.sqrt(2) * error + (0.5 if value == 27 else 0.005))


@pytest.mark.thorough
@pytest.mark.parametrize("motion", ["cv", "ca", "ctrv"])
@pytest.mark.parametrize(("smooth", "table"), [(False, EKF), (True, EKS)], ids=["fg-ekf", "fg-eks"])
def test_rows_of_the_table(motion: str, smooth: bool, table: dict) -> None:
    for sigma, value in zip(SIGMAS_DEG, table[motion], strict=True):
        found, error = rmse(squares(motion, sigma, smooth=smooth))
        assert found == pytest.approx(value, abs=DEVIATIONS * np.sqrt(2) * error + (0.05 if value > 10 else 0.005))


@pytest.mark.parametrize(("sigma", "least"), [(1.0, 1.8), (15.0, 3.0)])
def test_variances_are_optimistic(sigma: float, least: float) -> None:
    """What the class says: the mean of e^2 / variance is 2 and more, where an honest one has 1."""
    truth, azimuth = flights("cv", sigma)
    found = FactorGraphFix(sensor=FlightCase(sigma_deg=sigma).sensors).locate(azimuth)
    assert ((found.mean - truth) ** 2 / found.variance).mean() > least


def test_forgetting_multiplies_absolute_coordinates() -> None:
    remembered, forgot = (rmse(squares("cv", 1.0, smooth=False, forgetting=alpha)) for alpha in (1.0, 0.99))
    assert remembered[0] == pytest.approx(0.63, abs=0.06)
    assert forgot[0] == pytest.approx(1.39, abs=0.15)


def test_ten_thousand_tracks_in_one_call_are_each_alone() -> None:
    _, azimuth = flights("cv", 5.0)
    many = np.resize(azimuth[:, :6], (10_000, 6, 3))
    many[5, 2] = np.nan
    graph = FactorGraphFilter(sensor=FlightCase(sigma_deg=5).sensors)
    found = graph.track(many)
    for number in (0, 5, 9_999):
        alone = graph.track(many[number])
        np.testing.assert_allclose(found.mean[number], alone.mean)
        np.testing.assert_allclose(found.variance[number], alone.variance)


def test_live_steps_are_the_recording() -> None:
    case = FlightCase(motion="ctrv", sigma_deg=5)
    flight = case.simulate(np.random.default_rng(0))
    graph = FactorGraphFilter(sensor=case.mean_sensors)
    sets = list(flight.sets)
    del sets[10:13]
    azimuth = np.array([heard.azimuth_rad for heard in sets])
    whole = graph.track(azimuth, times_s=np.array([heard.time_s for heard in sets]))
    states = list(run(graph, sets, np.random.default_rng(0)))
    np.testing.assert_array_equal(whole.times_s, [state.time_s for state in states])
    np.testing.assert_allclose([state.mean for state in states], whole.mean)
    np.testing.assert_allclose([state.variance for state in states], whole.variance)
    before = states[9]
    waited = graph.step(before, before.time_s + 2.5, None, np.random.default_rng(0))
    np.testing.assert_allclose(waited.mean, before.mean + 2.5 * before.velocity)
    assert (waited.variance > before.variance).all()
    again = graph.step(before, before.time_s, sets[9], np.random.default_rng(0))
    np.testing.assert_array_equal(again.velocity, before.velocity)
    assert (again.variance < before.variance).all()


@pytest.mark.parametrize("smooth", [False, True])
def test_a_straight_flight_at_uneven_times_is_followed_in_seconds(smooth: bool) -> None:
    rng = np.random.default_rng(0)
    times = rng.uniform(0.2, 8.0, 60).cumsum()
    states = np.column_stack([20 + 0.1 * times, np.full(60, 0.1), 30 - 0.05 * times, np.full(60, -0.05)])
    sensors = FlightCase(sigma_deg=0.01).sensors.replace(samples=1)
    graph = FactorGraphFilter(sensor=sensors, smooth=smooth, accelerates=False, step_noise_m=0.01)
    found = list(run(graph, sensors.simulate(states, times, rng), rng))
    assert np.abs([state.mean for state in found] - states[:, [0, 2]]).max() < 0.1
    np.testing.assert_allclose([state.velocity for state in found[20:]], np.tile([0.1, -0.05], (40, 1)), atol=0.01)


def test_a_track_begins_with_its_first_two_fixes() -> None:
    case = FlightCase()
    azimuth = case.simulate(np.random.default_rng(0)).azimuth_rad.copy()
    azimuth[0] = np.nan
    azimuth[2:4, 1:] = np.nan
    graph = FactorGraphFilter(sensor=case.sensors, step_noise_m=0, smooth=False)
    fixes, found = graph.locate(azimuth), graph.track(azimuth)
    assert np.isnan(found.mean[0]).all()
    np.testing.assert_allclose(found.mean[1:4], np.repeat(fixes.mean[1:2], 3, axis=0))
    np.testing.assert_allclose(
        found.mean[4], fixes.mean[4]
    )  # the velocity from both leads from the first to the second
    assert np.isfinite(found.mean[4:]).all()


def test_refusals() -> None:
    graph = FactorGraphFilter(sensor=SENSORS)
    with pytest.raises(ParameterError, match="factor graph is of two dimensions"):
        FactorGraphFix(sensor=SENSORS.replace(dimensions=3))
    with pytest.raises(ParameterError, match="forgetting"):
        FactorGraphFilter(sensor=SENSORS, forgetting=1.1)
    with pytest.raises(DataError, match=r"azimuth_rad: has shape \(2,\); give \(..., 3\)"):
        graph.locate(np.zeros(2))
    with pytest.raises(DataError, match="finite, NaN where there is none"):
        graph.locate(np.array([0, 1, np.inf]))
    for spread in (np.ones(2), np.array([1.0, 0.0, 1.0])):
        with pytest.raises(DataError, match="variance_rad2: has shape"):
            graph.locate(np.ones(3), spread)
    with pytest.raises(DataError, match=r"azimuth_rad: has shape \(3,\); give \(..., T, n\)"):
        graph.track(np.ones(3))
    sets = [BearingSet(t, np.arange(3), np.ones(3), np.full(3, np.nan)) for t in (0.0, 1.0, 0.4)]
    with pytest.raises(DataError, match="sort"):
        list(run(graph, sets, np.random.default_rng(0)))
    with pytest.raises(DataError, match="times_s: has shape"):
        graph.track(np.ones((4, 3)), times_s=np.arange(3.0))
    with pytest.raises(DataError, match=r"azimuth_rad: has shape|bearings"):
        graph.track(np.empty((0, 3)))
