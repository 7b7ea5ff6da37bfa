"""Leftovers that cluster: the level on independent places, the power on clusters."""

from __future__ import annotations

import numpy as np

from elusive.checks import dispersion_of, nearest_of

TRIALS, LEVEL = 400, 0.05
MOST = LEVEL + 3 * np.sqrt(LEVEL * (1 - LEVEL) / TRIALS)


def test_independent_places_are_seldom_clustered():
    rng = np.random.default_rng(0)
    found = [nearest_of(rng.uniform(0, 10, (60, 2)), 100.0, tolerance=0, level=LEVEL).holds for _ in range(TRIALS)]
    assert np.mean(np.logical_not(found)) <= MOST


def test_places_round_a_few_centres_are_clustered():
    rng = np.random.default_rng(1)
    found = nearest_of(rng.uniform(0, 10, (6, 1, 2)).repeat(10, 0).reshape(-1, 2) + rng.normal(0, 0.1, (60, 2)), 100.0)
    assert not found.holds
    assert found.seen < 0.5
    assert nearest_of(rng.uniform(0, 10, (3, 2)), 100.0).holds  # too few to say


def test_poisson_counts_are_seldom_remarked_on():
    rng = np.random.default_rng(2)
    expected = rng.uniform(0.5, 4, 80)
    found = [dispersion_of(rng.poisson(expected), expected, tolerance=0, level=LEVEL).holds for _ in range(TRIALS)]
    assert np.mean(np.logical_not(found)) <= MOST


def test_counts_that_gather_in_cells_are_found():
    rng = np.random.default_rng(3)
    found = dispersion_of(rng.negative_binomial(1, 1 / 5, 100), np.full(100, 4.0))  # variance 20 of a mean of 4
    assert not found.holds
    assert found.seen > 2
    assert dispersion_of(np.array([5]), np.array([1.0])).holds
