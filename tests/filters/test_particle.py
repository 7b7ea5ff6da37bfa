"""The SIR particle filter against the Kalman filter, under maps, and with a user's own parts."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from elusive import run
from elusive.errors import DataError, ParameterError
from elusive.filters.particle import GaussianPrior, ParticleFilter
from elusive.motion import ConstantVelocity

H = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0]])
R = 0.5 * np.eye(2)
P0 = np.diag([1.0, 0.2, 1.0, 0.2])


class Fix:
    """Position with Gaussian noise, a proper density."""

    def log_likelihood(self, states, measurement):
        return multivariate_normal(measurement, R).logpdf(states[:, [0, 2]])


class OwnMotion:
    """Constant velocity in a user's plain NumPy."""

    state_names = ("x", "vx", "y", "vy")

    def propagate(self, states, rng):
        builtin = ConstantVelocity(q=0.05)
        return states @ builtin.F.T + rng.multivariate_normal(np.zeros(4), builtin.Q, len(states))


class Shore:
    """Land, where no target can be, on one side."""

    def __init__(self, x):
        self.x = x

    def log_probability(self, states):
        return np.where(states[:, 0] > self.x, 0.0, -np.inf)


def prior(covariance=P0, mean=(0.0, 0.3, 0.0, -0.2)):
    return GaussianPrior(mean=mean, covariance=tuple(map(tuple, np.asarray(covariance).tolist())))


def kalman(measurements):
    """Mean, covariance and log evidence after each measurement."""
    motion = ConstantVelocity(q=0.05)
    m, P, states = np.array([0.0, 0.3, 0.0, -0.2]), P0, []
    for z in measurements:
        m, P = motion.F @ m, motion.F @ P @ motion.F.T + motion.Q
        evidence = 0.0
        if z is not None:
            S = H @ P @ H.T + R
            evidence = multivariate_normal(H @ m, S).logpdf(z)
            K = P @ H.T @ np.linalg.inv(S)
            m, P = m + K @ (z - H @ m), P - K @ S @ K.T
        states.append((m, P, evidence))
    return states


def track(n=8):
    rng = np.random.default_rng(1)
    state, seen = rng.multivariate_normal([0, 0.3, 0, -0.2], P0), []
    motion = ConstantVelocity(q=0.05)
    for k in range(n):
        state = rng.multivariate_normal(motion.F @ state, motion.Q)
        seen.append(None if k == 4 else rng.multivariate_normal(H @ state, R))
    return seen


@pytest.mark.parametrize(
    ("motion", "resampling"),
    [
        (ConstantVelocity(q=0.05), "systematic"),
        (ConstantVelocity(q=0.05), "stratified"),
        (ConstantVelocity(q=0.05), "residual"),
        (ConstantVelocity(q=0.05), "multinomial"),
        (OwnMotion(), "systematic"),
    ],
)
def test_it_agrees_with_the_kalman_filter(motion, resampling):
    model = ParticleFilter(motion=motion, sensor=Fix(), prior=prior(), particles=5000, resampling=resampling)
    runs, seen = 10, track()
    every = [list(run(model, seen, np.random.default_rng(seed))) for seed in range(runs)]
    exact = kalman(seen)
    for k, (m, P, _) in enumerate(exact):
        means = np.array([states[k].mean for states in every])
        deviations = np.sqrt(np.diag(P))
        # between-run error of the mean of runs, and a bias of the order of 1 / N
        error = means.std(axis=0, ddof=1) / np.sqrt(runs)
        np.testing.assert_array_less(abs(means.mean(axis=0) - m), 5.5 * error + deviations / 100)
        np.testing.assert_array_less(error, 0.1 * deviations)
        covariances = np.array([states[k].covariance for states in every])
        error = covariances.std(axis=0, ddof=1) / np.sqrt(runs)
        scale = np.outer(deviations, deviations)
        np.testing.assert_array_less(abs(covariances.mean(axis=0) - P), 5.5 * error + scale / 50)
        np.testing.assert_array_less(error, 0.2 * scale)
    total = np.array([sum(state.log_evidence for state in states) for states in every])
    expected = sum(evidence for *_, evidence in exact)
    # the estimate of the evidence has no bias; its logarithm has one of minus half its variance
    assert abs(total.mean() + total.var() / 2 - expected) < 5 * total.std() / np.sqrt(runs)
    assert total.std() < 1


