"""Systematic resampling of 6000 particles against the numpy.repeat form, at equal indices."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.filters.particle.resampling import resample
from tests.reference.resampling import systematic_by_repeat


@pytest.mark.parametrize("spread", [0.5, 3.0], ids=["even", "uneven"])
def test_systematic_against_repeat(benchmark, best_of, report, spread):
    n = 6000
    weights = np.exp(np.random.default_rng(0).normal(scale=spread, size=n))
    weights /= weights.sum()
    for seed in range(100):
        u0 = np.random.default_rng(seed).random()
        found = resample(weights, n, np.random.default_rng(seed))
        np.testing.assert_array_equal(found, systematic_by_repeat(weights, n, u0))
    rng = np.random.default_rng(1)
    mine, theirs = best_of(lambda: resample(weights, n, rng), lambda: systematic_by_repeat(weights, n, rng.random()))
    report(
        f"systematic resampling, 6000 {'even' if spread < 1 else 'uneven'} weights, against numpy.repeat",
        theirs / mine,
        3,
    )
    benchmark(resample, weights, n, rng)
