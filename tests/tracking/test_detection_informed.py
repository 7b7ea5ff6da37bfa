"""Targets whose detection would leave few particles, beside the exact posterior of a Gaussian prediction."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from elusive.filters.particle import _kernels
from elusive.tracking.detection_informed import informed
from elusive.tracking.detection_targets import Expected, Pair, Target, evidence
from elusive.tracking.lifecycle import Life

N, TRIALS, NOWHERE, EVERY = 2000, 40, math.log(1e-6), np.array([0])
PLACE = np.array([0, 2])
# two seconds after a first detection: places to 10 m and 2 m, velocities to 8 m/s
MOVED = np.kron(np.eye(2), [[1.0, 2.0], [0.0, 1.0]])
COVARIANCE = MOVED @ np.diag([100.0, 64.0, 4.0, 64.0]) @ MOVED.T
ERRORS = np.diag([100.0, 1.0])


class Places:
    """Detections of places with Gaussian errors, each of nine targets in ten."""

    def detection_probabilities(self, states, measurement):
        return np.full(len(states), 0.9)

    def log_densities(self, states, measurement, which=None):
        found = [multivariate_normal(z, ERRORS).logpdf(states[:, PLACE]) for z in measurement]
        return np.column_stack(found if which is None else [found[k] for k in which])


class East:
    """A map: a target is in the east, of x above so much."""

    def __init__(self, x):
        self.x = x

    def log_probability(self, states):
        return np.where(states[:, 0] > self.x, 0.0, -np.inf)


def begun(rng, states=None, known=(), pair=None):
    particles = np.asfortranarray(rng.multivariate_normal(np.zeros(4), COVARIANCE, N) if states is None else states)
    weights = np.full(N, 1 / N)
    moments = _kernels.moments(particles, weights)
    target = Target(Life(), 0.1, particles, weights, *moments, weights, -1, 0.0, 1.0, False, 0.0, None, pair)
    allowed = np.exp(known[0].log_probability(particles)) if known else None
    return Expected.at_rest(target)._replace(allowed=allowed)


def asked(one, z, log_new=NOWHERE):
    return evidence(one, Places(), z, EVERY, np.array([log_new]), 1e-6)


def anew(one, z, rng, known=(), log_new=NOWHERE):
    return informed(one, asked(one, z, log_new), Places(), z, np.array([log_new]), known, 0.1, rng)


def exact(z):
    """Density of a detection, and the posterior's mean and covariance of place."""
    total = COVARIANCE[np.ix_(PLACE, PLACE)] + ERRORS
    gain = COVARIANCE[:, PLACE] @ np.linalg.inv(total)
    after = COVARIANCE - gain @ COVARIANCE[PLACE]
    density = 0.9 * multivariate_normal(np.zeros(2), total).pdf(z[0])
    return density, (gain @ z[0])[PLACE], after[np.ix_(PLACE, PLACE)]


@pytest.mark.parametrize("z", [(5.0, 3.0), (-20.0, 24.0), (10.0, 45.0)], ids=["slow", "fast", "fastest"])
def test_evidence_and_moments_are_those_of_the_exact_posterior(z):
    z = np.array([z])
    density, mean, covariance = exact(z)
    ratios, squares = [], []
    for seed in range(TRIALS):
        rng = np.random.default_rng([11, seed])
        one = anew(begun(rng), z, rng)
        found = asked(one, z)
        ratios.append(math.exp(found.log_made_itself[0]) / 0.1 / density)
        weights = found.weights * found.likely[1] / found.total[1]
        told, spread = _kernels.moments(one.particles, weights)
        off, inverse = told[PLACE] - mean, np.linalg.inv(spread[np.ix_(PLACE, PLACE)])
        squares.append(np.trace(inverse @ covariance) + off @ inverse @ off)
    assert np.mean(ratios) == pytest.approx(1, abs=0.05)
    assert np.mean(squares) == pytest.approx(2, abs=0.05)


def test_what_is_known_of_places_is_asked_of_what_is_drawn():
    z, east = np.array([(0.0, 30.0)]), East(2.0)
    rng = np.random.default_rng(3)
    one = anew(begun(rng, known=[east]), z, rng, known=[east])
    np.testing.assert_array_equal(one.allowed, one.particles[:, 0] > 2.0)
    assert 0.2 < one.weights @ one.allowed < 0.7


def test_the_prediction_stays_what_it_was():
    rng = np.random.default_rng(4)
    before = begun(rng)
    after = anew(before, np.array([(-20.0, 24.0)]), rng)
    mean, covariance = _kernels.moments(after.particles, after.weights)
    # a thousand particles of it are left
    assert np.abs((mean - before.mean) / np.sqrt(np.diag(before.covariance))).max() < 4 / math.sqrt(1000)
    np.testing.assert_allclose(np.diag(covariance), np.diag(before.covariance), rtol=4 * math.sqrt(2 / 1000))


def test_a_detection_that_leaves_enough_or_is_of_something_else_moves_nothing():
    rng = np.random.default_rng(5)
    near, sharp = begun(rng), np.array([(0.0, 20.0)])
    follows = begun(rng, rng.multivariate_normal(np.zeros(4), np.diag([100.0, 1.0, 2.0, 1.0]), N))
    assert anew(follows, np.array([(5.0, 1.0)]), rng) is None
    assert anew(near, sharp, rng) is not None
    assert anew(near, sharp, rng, log_new=math.log(10.0)) is None  # so dense are false ones
    assert anew(begun(rng, pair=Pair(2, 0)), sharp, rng) is None


def test_a_prediction_that_is_no_gaussian_keeps_its_particles():
    rng = np.random.default_rng(6)
    along = rng.multivariate_normal(np.zeros(4), COVARIANCE, N)
    along[:, 2] = rng.uniform(-200, 200, N)  # as a bearing begins it
    assert anew(begun(rng, along), np.array([(0.0, 20.0)]), rng) is None
