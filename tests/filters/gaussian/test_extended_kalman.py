"""Extended and iterated Kalman filter on bearings, and the smoother behind them, against textbook matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from elusive import run
from elusive.errors import DataError
from elusive.experiments.jiang2024.scenario import STEP_NOISE_M, FlightCase
from elusive.experiments.jiang2024.trial import MOVES
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.filters.gaussian.transitions import transitions_of
from elusive.metrics import nees
from elusive.motion import ConstantVelocity
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearing_table import tabulated
from elusive.sensors.bearings import BearingSensors
from tests.filters.gaussian.bearing_scenes import FLAT, PLACES, PROBLEMS, recorded
from tests.filters.gaussian.test_random_scenes import MOTION, scene
from tests.longer import longer
from tests.reference import bearings as twin

RNG = np.random.default_rng(0)


def made(name, **changes):
    return ExtendedKalmanFilter(**{"loss": "squares", **PROBLEMS[name], **changes})


@pytest.mark.parametrize("iterations", [1, 3])
@pytest.mark.parametrize("name", PROBLEMS)
def test_beliefs_are_those_of_the_textbook(name, iterations):
    filter = made(name, iterations=iterations)
    _, _, sets = recorded(PROBLEMS[name], steps=9)
    table, live, smooth = tabulated(sets, filter.sensor), filter.track(sets), filter.track(sets, smooth=True)
    b = live.started
    rest = tabulated(sets[b:], filter.sensor)
    beliefs, log_evidence = twin.filtered(filter, rest, live.states[b], live.covariances[b], iterations)
    assert live.log_evidence == pytest.approx(log_evidence, rel=1e-5, abs=1e-4)
    for path, expected in ((live, beliefs), (smooth, twin.smoothed(filter, rest, beliefs))):
        for k, (mean, covariance) in enumerate(expected, b):
            deviation = np.sqrt(np.diag(covariance))
            assert (np.abs(path.states[k] - mean) < 1e-3 * deviation).all()
            scale = np.outer(deviation, deviation)
            np.testing.assert_allclose(path.covariances[k] / scale, covariance / scale, atol=1e-3)
    assert len(table.times_s) == len(live.states)


def test_live_steps_are_the_recordings():
    filter = made("height")
    _, _, sets = recorded(PROBLEMS["height"], steps=12)
    whole = filter.track(sets)
    states = list(run(filter, sets, RNG))
    np.testing.assert_allclose([s.mean for s in states], whole.states, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose([s.covariance for s in states], whole.covariances, rtol=1e-6, atol=1e-9)
    assert sum(s.log_evidence for s in states) == pytest.approx(whole.log_evidence)
    assert [s.pending is None for s in states] == [k >= whole.started for k in range(12)]


def test_without_a_bearing_the_belief_is_carried_on():
    filter = made("cv")
    assert filter.step(filter.init(RNG), 0.0, None, RNG).pending == ()
    *_, state = run(filter, recorded(PROBLEMS["cv"])[2], RNG)
    later = filter.step(state, state.time_s + 1.5, None, RNG)
    F, Q = filter.motion.F(1.5), filter.motion.Q(1.5)
    np.testing.assert_allclose(later.mean, F @ state.mean)
    np.testing.assert_allclose(later.covariance, F @ state.covariance @ F.T + Q, atol=1e-8)
    assert (later.time_s, later.log_evidence) == (state.time_s + 1.5, 0.0)


def test_smoothed_beliefs_of_an_almost_linear_problem_are_the_most_probable_path():
    """Also before the place is told: one sensor alone at first, and the others later."""
    sensor = FLAT.replace(sigma_deg=0.05)
    parameters = {"motion": ConstantVelocity(q=0.05), "sensor": sensor, "loss": "squares"}
    _, _, sets = recorded(parameters)
    first = [
        s._replace(sensor=s.sensor[:1], azimuth_rad=s.azimuth_rad[:1], elevation_rad=s.elevation_rad[:1])
        for s in sets[:4]
    ]
    sets = [*first, *sets[4:]]
    smooth = ExtendedKalmanFilter(**parameters).track(sets, smooth=True)
    best = MapSmoother(**parameters).smooth(sets)
    assert smooth.started == 4
    deviation = np.sqrt(np.diagonal(best.covariances, axis1=1, axis2=2))
    assert (np.abs(smooth.states - best.states) < 0.2 * deviation).all()
    smooth_deviation = np.sqrt(np.diagonal(smooth.covariances, axis1=1, axis2=2))
    np.testing.assert_allclose(smooth_deviation, deviation, rtol=0.15)


@pytest.mark.parametrize("sigma_deg", [1.0, 5.0])
@pytest.mark.parametrize("estimator", ["extended", "iterated", "smoothed", "map"])
def test_errors_are_as_large_as_claimed(estimator, sigma_deg):
    """A true path drawn from the motion, so that a consistent estimator has a mean NEES of two."""
    runs, steps = 60, 20
    sensor = FLAT.replace(sigma_deg=sigma_deg, samples=20)
    parameters = {
        "motion": ConstantVelocity(q=0.2),
        "sensor": sensor,
        "loss": "squares",
        "start_speed_sd_mps": 8.0,
    }
    errors, covariances = np.empty((runs, steps, 2)), np.empty((runs, steps, 2, 2))
    rng = np.random.default_rng(int(10 * sigma_deg))
    times = np.arange(float(steps))
    for trial in range(runs):
        state = np.array([[rng.normal(0, 40), rng.normal(0, 8), rng.normal(30, 40), rng.normal(0, 8)]])
        path = [state[0]]
        for _ in times[1:]:
            state = parameters["motion"].propagate(state, 1.0, rng)
            path.append(state[0])
        path = np.array(path)
        sets = sensor.simulate(path, times, rng)
        if estimator == "map":
            found = MapSmoother(**parameters).smooth(sets)
        else:
            filter = ExtendedKalmanFilter(**parameters, iterations=1 if estimator == "extended" else 10)
            found = filter.track(sets, smooth=estimator == "smoothed")
        errors[trial] = (found.states - path)[:, [0, 2]]
        covariances[trial] = found.covariances[:, [0, 2]][:, :, [0, 2]]
    told = nees(errors, covariances)
    inside = (told.mean > told.low) & (told.mean < told.high)
    # frames of one path are alike: a single bad one may take several out
    assert inside.mean() >= 0.75
    assert told.mean.mean() == pytest.approx(2.0, abs=0.35)


def test_a_start_on_a_sensor_does_not_diverge():
    sensor = FLAT.replace(sigma_deg=1.0)
    parameters = {"motion": ConstantVelocity(q=0.1), "sensor": sensor, "start_speed_sd_mps": 15.0}
    times = np.arange(20.0)
    path = np.column_stack([10 * times, 0 * times + 10, 10 * times, 0 * times + 10])
    worst = []
    for seed in range(30):
        sets = sensor.simulate(path, times, np.random.default_rng(seed))
        errors = (ExtendedKalmanFilter(**parameters, loss="squares").track(sets).states - path)[5:, [0, 2]]
        worst.append(np.hypot(*errors.T).max())
    assert max(worst) < 25.0


def test_a_stray_bearing_moves_a_robust_filter_little():
    _, _, sets = recorded(PROBLEMS["cv"], steps=12)
    spoilt = [
        s._replace(azimuth_rad=s.azimuth_rad + np.deg2rad([60.0 if k == 8 else 0, 0, 0])) for k, s in enumerate(sets)
    ]
    away = {
        loss: np.abs(made("cv", loss=loss).track(spoilt).states[8] - made("cv", loss=loss).track(sets).states[8])[
            [0, 2]
        ].max()
        for loss in ("squares", "cauchy", "huber")
    }
    assert away["cauchy"] < away["squares"] / 10
    assert away["huber"] < away["squares"] / 3


def test_an_unlikely_bearing_has_its_whole_gain_scaled():
    """Masreliez and Martin (1977): by the weight of its innovation, however vague the belief is."""
    filter = made("cv", loss="cauchy", loss_k=2.0, iterations=1)
    _, _, sets = recorded(PROBLEMS["cv"], steps=9)
    *_, state = run(filter, sets[:8], RNG)
    vague = state._replace(covariance=state.covariance + np.diag([400.0, 1, 400, 1]))
    azimuth = sets[8].azimuth_rad[:1] + np.deg2rad(50)
    seen = BearingSet(sets[8].time_s, sets[8].sensor[:1], azimuth, np.full(1, np.nan))
    after = filter.step(vague, seen.time_s, seen, RNG)

    F, Q = (part(sets[8].time_s - sets[7].time_s) for part in (filter.motion.F, filter.motion.Q))
    mean, P = F @ vague.mean, F @ vague.covariance @ F.T + Q
    east, north = mean[[0, 2]] - filter.sensor.positions_m[0][:2]
    squared = east**2 + north**2
    H = np.array([north, 0, -east, 0]) / squared
    bend = 0.5 * (P[0, 0] + P[2, 2]) / squared
    S = H @ P @ H + filter.sensor.sigmas_rad[0] ** 2 + bend**2
    innovation = twin.wrapped(azimuth[0] - np.arctan2(east, north))
    weight, K = 1 / (1 + innovation**2 / S / 4), P @ H / S
    assert weight < 0.8
    np.testing.assert_allclose(after.mean, mean + weight * K * innovation)
    np.testing.assert_allclose(after.covariance, P - weight * S * np.outer(K, K))


@pytest.mark.parametrize("seed", [144, 145])
def test_a_filter_waits_until_a_place_beside_a_sensor_is_told(seed):
    """The first bearings meet on the sensor: a place of hundreds of metres once their bend is counted."""
    sensor, path, sets = scene(seed)
    found = ExtendedKalmanFilter(motion=MOTION, sensor=sensor, start_speed_sd_mps=10.0).track(sets)
    assert np.sqrt(np.trace(found.covariances[0][np.ix_([0, 2], [0, 2])])) > 100
    assert found.started == 1
    # afterwards it is no further off than it says, over the thirty times together at one in a thousand
    told = nees((found.states - path)[None, 1:], found.covariances[None, 1:])
    assert told.mean.max() < chi2.ppf(1 - 1e-3 / len(path), 4)


def test_a_bearing_through_north_is_no_jump():
    sensor = BearingSensors(positions_m=((0, 0, 0), (50, 0, 0)), sigma_deg=0.5)
    times = np.arange(20.0)
    path = np.column_stack([-10 + times, 0 * times + 1, 0 * times + 60, 0 * times])
    sets = sensor.simulate(path, times, np.random.default_rng(1))
    found = ExtendedKalmanFilter(motion=ConstantVelocity(q=0.01), sensor=sensor).track(sets)
    assert np.hypot(*(found.states - path)[3:, [0, 2]].T).max() < 4.0


def test_refused():
    filter = made("cv")
    sets = recorded(PROBLEMS["cv"])[2]
    *_, state = run(filter, sets, RNG)
    with pytest.raises(DataError, match="sort the measurements by time"):
        filter.step(state, sets[-2].time_s, sets[-2], RNG)
    with pytest.raises(DataError, match="there is none; a path needs at least one"):
        filter.track([BearingSet(0.0, np.empty(0, int), np.empty(0), np.empty(0))])
    with pytest.raises(Exception, match="neither linear nor"):
        transitions_of("walk", np.arange(3.0))
    assert len(PLACES) == 3


def turning_flight(number):
    """A turn of Jiang et al. at 25 degrees, as the reproduction draws it."""
    case = FlightCase(motion="ctrv", sigma_deg=25.0)
    flight = case.simulate(np.random.default_rng(np.random.SeedSequence(2024, spawn_key=(number,))))
    filter = ExtendedKalmanFilter(
        motion=MOVES["ctrv"], sensor=case.mean_sensors, position_noise_m=STEP_NOISE_M, loss="squares"
    )
    return filter, flight


def ground_nees(found, flight):
    off = (found.states[:, :4] - flight.states)[:, [0, 2], None]
    spread = found.covariances[:, [0, 2]][:, :, [0, 2]]
    return (off * np.linalg.solve(spread, off)).sum(axis=(1, 2))


def test_a_most_probable_first_place_on_a_sensor_is_not_taken_as_certain():
    """Flight 600: the first bearings of two sensors meet behind the third, beside which the target is."""
    filter, flight = turning_flight(600)
    found = filter.track(flight.sets)
    x, y = np.meshgrid(np.linspace(-40, 40, 801), np.linspace(-40, 40, 801))
    squared = sum(
        twin.wrapped(azimuth - np.arctan2(x - place[0], y - place[1])) ** 2 / filter.sensor.sigmas_rad[0] ** 2
        for place, azimuth in zip(filter.sensor.positions_m, flight.azimuth_rad[0], strict=True)
    )
    exact = np.cov(x.ravel(), y.ravel(), aweights=np.exp(-0.5 * (squared - squared.min())).ravel())
    claimed = found.covariances[0][np.ix_([0, 2], [0, 2])]
    assert (np.linalg.eigvalsh(claimed) > np.linalg.eigvalsh(exact)).all()
    assert ground_nees(found, flight).max() < 30


@pytest.mark.parametrize("smooth", longer([False, True], True))
def test_errors_on_a_turn_that_is_hardly_told_are_as_large_as_claimed(smooth):
    """Linearised before its turn rate is told, a turn leaves a mean of 3."""
    each = []
    for number in range(100):
        filter, flight = turning_flight(number)
        found = filter.track(flight.sets, smooth=smooth)
        assert found.started >= 2
        each.append(ground_nees(found, flight).mean())
    assert np.mean(each) == pytest.approx(2.0, abs=3.5 * np.std(each) / 10)
    assert np.mean(each) < 2.5
