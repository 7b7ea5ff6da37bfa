"""Survivors moved on and smoothed: random numbers, the twin, moments that stay, clouds that stay apart."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import stats

from elusive._random_kernels import fill_normal, fill_uniform
from elusive.filters.particle._kernels import systematic
from elusive.filters.particle._prediction_kernels import by_cell, predict
from elusive.motion import ConstantVelocity, CoordinatedTurn, WithIntensity
from tests.reference.filters import predicted
from tests.reference.random_numbers import normals, uniforms


def drawn(fill, draw, n):
    out = np.empty(n)
    fill(draw, out)
    return out


@pytest.mark.parametrize("n", [1, 2, 7, 511, 512, 513, 2048, 5001])
def test_random_numbers_equal_their_twins(n):
    for draw in (0.0, 0.3, np.nextafter(1.0, 0.0)):
        np.testing.assert_array_equal(drawn(fill_uniform, draw, n), uniforms(draw, n))
        # next to a circle's crossing of an axis what is left of the radius counts
        np.testing.assert_allclose(drawn(fill_normal, draw, n), normals(draw, n), rtol=1e-10, atol=1e-11)


def test_random_numbers_are_of_their_laws():
    n = 200_000
    rng = np.random.default_rng(0)
    normal, uniform = drawn(fill_normal, rng.random(), n), drawn(fill_uniform, rng.random(), n)
    assert stats.kstest(normal, "norm").pvalue > 1e-3
    assert stats.kstest(uniform, "uniform").pvalue > 1e-3
    for row in (normal, uniform):
        centred = (row - row.mean()) / row.std()
        for lag in (1, 2, 256, n // 2):
            assert abs(centred[:-lag] @ centred[lag:]) < 4 * np.sqrt(n - lag)
    # streams of neighbouring keys, and of one key and the next step's
    other = drawn(fill_normal, rng.random(), n)
    assert abs(normal @ other) < 4 * np.sqrt(n)
    assert abs((normal**4).mean() - 3) < 4 * np.sqrt(96 / n)


def cloud(rng, n, middle, spread=0.4):
    return np.asarray(middle) + rng.normal(scale=spread, size=(n, 5)) @ rng.normal(size=(5, 5))


@pytest.mark.parametrize("motion", [ConstantVelocity(), CoordinatedTurn()], ids=lambda motion: motion.kind)
@pytest.mark.parametrize("side", [2.1, 0.0, 1e9])
def test_a_prediction_equals_its_twin(motion, side):
    motion, rng = WithIntensity(motion=motion), np.random.default_rng(1)
    states = np.concatenate([cloud(rng, 400, [5, 0.3, 5, -0.2, 20]), cloud(rng, 200, [30, 0.1, -8, 0.4, 25])])
    weights = rng.random(600) ** 6
    weights[rng.random(600) < 0.2] = 0.0
    F, root = motion.transition_root(1.0)
    draws = np.array([0.37, 0.81])
    found, share, starts = by_cell(states, weights, side) if side else (states, weights, np.array([0, 600]))
    chosen = systematic(share, share.sum(), 900, draws[0])
    moved = predict(found, share, starts, chosen, side > 0, F, root, draws[1], 950)
    assert moved.shape == (950, 5)
    expected = predicted(states, weights, 900, side, F, root, draws)
    np.testing.assert_allclose(moved[:900], expected, rtol=1e-9, atol=1e-9)


def test_cells_hold_all_with_weight_and_no_more():
    rng = np.random.default_rng(2)
    states, weights = rng.normal(scale=9, size=(500, 4)), rng.random(500)
    weights[::3] = 0.0
    found, share, starts = by_cell(states, weights, 3.0)
    assert starts[0] == 0
    assert starts[-1] == len(found) == (weights > 0).sum()
    assert sorted(share) == sorted(weights[weights > 0])
    corners = np.floor(found[:, [0, 2]] / 3.0)
    for first, last in pairwise(starts):
        assert last > first
        assert (corners[first:last] == corners[first]).all()
    assert len(np.unique(corners, axis=0)) == len(starts) - 1
    # far apart in small cells: memory stays bounded, and all particles are kept
    states[0, 0], weights[0] = 1e12, 1.0
    assert by_cell(states, weights, 1e-6)[2][-1] == (weights > 0).sum()
    states[1, 2] = np.nan
    np.testing.assert_array_equal(by_cell(states, weights, 3.0)[2], [0, (weights > 0).sum()])


def test_few_distinct_survivors_keep_mean_and_covariance():
    """Oracle: what a Kalman filter's prediction would make of the population that the particles are a sample of."""
    rng, motion = np.random.default_rng(3), WithIntensity()
    F, root = motion.transition_root(1.0)
    truth = np.diag([0.04, 0.01, 0.04, 0.01, 4.0])
    means, covariances = [], []
    for _ in range(300):
        states = [10.0, 0.4, 10.0, 0.2, 20.0] + rng.normal(size=(40, 5)) @ np.sqrt(truth)
        weights = np.full(40, 1 / 40)
        found, share, starts = by_cell(states, weights, 50.0)
        moved = predict(found, share, starts, systematic(share, 1.0, 1500, 0.5), True, F, root, rng.random(), 1500)
        assert len(np.unique(moved[:, 0])) == 1500
        means.append(moved.mean(axis=0) - F @ states.mean(axis=0))
        covariances.append(np.cov(moved.T))
    expected = F @ truth @ F.T + root @ root.T
    scale = np.sqrt(np.diag(expected))
    assert (abs(np.mean(means, axis=0)) < 5 * scale / np.sqrt(1500 * 300)).all()
    spread = np.std(covariances, axis=0) / np.sqrt(300)
    np.testing.assert_array_less(abs(np.mean(covariances, axis=0) - expected), 5 * spread + 1e-12)


def test_clouds_in_different_cells_do_not_mix():
    rng = np.random.default_rng(4)
    near, far = cloud(rng, 300, [4, 0, 4, 0, 10], 0.1), cloud(rng, 300, [40, 0, 40, 0, 10], 0.1)
    states, weights = np.concatenate([near, far]), np.full(600, 1 / 600)
    found, share, starts = by_cell(states, weights, 3.0)
    motion = WithIntensity()
    chosen = systematic(share, 1.0, 1500, 0.5)
    moved = predict(found, share, starts, chosen, True, *motion.transition_root(1.0), 0.3, 1500)
    to_near = np.hypot(moved[:, 0] - 4, moved[:, 2] - 4)
    assert abs((to_near < 6).mean() - 0.5) < 0.01
    assert ((to_near < 6) | (to_near > 45)).all()
