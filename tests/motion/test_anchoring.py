"""A target that moves or lies at anchor: against matrix exponentials and the sum over all histories."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest
from scipy.linalg import block_diag, expm
from scipy.stats import multivariate_normal

from elusive.errors import ParameterError
from elusive.filters.particle.coast_error import anchored_probability
from elusive.filters.particle.sir import ParticleFilter
from elusive.motion import ConstantVelocity, MovingOrAnchored, complete
from elusive.motion.anchoring import swing
from tests.reference.motion import van_loan

T = 10.0
MOTION = MovingOrAnchored(q=0.05, mean_moving_s=60.0, mean_anchored_s=90.0, swing_mps=0.3, swing_s=15.0)


@pytest.mark.parametrize("interval_s", [1e-3, 0.1, 9.9, 10.1, 60.0, 2000.0])
def test_the_swing_is_the_exact_solution(interval_s):
    """Below and above the interval from which the variance is not a series any more."""
    F, Q = swing(interval_s, 0.7, 20.0)
    A, D = np.array([[0.0, 1.0], [0.0, -1 / 20.0]]), np.diag([0.0, 2 * 0.7**2 / 20.0])
    steps = max(1, int(interval_s // 50))
    F_step, Q_step = van_loan(A, D, interval_s / steps)
    expected = np.zeros((2, 2))
    for _ in range(steps):
        expected = F_step @ expected @ F_step.T + Q_step
    assert np.linalg.matrix_power(F_step, steps) == pytest.approx(F, rel=1e-9, abs=1e-12)
    assert pytest.approx(expected, rel=1e-8) == Q
    assert np.linalg.eigvalsh(Q).min() > 0


def test_the_switch_is_the_exponential_of_its_rates():
    rates = np.array([[-1 / 60, 1 / 60], [1 / 90, -1 / 90]])
    stays = expm(10.0 * rates)
    assert MOTION.switching(T) == pytest.approx((stays[0, 1], stays[1, 0]))
    assert MOTION.anchored_share == pytest.approx(0.6)
    states = np.zeros((200_000, 5))
    states[100_000:, 4] = 1.0
    anchored = MOTION.propagate(states, T, np.random.default_rng(1))[:, 4].reshape(2, -1)
    assert set(np.unique(anchored)) == {0.0, 1.0}
    assert anchored.mean(axis=1) == pytest.approx(stays[:, 1], abs=4 * 0.5 / np.sqrt(100_000))


@pytest.mark.parametrize("mode", [0.0, 1.0])
def test_each_mode_moves_as_its_own_motion(mode):
    motion = MOTION.replace(mean_moving_s=1e12, mean_anchored_s=1e12)
    n = 200_000
    states = np.tile([3.0, 2.0, -5.0, -1.0, mode], (n, 1))
    moved = motion.propagate(states, T, np.random.default_rng(2))[:, :4]
    if mode:
        F, Q = (block_diag(part, part) for part in swing(10.0, 0.3, 15.0))
    else:
        cv = ConstantVelocity(q=0.05)
        F, Q = cv.F(T), cv.Q(T)
    deviation = np.sqrt(np.diag(Q))
    assert (moved.mean(axis=0) - F @ states[0, :4]) / deviation == pytest.approx(0, abs=4.5 / np.sqrt(n))
    scale = np.outer(deviation, deviation)
    assert (np.cov(moved.T) - Q) / scale == pytest.approx(0, abs=4.5 * np.sqrt(2 / n))


class Place:
    """Position with a Gaussian error."""

    def log_likelihood(self, states, measurement):
        return -0.5 * ((states[:, [0, 2]] - measurement) ** 2).sum(axis=1) / 2.0**2


class Start:
    """What the exact filter starts from, too."""

    def sample(self, n, rng):
        return complete(MOTION, rng.normal(size=(n, 4)) * np.sqrt(np.diag(START)), rng)


START = np.diag([9.0, 1.0, 9.0, 1.0])


def all_histories(measurements):
    """P(at anchor | measurements): a Kalman filter for every sequence of modes."""
    stops, leaves = MOTION.switching(T)
    change = np.array([[1 - stops, stops], [leaves, 1 - leaves]])
    cv = ConstantVelocity(q=MOTION.q)
    models = [(cv.F(T), cv.Q(T)), [block_diag(part, part) for part in swing(10.0, 0.3, 15.0)]]
    H, R = np.eye(4)[[0, 2]], 4.0 * np.eye(2)
    total = np.zeros(2)
    for modes in product((0, 1), repeat=len(measurements)):
        mean, P = np.zeros(4), START
        weight = (1 - MOTION.anchored_share, MOTION.anchored_share)[modes[0]]
        for k, z in enumerate(measurements):
            if k:
                F, Q = models[modes[k]]
                mean, P = F @ mean, F @ P @ F.T + Q
            S = H @ P @ H.T + R
            weight *= multivariate_normal.pdf(z, H @ mean, S)
            K = P @ H.T @ np.linalg.inv(S)
            mean, P = mean + K @ (z - H @ mean), P - K @ H @ P
        for before, after in pairwise(modes):
            weight *= change[before, after]
        total[modes[-1]] += weight
    return total[1] / total.sum()


@pytest.mark.parametrize(("speed", "about"), [(0.0, 0.91), (0.5, 0.79), (1.5, 0.33)])
def test_the_probability_of_an_anchor_is_that_of_all_histories(speed, about):
    rng = np.random.default_rng(3)
    measurements = [np.array([10.0 * speed * k, 0.0]) + rng.normal(scale=2.0, size=2) for k in range(7)]
    filter_ = ParticleFilter(motion=MOTION, sensor=Place(), prior=Start(), particles=20_000)
    found = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        state = filter_.init(rng, 0.0)
        state = state._replace(weights=likely(state.particles, measurements[0]))
        for z in measurements[1:]:
            state = filter_.step(state, state.time_s + T, z, rng)
        found.append(anchored_probability(filter_.state_names, state.particles, state.weights))
    expected = all_histories(measurements)
    assert np.mean(found) == pytest.approx(expected, abs=max(4 * np.std(found, ddof=1) / 2, 0.01))
    assert expected == pytest.approx(about, abs=0.01)


def likely(particles, z):
    weight = np.exp(Place().log_likelihood(particles, z))
    return weight / weight.sum()


def test_a_motion_without_an_anchor_has_no_probability_of_one():
    assert anchored_probability(("x", "vx", "y", "vy"), np.zeros((2, 4)), np.full(2, 0.5)) is None


@pytest.mark.parametrize("field", ["mean_moving_s", "mean_anchored_s", "swing_s"])
def test_times_must_be_positive(field):
    with pytest.raises(ParameterError, match=field):
        MovingOrAnchored(**{field: 0.0})
