"""Interacting multiple models: against textbook matrices, a single model, and a manoeuvre that nobody announced."""

from __future__ import annotations

import numpy as np
import pytest

from elusive import run
from elusive.errors import DataError, ParameterError
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.interacting import InteractingFilter
from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, ConstantVelocity
from elusive.motion.altitude import WithAltitude
from elusive.sensors.bearing_table import tabulated
from elusive.sensors.bearings import BearingSensors
from tests.filters.gaussian.bearing_scenes import FLAT, PROBLEMS, SOLID, recorded
from tests.reference import bearings as twin

RNG = np.random.default_rng(0)
MOTIONS = (
    ConstantVelocity(q=0.5),
    ConstantAcceleration(q=0.05),
    ConstantTurnRateVelocity(q_speed=0.05, q_turn=1e-3),
)


def beliefs_of(filter, state):
    columns, sizes, _ = filter._columns
    out = []
    for j, problem in enumerate(filter.problems):
        own = columns[j, : sizes[j]]
        out.append((problem.state_names, state.bank.means[j, own], state.bank.covariances[j][np.ix_(own, own)]))
    return out


@pytest.mark.parametrize("bias", [None, {"sd_deg": 1.0, "memory_s": 20.0}])
def test_a_step_is_the_textbooks(bias):
    filter = InteractingFilter(
        motions=MOTIONS, sensor=FLAT, position_noise_m=0.3, loss="squares", stay_s=3.0, iterations=2, bias=bias
    )
    _, _, sets = recorded(PROBLEMS["cv"], steps=8)
    table = tabulated(sets, FLAT)
    states = list(run(filter, sets, RNG))
    begun = next(k for k, state in enumerate(states) if state.pending is None)
    for k in range(begun + 1, 8):
        before, after = states[k - 1], states[k]
        probabilities, beliefs, worth = twin.interacting(
            filter.problems,
            table,
            k,
            table.times_s[k] - table.times_s[k - 1],
            3.0,
            before.bank.probabilities,
            beliefs_of(filter, before),
            2,
        )
        np.testing.assert_allclose(after.bank.probabilities, probabilities, atol=1e-4)
        assert after.log_evidence == pytest.approx(worth, abs=1e-3)
        for (_, mean, covariance), (_, expected, spread) in zip(beliefs_of(filter, after), beliefs, strict=True):
            deviation = np.sqrt(np.diag(spread))
            assert (np.abs(mean - expected) < 1e-3 * deviation).all()
            np.testing.assert_allclose((covariance - spread) / np.outer(deviation, deviation), 0.0, atol=1e-3)
        common = np.array([mean[:4] for _, mean, _ in beliefs])
        mean = probabilities @ common
        np.testing.assert_allclose(after.mean[:4], mean, atol=1e-2)
        away = common - mean
        spread = sum(
            p * (P[:4, :4] + np.outer(a, a)) for p, (_, _, P), a in zip(probabilities, beliefs, away, strict=True)
        )
        np.testing.assert_allclose(after.covariance[:4, :4], spread, atol=1e-2 * spread.max())


def test_equal_models_are_the_extended_filter():
    """Three everywhere: the bank is compiled for a number of models."""
    _, _, sets = recorded(PROBLEMS["height"], steps=12)
    alone = InteractingFilter(motions=(PROBLEMS["height"]["motion"],) * 3, sensor=SOLID, iterations=10).track(sets)
    extended = ExtendedKalmanFilter(**PROBLEMS["height"]).track(sets)
    np.testing.assert_allclose(alone.states, extended.states, atol=1e-9)
    np.testing.assert_allclose(alone.covariances, extended.covariances, atol=1e-9)
    assert (alone.started, alone.log_evidence) == (extended.started, pytest.approx(extended.log_evidence))


def test_live_steps_are_the_recordings():
    _, _, sets = recorded(PROBLEMS["jerk"], steps=12)
    plane = (ConstantVelocity(q=0.5), ConstantAcceleration(q=0.05), ConstantVelocity(q=0.01))
    motions = tuple(WithAltitude(motion=motion, q_vertical=0.2) for motion in plane)
    filter = InteractingFilter(motions=motions, sensor=SOLID)
    assert filter.state_names == ("x", "vx", "y", "vy", "z", "vz")
    whole, states = filter.track(sets), list(run(filter, sets, RNG))
    np.testing.assert_allclose([s.mean for s in states], whole.states, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose([s.bank.probabilities for s in states], whole.probabilities, atol=1e-8)
    np.testing.assert_allclose(whole.probabilities.sum(axis=1), 1.0)
    assert filter.step(filter.init(RNG), 0.0, None, RNG).pending == ()


def test_a_manoeuvre_need_not_be_known_beforehand():
    """Straight, a turn of 9 degrees a second, straight: the bank beats each of its models over the whole."""
    places = ((0.0, 0.0, 0.0), (700.0, 120.0, 0.0), (-600.0, 810.0, 0.0))
    sensor = BearingSensors(positions_m=places, samples=10)
    bank = InteractingFilter(sensor=sensor, loss="squares")
    filters = [bank, *(ExtendedKalmanFilter(motion=m, sensor=sensor, loss="squares") for m in bank.motions)]
    straight, turn = ConstantVelocity(q=0.01), ConstantTurnRateVelocity(q_speed=0.01, q_turn=1e-6)
    rng, times, runs = np.random.default_rng(0), np.arange(60.0), 25
    squared, told, worth = np.zeros((4, runs)), np.zeros((runs, 60, 3)), []
    for trial in range(runs):
        state, path = np.array([0.0, 20.0, 0.0, 5.0]), []
        for k in range(60):
            path.append(state)
            turning = 20 <= k < 35
            start = np.append(state, np.deg2rad(9.0)) if turning else state
            state = (turn if turning else straight).propagate(start[None], 1.0, rng)[0, :4]
        path = np.array(path)
        sets = sensor.simulate(path, times, rng)
        for each, filter in enumerate(filters):
            found = filter.track(sets)
            error = (found.states[:, :4] - path)[5:, [0, 2]]
            squared[each, trial] = (error**2).sum(axis=1).mean()
            if each == 0:
                told[trial] = found.probabilities
                spread = found.covariances[5:, [0, 2]][:, :, [0, 2]]
                worth.append(np.einsum("ki,kij,kj->k", error, np.linalg.inv(spread), error).mean())
    rmse = np.sqrt(squared.mean(axis=1))
    assert (rmse[0] < rmse[1:]).all()
    assert rmse[0] < rmse[1] / 2
    probabilities = told.mean(axis=0)
    assert (probabilities[10:20, 0] > 0.6).all()
    assert (probabilities[26:34, 2] > 0.5).all()
    assert (probabilities[45:, 0] > 0.6).all()
    # a bank keeps a reserve for what may come: it is not to be over-confident
    assert 1.0 < np.mean(worth) < 2.2


def test_refused():
    filter = InteractingFilter(sensor=FLAT)
    _, _, sets = recorded(PROBLEMS["cv"])
    *_, state = run(filter, sets, RNG)
    assert filter.step(state, state.time_s + 1.0, None, RNG).time_s == state.time_s + 1.0
    with pytest.raises(DataError, match="sort the measurements by time"):
        filter.step(state, sets[-2].time_s, sets[-2], RNG)
    with pytest.raises(DataError, match="there is none; a path needs at least one"):
        filter.track([FLAT.nothing(0.0)])
    with pytest.raises(ParameterError, match="has no height"):
        InteractingFilter(sensor=SOLID)
    with pytest.raises(ParameterError, match="motions"):
        InteractingFilter(sensor=FLAT, motions=())
