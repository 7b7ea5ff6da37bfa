"""Paths from bearings: batch MAP against GTSAM's own factors, a batch of filters against NumPy's one by one, live."""

from __future__ import annotations

import numpy as np
import pytest

from elusive import run
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.interacting import InteractingFilter
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.filters.gaussian.track_batch import filter_tracks
from elusive.motion import ConstantVelocity
from elusive.sensors.bearings import BearingSensors

PLACES = ((0.0, 0.0, 0.0), (70.0, 12.0, 0.0), (-60.0, 81.0, 0.0))
SENSOR = BearingSensors(positions_m=PLACES, sigma_deg=1.0)
LIVE_MS = 0.2


def recorded(motion, steps, rng, start=(20.0, 2.0, 30.0, -1.0)):
    state, path = np.array([start]), []
    for _ in range(steps):
        path.append(state[0])
        state = motion.propagate(state, 1.0, rng)
    return np.array(path), SENSOR.simulate(np.array(path), np.arange(float(steps)), rng)


def test_batch_map_against_gtsam(benchmark, best_of, report):
    """A walk without a velocity is what native factors of GTSAM can tell; ours carries its velocities all the same."""
    gtsam = pytest.importorskip("gtsam", reason="gtsam is not installed")
    steps, noise_m = 2000, 0.5
    rng = np.random.default_rng(0)
    places = np.clip(np.array([20.0, 30.0]) + np.cumsum(rng.normal(0, noise_m, (steps, 2)), axis=0), -200, 200)
    path = np.column_stack([places[:, 0], 0 * places[:, 0], places[:, 1], 0 * places[:, 0]])
    sets = SENSOR.simulate(path, np.arange(float(steps)), rng)
    smoother = MapSmoother(
        motion=ConstantVelocity(q=0.0),
        sensor=SENSOR,
        position_noise_m=noise_m,
        start_speed_sd_mps=1e-6,
        loss="squares",
        tolerance=1e-6,
    )
    stretch, anchor = smoother.stretch((each.time_s, each) for each in sets), smoother.anchor()
    table, transitions = stretch.table, stretch.transitions
    start = smoother.guess(stretch, anchor)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    fixed = gtsam.noiseModel.Constrained.All(3)
    for k, (east, north, _) in enumerate(PLACES):
        pose = gtsam.Pose2(east, north, 0.0)
        values.insert(gtsam.symbol("s", k), pose)
        graph.add(gtsam.PriorFactorPose2(gtsam.symbol("s", k), pose, fixed))
    wide = gtsam.noiseModel.Isotropic.Sigma(2, float(anchor.information[0, 0] ** -0.5))
    graph.add(gtsam.PriorFactorPoint2(0, anchor.at[[0, 2]], wide))
    angle = gtsam.noiseModel.Isotropic.Sigma(1, float(SENSOR.sigmas_rad[0]))
    walk = gtsam.noiseModel.Isotropic.Sigma(2, float(np.sqrt(transitions.Q[0, 0, 0])))
    for k in range(steps):
        values.insert(k, start[k, [0, 2]])
        for row in range(table.first[k], table.first[k + 1]):
            # its angles are counterclockwise from east
            seen = gtsam.Rot2(np.pi / 2 - table.azimuth_rad[row])
            graph.add(gtsam.BearingFactor2D(gtsam.symbol("s", int(table.sensor[row])), k, seen, angle))
        if k:
            graph.add(gtsam.BetweenFactorPoint2(k - 1, k, np.zeros(2), walk))
    settings = gtsam.LevenbergMarquardtParams()

    def theirs():
        return gtsam.LevenbergMarquardtOptimizer(graph, values, settings).optimize()

    def mine():
        return smoother.descend(start, np.empty(0), stretch, anchor)

    solved = theirs()
    found = mine().states[:, [0, 2]]
    np.testing.assert_allclose(found, [solved.atPoint2(k) for k in range(steps)], atol=2e-2)
    ours, other = best_of(mine, theirs, rounds=3)
    report(f"batch MAP, {steps} times of 3 bearings, against GTSAM's Levenberg-Marquardt, equal paths", other / ours, 1)
    benchmark(mine)


