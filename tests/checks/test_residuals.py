"""Tests of residuals: the level on right models by simulation, the power on wrong ones, and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from elusive.checks import lag_of, scale_of, share_of
from elusive.checks.residuals import at_least
from tests.longer import longer

TRIALS, LEVEL = 400, 0.05  # a level of 1e-3 would need 1e5 trials


def remarks(test, draw, trials=TRIALS):
    """Share of trials in which a test remarks on what is drawn."""
    rng = np.random.default_rng(0)
    return np.mean([not test(draw(rng)).holds for _ in range(trials)])


def most(level, trials=TRIALS):
    """Share of remarks above which a level does not hold: three deviations of its Monte Carlo error."""
    return level + 3 * np.sqrt(level * (1 - level) / trials)


@pytest.mark.parametrize("degrees", longer([1, 2, 3], 2))
@pytest.mark.parametrize("count", [10, 300])
def test_right_deviations_are_seldom_remarked_on(degrees, count):
    draw = lambda rng: np.linalg.norm(rng.standard_normal((count, degrees)), axis=1)  # noqa: E731
    assert remarks(lambda x: scale_of(x, degrees, tolerance=1.0, level=LEVEL), draw) <= most(LEVEL)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_deviations_of_half_and_double_are_found_and_measured(factor):
    rng = np.random.default_rng(1)
    degrees = rng.integers(1, 4, 400)
    lengths = factor * np.array([np.linalg.norm(rng.standard_normal(d)) for d in degrees])
    found = scale_of(lengths, degrees)
    assert not found.median.holds
    assert not found.tail.holds
    assert found.median.seen == pytest.approx(factor, rel=0.15)
    assert found.worst in found


@pytest.mark.thorough
def test_a_model_on_the_edge_of_what_is_tolerated_is_seldom_remarked_on():
    draw = lambda rng: 1.25 * rng.standard_normal(2000)  # noqa: E731
    assert remarks(lambda x: scale_of(x, tolerance=1.25, level=LEVEL), draw) <= most(LEVEL)


def test_a_heavy_tail_is_found_where_the_median_holds():
    found = scale_of(stats.t(2).rvs(4000, random_state=2) / stats.t(2).ppf(0.75) * stats.norm.ppf(0.75))
    assert found.median.holds
    assert not found.tail.holds


def test_correlated_samples_count_for_fewer():
    many = np.full(20, 3.0)  # each deviation far out, but all the same
    assert not scale_of(many).holds
    assert scale_of(many, independent=0.05).holds
    assert scale_of(np.full(4, np.nan)).holds


def test_shares_follow_the_binomial_law():
    assert at_least(8, 10, 0.5) == pytest.approx(stats.binom.sf(7, 10, 0.5))
    assert at_least(0, 10, 0.5) == 1.0
    share = remarks(lambda hit: share_of(hit, 200, 0.9, tolerance=0, level=LEVEL), lambda rng: rng.binomial(200, 0.9))
    assert share <= most(LEVEL)
    assert not share_of(120, 200, 0.9).holds
    assert share_of(0, 0, 0.9).holds


@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_correlation_in_time_is_that_of_an_autoregression(correlation):
    def draw(rng, count=400):
        series = rng.standard_normal((count, 2))
        for k in range(1, count):
            series[k] = correlation * series[k - 1] + np.sqrt(1 - correlation**2) * series[k]
        return series

    share = remarks(lambda x: lag_of(x, tolerance=0.0, level=LEVEL), draw, 200)
    assert (share <= most(LEVEL, 200)) if correlation == 0 else (share == 1)
    assert lag_of(draw(np.random.default_rng(5), 4000)).seen == pytest.approx(correlation, abs=0.05)
    assert lag_of(draw(np.random.default_rng(5)), expected=correlation).holds