def test_without_a_measurement_the_evidence_is_one():
    model = ParticleFilter(motion=ConstantVelocity(), sensor=Fix(), prior=prior())
    state = next(run(model, [None], np.random.default_rng(0)))
    assert state.log_evidence == pytest.approx(0, abs=1e-12)


def test_a_map_keeps_the_belief_off_the_land():
    n = 20_000
    still = {"motion": ConstantVelocity(q=0.0), "sensor": Fix(), "particles": n, "knowledge": Shore(0.5)}
    model = ParticleFilter(prior=prior(np.diag([1.0, 0, 1.0, 0]), (0.0,) * 4), **still)
    state = model.init(np.random.default_rng(1))
    assert (state.particles[state.weights > 0, 0] > 0.5).all()
    # a standard normal above .5: probability .30854, mean 1.14108
    share = 0.30853754
    assert state.log_evidence == pytest.approx(np.log(share), abs=5 * np.sqrt((1 - share) / share / n))
    assert state.mean[0] == pytest.approx(1.1410777, abs=5 * 0.52 / np.sqrt(share * n))
    after = model.step(state, None, np.random.default_rng(2))
    assert after.log_evidence == pytest.approx(0, abs=1e-9)
    assert (after.particles[after.weights > 0, 0] > 0.5).all()


def test_where_nothing_explains_the_measurement_it_says_so_and_goes_on():
    motion, sensor = ConstantVelocity(q=0.05), Fix()
    forbidden = ParticleFilter(motion=motion, sensor=sensor, prior=prior(), knowledge=Shore(1e6), particles=500)
    states = list(run(forbidden, track(), np.random.default_rng(4)))
    for state in states:
        assert state.log_evidence == -np.inf
        assert np.isfinite(state.mean).all()
        assert state.weights.sum() == pytest.approx(1)
    open_water = forbidden.replace(knowledge=None)
    state = open_water.step(states[-1], np.array([0.0, 0.0]), np.random.default_rng(5))
    assert np.isfinite(state.log_evidence)
    assert state.weights.max() > 1.5 / 500


@pytest.mark.parametrize(("below", "resampled"), [(0.0, False), (1.0, True)])
def test_it_resamples_when_told_to(below, resampled):
    model = ParticleFilter(
        motion=ConstantVelocity(q=0.0), sensor=Fix(), prior=prior(), particles=400, resample_below=below
    )
    rng = np.random.default_rng(6)
    state = model.step(model.init(rng), np.array([2.0, 0.0]), rng)
    after = model.step(state, None, rng)
    assert (len(np.unique(after.particles[:, 0])) < 400) == resampled
    np.testing.assert_array_equal(np.ptp(after.weights) < 1e-15, resampled)


def test_a_prior_that_does_not_fit_is_refused():
    short = GaussianPrior(mean=(0.0,), covariance=((1.0,),))
    model = ParticleFilter(motion=ConstantVelocity(), sensor=Fix(), prior=short, particles=10)
    with pytest.raises(DataError, match=r"prior: drew states of shape \(10, 1\), the motion needs \(10, 4\) \(x, vx"):
        model.init(np.random.default_rng(0))
    with pytest.raises(ParameterError, match="covariance must have 2 rows of 2 numbers"):
        GaussianPrior(mean=(0.0, 0.0), covariance=((1.0,),))
    for bad in ([[1.0, 2.0], [2.0, 1.0]], [[1.0, 0.5], [0.0, 1.0]]):
        with pytest.raises(ParameterError, match="symmetric and have no negative eigenvalue"):
            prior(bad, (0.0, 0.0))
    with pytest.raises(ParameterError, match=r"ParticleFilter\.motion"):
        ParticleFilter(motion=3, sensor=Fix(), prior=short)


def test_the_prior_has_its_moments():
    covariance = np.array([[2.0, 0.6, 0.0], [0.6, 1.0, 0.0], [0.0, 0.0, 0.0]])
    n = 50_000
    drawn = prior(covariance, (1.0, 2.0, 3.0)).sample(n, np.random.default_rng(7))
    np.testing.assert_array_less(abs(drawn.mean(axis=0) - [1, 2, 3]), 5 * np.sqrt(np.diag(covariance) / n) + 1e-12)
    error = np.sqrt((np.outer(np.diag(covariance), np.diag(covariance)) + covariance**2) / n)
    np.testing.assert_array_less(abs(np.cov(drawn.T) - covariance), 5 * error + 1e-12)