def numpy_tracks(filter, azimuth, start):
    """Extended filter and smoother of one track, vectorised over its bearings."""
    F, Q = filter.transitions(np.arange(2.0)).F[0], filter.transitions(np.arange(2.0)).Q[0]
    places, R0 = filter.sensor.places[:, :2], filter.sensor.sigmas_rad**2
    mean, P = start
    beliefs = [(mean, P)]
    for seen in azimuth[1:]:
        mean, P = F @ mean, F @ P @ F.T + Q
        east, north = mean[0] - places[:, 0], mean[2] - places[:, 1]
        range2 = east**2 + north**2
        H = np.zeros((len(places), 4))
        H[:, 0], H[:, 2] = north / range2, -east / range2
        error = (seen - np.arctan2(east, north) + np.pi) % (2 * np.pi) - np.pi
        S = H @ P @ H.T + np.diag(R0 + (0.5 * (P[0, 0] + P[2, 2]) / range2) ** 2)
        K = np.linalg.solve(S, H @ P).T
        mean, P = mean + K @ error, P - K @ S @ K.T
        beliefs.append((mean, P))
    smooth = [beliefs[-1]]
    for mean, P in beliefs[-2::-1]:
        ahead, spread = F @ mean, F @ P @ F.T + Q
        gain = np.linalg.solve(spread, F @ P).T
        later, wide = smooth[-1]
        smooth.append((mean + gain @ (later - ahead), P + gain @ (wide - spread) @ gain.T))
    return np.array([mean for mean, _ in smooth[::-1]])


def test_a_batch_of_tracks_against_numpy(benchmark, best_of, report):
    tracks, steps = 200, 50
    rng = np.random.default_rng(1)
    filter = ExtendedKalmanFilter(motion=ConstantVelocity(q=0.2), sensor=SENSOR, loss="squares", iterations=1)
    paths = [recorded(filter.motion, steps, rng) for _ in range(tracks)]
    azimuth = np.array([[each.azimuth_rad for each in sets] for _, sets in paths])
    times = np.arange(float(steps))
    filtered = filter_tracks(filter, times, azimuth)
    assert (filtered.started == 0).all()
    starts = [(filtered.states[k, 0], filtered.covariances[k, 0]) for k in range(tracks)]

    def theirs():
        return np.array([numpy_tracks(filter, azimuth[k], starts[k]) for k in range(tracks)])

    def mine():
        return filter_tracks(filter, times, azimuth, smooth=True).states

    np.testing.assert_allclose(mine()[:, 1:], theirs()[:, 1:], atol=1e-5)
    ours, other = best_of(mine, theirs, rounds=3)
    report(f"extended filter and smoother of {tracks} tracks of {steps} times, against NumPy's", other / ours, 10)
    benchmark(mine)


def test_ten_thousand_tracks_in_one_call(benchmark):
    """No rival: a time alone."""
    rng = np.random.default_rng(2)
    filter = ExtendedKalmanFilter(motion=ConstantVelocity(q=0.2), sensor=SENSOR)
    parts = [recorded(filter.motion, 50, rng) for _ in range(50)]
    azimuth = np.tile([[each.azimuth_rad for each in sets] for _, sets in parts], (200, 1, 1))
    found = benchmark.pedantic(filter_tracks, (filter, np.arange(50.0), azimuth), rounds=2, warmup_rounds=1)
    error = found.states[:50, 10:] - np.array([path for path, _ in parts])[:, 10:]
    assert len(found.states) == 10_000
    assert np.sqrt((error[..., [0, 2]] ** 2).sum(axis=-1).mean()) < 5.0


@pytest.mark.parametrize("kind", [ExtendedKalmanFilter, InteractingFilter, FixedLagSmoother])
def test_a_live_step(benchmark, best_of, report, kind):
    """Three sensors a second; a lag of five of them."""
    rng = np.random.default_rng(3)
    _, sets = recorded(ConstantVelocity(q=0.2), 40, rng)
    filter = kind(sensor=SENSOR, **({"lag_s": 5.0} if kind is FixedLagSmoother else {}))
    *_, state = run(filter, sets[:-1], rng)
    (seconds,) = best_of(lambda: filter.step(state, sets[-1].time_s, sets[-1], rng), rounds=5)
    report(
        f"live step of {kind.__name__}, three sensors, {LIVE_MS:g} ms over what it takes", LIVE_MS / 1e3 / seconds, 1
    )
    benchmark(filter.step, state, sets[-1].time_s, sets[-1], rng)
