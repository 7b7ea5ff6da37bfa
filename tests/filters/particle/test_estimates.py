"""What is read from weighted particles, against densities that are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import gaussian_kde, multivariate_normal

from elusive.errors import DataError, ParameterError
from elusive.filters.particle.estimates import (
    credible_ellipse,
    credible_region,
    marginal_map,
    mean_and_covariance,
)
from tests.longer import longer
from tests.reference.filters import moments

MEAN = np.array([3.0, 0.5, -2.0, 0.1])
COVARIANCE = np.array([[2.0, 0.1, 1.2, 0.0], [0.1, 0.3, 0.0, 0.0], [1.2, 0.0, 1.5, 0.1], [0.0, 0.0, 0.1, 0.2]])


def sample(n, seed=0):
    """Particles from twice the covariance, weighted back to the Gaussian."""
    rng = np.random.default_rng(seed)
    particles = rng.multivariate_normal(MEAN, 2 * COVARIANCE, n)
    target, drawn = multivariate_normal(MEAN, COVARIANCE), multivariate_normal(MEAN, 2 * COVARIANCE)
    return particles, np.exp(target.logpdf(particles) - drawn.logpdf(particles))


def test_moments_equal_their_twin_and_need_no_normalised_weights():
    particles, weights = sample(500)
    for found in (mean_and_covariance(particles, weights), mean_and_covariance(particles, 7 * weights)):
        for ours, twin in zip(found, moments(particles, weights / weights.sum()), strict=True):
            np.testing.assert_allclose(ours, twin, rtol=1e-12, atol=1e-12)


def test_the_mode_of_each_component_is_that_of_scipys_kernel_density():
    rng = np.random.default_rng(1)
    skewed = np.column_stack([rng.gamma(2.0, size=800), rng.normal(size=800), np.exp(rng.normal(size=800))])
    weights = rng.random(800)
    found = marginal_map(skewed, weights)
    for k, column in enumerate(skewed.T):
        peer = gaussian_kde(column, "silverman", weights=weights / weights.sum())
        # scipy's covariance is the unbiased one; ours divides by the sum of weights
        shares = weights / weights.sum()
        peer.set_bandwidth(peer.factor * np.sqrt(1 - (shares**2).sum()))
        grid = np.linspace(column.min(), column.max(), 20_001)
        assert found[k] == pytest.approx(grid[np.argmax(peer(grid))], abs=2 * (grid[1] - grid[0]))


def test_the_mode_is_the_heavier_of_two_clumps_where_the_mean_is_none():
    rng = np.random.default_rng(2)
    values = np.concatenate([rng.normal(-5, 0.3, 600), rng.normal(5, 0.3, 400)])
    particles = np.column_stack([values, np.zeros(1000), -values, np.zeros(1000)])
    weights = np.ones(1000)
    assert marginal_map(particles, weights)[[0, 2]] == pytest.approx([-5, 5], abs=0.2)
    weights[600:] = 4.0
    assert marginal_map(particles, weights)[[0, 2]] == pytest.approx([5, -5], abs=0.2)
    assert abs(mean_and_covariance(particles, np.ones(1000))[0][0]) < 1.5


def test_particles_all_alike_have_a_mode():
    alike = np.tile([1.0, 2.0, 3.0, 4.0], (20, 1))
    np.testing.assert_allclose(marginal_map(alike, np.ones(20)), alike[0])


@pytest.mark.parametrize("level", [0.5, 0.9, 0.99])
def test_the_ellipse_holds_its_share_of_a_gaussian(level):
    ellipse = credible_ellipse(MEAN, COVARIANCE, level)
    n = 100_000
    points = np.random.default_rng(3).multivariate_normal(MEAN, COVARIANCE, n)[:, [0, 2]] - ellipse.centre
    cos, sin = np.cos(ellipse.angle_rad), np.sin(ellipse.angle_rad)
    along, across = points @ [cos, sin], points @ [-sin, cos]
    inside = (along / ellipse.semi_axes[0]) ** 2 + (across / ellipse.semi_axes[1]) ** 2 <= 1
    assert abs(inside.mean() - level) < 5 * np.sqrt(level * (1 - level) / n)
    assert ellipse.semi_axes[0] >= ellipse.semi_axes[1]
    # the axes are those of the Gaussian: the two coordinates along them are uncorrelated
    assert abs(np.corrcoef(along, across)[0, 1]) < 5 / np.sqrt(n)


@pytest.mark.parametrize("angle", [-1.2, -0.4, 0.0, 0.7, np.pi / 2])
def test_the_ellipse_lies_at_its_angle(angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    ellipse = credible_ellipse([1.0, 2.0], turn @ np.diag([9.0, 4.0]) @ turn.T, 1 - np.exp(-0.5), (0, 1))
    np.testing.assert_allclose(ellipse.semi_axes, [3.0, 2.0], rtol=1e-12)
    np.testing.assert_array_equal(ellipse.centre, [1.0, 2.0])
    assert np.sin(ellipse.angle_rad - angle) == pytest.approx(0, abs=1e-7)
    assert -np.pi / 2 < ellipse.angle_rad <= np.pi / 2


@pytest.mark.parametrize("level", longer([0.5, 0.9], 0.5))
def test_the_region_of_a_gaussian_is_its_ellipse(level):
    particles, weights = sample(2500)
    region = credible_region(particles, weights, level)
    fresh = np.random.default_rng(4).multivariate_normal(MEAN, COVARIANCE, 20_000)[:, [0, 2]]
    # the smoothing widens the density by (1 + h^2), h = .27: a few hundredths
    assert region.contains(fresh).mean() == pytest.approx(level, abs=0.04)
    exact = np.pi * np.prod(credible_ellipse(MEAN, COVARIANCE, level).semi_axes)
    assert region.area(60) == pytest.approx(exact, rel=0.15)
    inside = region.contains(particles[:, [0, 2]])
    assert weights[inside].sum() / weights.sum() == pytest.approx(level, abs=0.005)
    assert region.contains(MEAN[None, [0, 2]]).all()
    assert not region.contains(np.array([[1e3, 0.0]])).any()


def test_the_region_of_two_clumps_has_two_pieces():
    rng = np.random.default_rng(5)
    side = np.where(np.arange(2000) % 2, 6.0, -6.0)
    particles = rng.normal(size=(2000, 4))
    particles[:, 0] += side
    region = credible_region(particles, np.ones(2000), 0.8)
    assert region.contains(np.array([[-6.0, 0.0], [6.0, 0.0], [0.0, 0.0]])).tolist() == [True, True, False]
    mean, covariance = mean_and_covariance(particles, np.ones(2000))
    assert region.area() < 0.8 * np.pi * np.prod(credible_ellipse(mean, covariance, 0.8).semi_axes)


def test_the_region_of_one_component_is_an_interval():
    rng = np.random.default_rng(6)
    region = credible_region(rng.normal(size=(5000, 1)), np.ones(5000), 0.6827, (0,))
    assert region.area(2000) == pytest.approx(2.0, rel=0.06)


def test_the_density_integrates_to_one():
    particles, weights = sample(300)
    region = credible_region(particles, weights, 0.5)
    axis = np.linspace(-12, 12, 200)
    grid = np.stack(np.meshgrid(axis + 3, axis - 2), axis=-1).reshape(-1, 2)
    assert region.density(grid).sum() * (axis[1] - axis[0]) ** 2 == pytest.approx(1, abs=1e-6)


GOOD = np.zeros((3, 4))


@pytest.mark.parametrize("estimate", [mean_and_covariance, marginal_map])
@pytest.mark.parametrize(
    ("particles", "weights", "words"),
    [
        (np.zeros(3), np.ones(3), r"particles: have shape \(3,\)"),
        (GOOD, np.ones(2), r"beside weights of shape \(2,\); give \(N, d\) and \(N,\)"),
        (GOOD * np.nan, np.ones(3), "particles: hold NaN"),
        (GOOD, np.zeros(3), "not all zero"),
        (GOOD, np.array([1.0, -1.0, 1.0]), "none negative"),
        (GOOD, np.array([1.0, np.nan, 1.0]), "must be finite"),
        (np.zeros((0, 4)), np.zeros(0), "not all zero"),
    ],
)
def test_what_is_no_belief_is_refused(estimate, particles, weights, words):
    with pytest.raises(DataError, match=words):
        estimate(particles, weights)


def test_a_wrong_level_component_or_covariance_is_refused():
    with pytest.raises(ParameterError, match=r"level: must lie between 0 and 1 \(got 95\)"):
        credible_ellipse(MEAN, COVARIANCE, 95)
    with pytest.raises(ParameterError, match="level"):
        credible_region(GOOD, np.ones(3), 0.0)
    with pytest.raises(ParameterError, match=r"\(0, 4\) name no columns of states with 4 components"):
        credible_region(GOOD, np.ones(3), 0.5, (0, 4))
    with pytest.raises(ParameterError, match="an ellipse has two, not 3"):
        credible_ellipse(MEAN, COVARIANCE, 0.5, (0, 1, 2))
    with pytest.raises(DataError, match=r"covariance: has shape \(2, 2\) beside a mean of shape \(4,\)"):
        credible_ellipse(MEAN, np.eye(2), 0.5)
    with pytest.raises(DataError, match="no negative eigenvalue"):
        credible_ellipse(MEAN, np.diag([1.0, 1.0, -1.0, 1.0]), 0.5)
    with pytest.raises(DataError, match="must be finite"):
        credible_ellipse(MEAN, COVARIANCE * np.nan, 0.5)
