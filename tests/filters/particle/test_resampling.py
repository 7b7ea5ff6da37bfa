"""Resampling: equal indices to the textbook forms, no bias, nothing from nothing."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.filters.particle.resampling import effective_sample_size, resample
from tests.reference import resampling as reference

SCHEMES = ("systematic", "stratified", "residual", "multinomial")


def uneven(n, seed):
    """Weights over many orders of magnitude, some of them zero, summing to something else than one."""
    rng = np.random.default_rng(seed)
    weights = np.exp(rng.normal(scale=3, size=n))
    weights[rng.random(n) < 0.2] = 0.0
    return weights


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("size", "n"), [(6000, 6000), (2000, 1500), (10, 1000), (1000, 1), (1, 7)])
def test_indices_equal_the_textbook_forms(size, n, seed):
    weights = uneven(size, seed) + (1.0 if size == 1 else 0.0)
    draws = np.random.default_rng(seed)
    u0 = draws.random()
    found = resample(weights, n, np.random.default_rng(seed), "systematic")
    np.testing.assert_array_equal(found, reference.systematic(weights, n, u0))
    np.testing.assert_array_equal(found, reference.systematic_by_repeat(weights, n, u0))
    assert found.dtype == np.int64
    points = (np.arange(n) + np.random.default_rng(seed).random(n)) / n
    found = resample(weights, n, np.random.default_rng(seed), "stratified")
    np.testing.assert_array_equal(found, reference.at_points(weights, points))
    points = np.sort(np.random.default_rng(seed).random(n))
    found = resample(weights, n, np.random.default_rng(seed), "multinomial")
    np.testing.assert_array_equal(found, reference.at_points(weights, points))
    left = n - int(np.floor(weights * (n / weights.sum())).sum())
    points = np.sort(np.random.default_rng(seed).random(left))
    found = resample(weights, n, np.random.default_rng(seed), "residual")
    np.testing.assert_array_equal(found, reference.residual(weights, n, points))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_expected_counts_are_proportional_to_the_weights(scheme):
    weights, n, runs = np.array([0.02, 0.5, 0.0, 0.13, 0.35]), 7, 4000
    rng = np.random.default_rng(0)
    counts = np.array([np.bincount(resample(weights, n, rng, scheme), minlength=5) for _ in range(runs)])
    error = counts.std(axis=0) / np.sqrt(runs)
    assert (abs(counts.mean(axis=0) - n * weights) <= 5 * error + 1e-12).all()
    if scheme == "systematic":
        assert (abs(counts - n * weights) < 1).all()
    if scheme == "residual":
        assert (counts >= np.floor(n * weights)).all()


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_particle_of_no_weight_has_no_offspring(scheme):
    rng = np.random.default_rng(1)
    for seed in range(30):
        weights = uneven(200, seed)
        weights[-5:] = 0.0
        weights[:3] = 0.0
        chosen = resample(weights, 500, rng, scheme)
        assert chosen.size == 500
        assert (weights[chosen] > 0).all()
        assert (np.diff(chosen) >= 0).all()


@pytest.mark.parametrize("scheme", SCHEMES)
def test_rounding_of_the_sum_does_not_run_off_the_end(scheme):
    # ten times .1 adds up to less than 1: a comb tooth may lie beyond the last cumulative weight
    class Latest:
        def random(self, n=None):
            top = np.nextafter(1.0, 0.0)
            return top if n is None else np.full(n, top)

    weights = np.full(13, 0.1)
    weights[10:] = 0.0
    chosen = resample(weights, 40, Latest(), scheme)
    assert chosen.max() <= 9
    assert chosen.size == 40


@pytest.mark.parametrize("scheme", SCHEMES)
def test_equal_weights_keep_everybody_where_the_scheme_says_so(scheme):
    chosen = resample(np.ones(64), 64, np.random.default_rng(2), scheme)
    everybody = np.array_equal(chosen, np.arange(64))
    assert everybody == (scheme != "multinomial")
    assert resample(np.ones(3), 0, np.random.default_rng(2), scheme).size == 0


@pytest.mark.parametrize("scheme", ["systematic", "stratified", "residual"])
@pytest.mark.parametrize("scale", [5e-324, 1e-310, 1e300])
def test_weights_near_the_ends_of_the_range_of_numbers_count_alike(scheme, scale):
    chosen = resample(np.array([1.0, 0.0, 3.0, 0.0]) * scale, 8, np.random.default_rng(3), scheme)
    np.testing.assert_array_equal(chosen, [0, 0, 2, 2, 2, 2, 2, 2])


@pytest.mark.parametrize("weights", [[0.0, 0.0], [1.0, -0.1], [1.0, np.nan], [np.inf, 1.0], [], [[1.0]]])
def test_weights_that_are_none_are_refused(weights):
    with pytest.raises(DataError, match="weights: must be one row of finite numbers, none negative and not all zero"):
        resample(np.array(weights), 3, np.random.default_rng(0))


def test_a_wrong_scheme_or_number_is_refused():
    with pytest.raises(ParameterError, match="'systmatic' is unknown; choose one of systematic, stratified"):
        resample(np.ones(3), 3, np.random.default_rng(0), "systmatic")
    with pytest.raises(ParameterError, match=r"must not be negative \(got -1\)"):
        resample(np.ones(3), -1, np.random.default_rng(0))


def test_the_effective_size_lies_between_one_and_all():
    assert effective_sample_size(np.full(50, 0.3)) == pytest.approx(50)
    assert effective_sample_size(np.eye(50)[7]) == 1
    assert effective_sample_size(np.array([0.5, 0.5, 0.0])) == pytest.approx(2)
    for seed in range(20):
        assert 1 <= effective_sample_size(uneven(100, seed)) <= 100
