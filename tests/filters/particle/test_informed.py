"""Particles drawn with the measurement in view: exact moments and evidence where they are known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from elusive.filters.particle import _informed_kernels as kernels
from elusive.filters.particle.informed import WIDENED, FittedLikelihood, draw_informed, fit_likelihood, smoothed
from elusive.motion import ConstantTurnRateVelocity, ConstantVelocity
from tests.reference import particle as reference

MOTION, T = ConstantVelocity(q=0.4), 1.5
MEAN, ROOT = np.array([1.0, 0.5, -2.0, 0.2]), np.diag([1.0, 0.6, 0.8, 0.5])
H = np.eye(4)[[0, 2]]
NOISE = np.array([[0.05, 0.01], [0.01, 0.08]])
MEASURED = np.array([3.2, -2.9])


def prior(n, rng):
    return np.asfortranarray(MEAN + rng.standard_normal((n, 4)) @ ROOT.T)


def log_likelihood(states):
    return multivariate_normal.logpdf(states[:, [0, 2]], MEASURED, NOISE)


def posterior():
    """Mean, covariance and log evidence by a Kalman update."""
    F, Q = MOTION.F(T), MOTION.Q(T)
    mean, covariance = F @ MEAN, F @ ROOT @ ROOT.T @ F.T + Q
    spread = H @ covariance @ H.T + NOISE
    gain = covariance @ H.T @ np.linalg.inv(spread)
    evidence = multivariate_normal.logpdf(MEASURED, H @ mean, spread)
    return mean + gain @ (MEASURED - H @ mean), covariance - gain @ H @ covariance, evidence


@pytest.mark.parametrize("off", [0.0, 0.4])
def test_weights_are_exact_whatever_the_fit_is_worth(off):
    rng, n, runs = np.random.default_rng(0), 400, 200
    fitted = FittedLikelihood(MEASURED + off, 1.5 * NOISE)
    found, evidence = [], []
    for _ in range(runs):
        cloud = draw_informed(prior(n, rng), np.full(n, 1 / n), MOTION, T, fitted, (0, 2), n, rng)
        mass = np.exp(cloud.log_prior + log_likelihood(cloud.states))
        evidence.append(mass.sum())
        found.append(mass @ cloud.states / mass.sum())
    mean, covariance, log_evidence = posterior()
    evidence = np.array(evidence)
    assert evidence.mean() == pytest.approx(math.exp(log_evidence), abs=4.5 * evidence.std() / math.sqrt(runs))
    spread = np.std(found, axis=0)
    np.testing.assert_allclose(np.mean(found, axis=0), mean, atol=(4.5 * spread / math.sqrt(runs)).max() + 0.01)
    # a cloud of n as good as n / 8 independent draws of the posterior, where the fit is right
    assert off or (spread < np.sqrt(np.diag(covariance) * 8 / n)).all()


def test_plain_predictions_do_worse():
    rng, n = np.random.default_rng(1), 400
    fitted = FittedLikelihood(MEASURED, 1.5 * NOISE)
    informed = draw_informed(prior(n, rng), np.full(n, 1 / n), MOTION, T, fitted, (0, 2), n, rng)
    plain = MOTION.propagate(prior(n, rng), T, rng)
    effective = []
    for states, log_prior in ((informed.states, informed.log_prior), (plain, np.zeros(n))):
        weights = np.exp(log_prior + log_likelihood(states))
        effective.append(weights.sum() ** 2 / (weights @ weights))
    assert effective[0] > 5 * effective[1]


def test_a_gaussian_likelihood_is_fitted():
    rng, n = np.random.default_rng(2), 20_000
    places = MOTION.propagate(prior(n, rng), T, rng)[:, [0, 2]]
    level = multivariate_normal.logpdf(places, MEASURED, NOISE)
    fitted = fit_likelihood(places, np.full(n, -math.log(n)), level)
    np.testing.assert_allclose(fitted.mean, MEASURED, atol=0.05)
    np.testing.assert_allclose(fitted.covariance, WIDENED * NOISE, atol=0.02)


def test_a_likelihood_that_says_nothing_is_wide():
    rng = np.random.default_rng(3)
    places = rng.standard_normal((300, 2))
    fitted = fit_likelihood(places, np.full(300, -math.log(300)), np.zeros(300))
    assert np.linalg.eigvalsh(fitted.covariance).min() > 1e5


def test_a_motion_that_is_not_linear_is_predicted():
    rng, motion = np.random.default_rng(4), ConstantTurnRateVelocity()
    states = np.zeros((50, 5))
    states[:, 3] = 1.0
    cloud = draw_informed(states, np.full(50, 0.02), motion, 1.0, FittedLikelihood(MEASURED, NOISE), (0, 2), 80, rng)
    assert cloud.states.shape == (80, 5)
    np.testing.assert_allclose(cloud.log_prior, -math.log(80))


def test_kernels_equal_their_twins():
    rng, n = np.random.default_rng(5), 30
    states, weights = prior(n, rng), rng.random(n)
    F, precision = MOTION.F(T)[[0, 2]], np.linalg.inv(NOISE)
    found = kernels.selection(states, weights, F, MEASURED, precision)
    np.testing.assert_allclose(found, reference.selection(states, weights, F, MEASURED, precision), rtol=1e-12)
    seen, root, gain = np.array([0, 2]), np.linalg.cholesky(NOISE), rng.standard_normal((2, 4))
    arguments = (seen, MEASURED, root, precision, gain, rng.standard_normal((25, 2)))
    expected = reference.corrected(states, *arguments)
    level = kernels.correct(states, *arguments)
    np.testing.assert_allclose(states, expected[0], rtol=1e-12)
    np.testing.assert_allclose(level, expected[1], rtol=1e-12)


def test_smoothing_leaves_mean_and_covariance():
    rng, n = np.random.default_rng(7), 20_000
    states, weights = prior(n, rng), rng.random(n)
    weights /= weights.sum()
    drawn = smoothed(states, weights, len(states), 0.3, rng)
    mean = weights @ states
    np.testing.assert_allclose(drawn.mean(axis=0), mean, atol=5 / math.sqrt(n))
    np.testing.assert_allclose(np.cov(drawn.T), np.cov(states.T, aweights=weights), atol=0.05)
    assert len(np.unique(drawn[:, 0])) == n


@pytest.mark.parametrize("wanted", [20.0, 100.0, 199.0])
def test_the_greatest_share_keeps_as_many_particles_effective(wanted):
    rng = np.random.default_rng(8)
    level, carried = 30 * rng.standard_normal(400), 0.5 * rng.standard_normal(400)
    share = kernels.greatest_share(level, carried, 1.0, wanted)
    assert reference.effective_size(share * level + carried) == pytest.approx(wanted, rel=1e-3)
    assert kernels.greatest_share(level, carried, 1e-4, wanted) == 1e-4
