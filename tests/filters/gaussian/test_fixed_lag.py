"""The sliding window: exact where the problem is linear, the whole path where the lag is long, and as live."""

from __future__ import annotations

import numpy as np
import pytest

from elusive import run
from elusive.errors import DataError
from elusive.filters.gaussian._block_kernels import inverse
from elusive.filters.gaussian._map_kernels import inverse_noise
from elusive.filters.gaussian._window_kernels import summed_out
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.motion import ConstantVelocity
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearing_table import tabulated
from tests.filters.gaussian.bearing_scenes import FLAT, PROBLEMS, recorded
from tests.reference import bearings as twin

RNG = np.random.default_rng(0)


def made(name, **changes):
    return FixedLagSmoother(**{"loss": "squares", **PROBLEMS[name], **changes})


@pytest.mark.parametrize("name", PROBLEMS)
def test_what_leaves_is_summed_out_of_the_gaussian(name):
    problem = made(name)
    times, path, sets = recorded(PROBLEMS[name], steps=3)
    d = len(problem.state_names)
    path = np.column_stack([path, RNG.normal(size=(3, d - path.shape[1]))])
    table, transitions, anchor = tabulated(sets, problem.sensor), problem.transitions(times), problem.anchor()
    left = summed_out(path, table, transitions, inverse_noise(transitions), anchor, problem.robust)
    # the terms of the first state alone, whitened
    first = tabulated(
        [sets[0], sets[1]._replace(sensor=sets[1].sensor[:0], azimuth_rad=np.empty(0), elevation_rad=np.empty(0))],
        problem.sensor,
    )
    flat = path[:2].ravel()
    J = twin.numeric_jacobian(lambda f: twin.residuals(problem, first, f, path[:2]), flat, 1e-5)
    H, g = J.T @ J, -J.T @ twin.residuals(problem, first, flat, path[:2])
    gain = H[d:, :d] @ np.linalg.inv(H[:d, :d])
    scale = np.sqrt(np.diag(H[d:, d:]))
    np.testing.assert_allclose(
        left.information / np.outer(scale, scale), (H[d:, d:] - gain @ H[:d, d:]) / np.outer(scale, scale), atol=1e-5
    )
    np.testing.assert_allclose(
        left.pull / scale, (g[d:] - gain @ g[:d]) / scale, atol=1e-4 * np.abs(g / np.sqrt(np.diag(H))).max()
    )
    np.testing.assert_array_equal(left.at, path[1])


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_lag_longer_than_the_recording_is_the_most_probable_path(name):
    _, _, sets = recorded(PROBLEMS[name])
    lagged = made(name, lag_s=1000.0, iterations=30).track(sets)
    whole = MapSmoother(**{"loss": "squares", **PROBLEMS[name]}).smooth(sets)
    deviation = np.sqrt(np.diagonal(whole.covariances, axis1=1, axis2=2))
    assert (np.abs(lagged.states - whole.states) < 1e-2 * deviation).all()
    np.testing.assert_allclose(lagged.covariances, whole.covariances, rtol=0.02, atol=0.02 * deviation.max() ** 2)
    np.testing.assert_array_equal(lagged.times_s, whole.times_s)


def test_each_state_is_given_the_bearings_of_the_lag_after_it():
    parameters = {"motion": ConstantVelocity(q=0.2), "sensor": FLAT.replace(sigma_deg=0.02), "loss": "squares"}
    times, _, sets = recorded(parameters, steps=20)
    lag_s = 3.0
    lagged = FixedLagSmoother(**parameters, lag_s=lag_s).track(sets)
    np.testing.assert_array_equal(lagged.times_s, times)
    for k in range(20):
        # a time leaves with the first bearings that are a lag after the next
        later = np.flatnonzero(times >= times[min(k + 1, 19)] + lag_s)
        known = sets[: later[0] + 1] if len(later) else sets
        whole = MapSmoother(**parameters).smooth(known)
        deviation = np.sqrt(np.diag(whole.covariances[k]))
        assert (np.abs(lagged.states[k] - whole.states[k]) < 0.05 * deviation).all()
        np.testing.assert_allclose(np.sqrt(np.diag(lagged.covariances[k])), deviation, rtol=0.02)


def test_live_and_recorded_are_the_same():
    filter = made("height", lag_s=2.0)
    times, _, sets = recorded(PROBLEMS["height"], steps=20)
    states = list(run(filter, sets, RNG))
    whole = filter.track(sets)
    left = np.concatenate([s.left_means for s in states])
    assert 0 < len(left) < 20
    np.testing.assert_allclose(left, whole.states[: len(left)])
    last = states[-1]
    assert last.time_s == times[-1]
    assert last.window.stretch.times_s[0] > times[-1] - 2.0 - np.diff(times).max()
    np.testing.assert_allclose(last.mean, last.window.path[-1])
    later = filter.step(last, times[-1] + 1.0, None, RNG)
    assert later.time_s == times[-1] + 1.0
    np.testing.assert_allclose(later.mean, filter.motion.F(1.0) @ last.mean, rtol=1e-6, atol=1e-4)
    assert (np.diag(later.covariance) > np.diag(last.covariance)).all()


def test_of_one_sensor_nothing_leaves_before_a_second_one_tells_the_place():
    _, path, sets = recorded(PROBLEMS["cv"], steps=16)
    alone = [
        s._replace(sensor=s.sensor[:1], azimuth_rad=s.azimuth_rad[:1], elevation_rad=s.elevation_rad[:1])
        for s in sets[:8]
    ]
    filter = made("cv", lag_s=1.0)
    states = list(run(filter, [*alone, *sets[8:]], RNG))
    assert [s.started for s in states] == [False] * 8 + [True] * 8
    assert not any(len(s.left_times_s) for s in states[:8])
    assert len(states[8].left_times_s) > 3
    assert np.hypot(*(states[-1].mean - path[-1])[[0, 2]]) < 5.0
    assert filter.step(filter.init(RNG), 0.0, None, RNG).window is None


def test_the_inverse_from_a_factor():
    A = RNG.normal(size=(5, 5))
    A = A @ A.T + np.eye(5)
    np.testing.assert_allclose(inverse(np.linalg.cholesky(A)), np.linalg.inv(A))


def test_refused():
    filter = made("cv")
    _, _, sets = recorded(PROBLEMS["cv"])
    *_, state = run(filter, sets, RNG)
    with pytest.raises(DataError, match="sort the measurements by time"):
        filter.step(state, sets[-2].time_s, sets[-2], RNG)
    nothing = BearingSet(0.0, np.empty(0, int), np.empty(0), np.empty(0))
    for none in ([], [nothing]):
        with pytest.raises(DataError, match="there is none; a path needs at least one"):
            filter.track(none)
