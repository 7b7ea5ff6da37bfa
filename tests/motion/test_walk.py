"""People's steps: the density is that of what is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import Motion
from elusive.motion.walk import Walk

WALKS = [
    Walk(),
    Walk(step_m=0.6, straight_sd_m=0.1, turn_probability=0.2),
    Walk(turn_probability=0.0, straight_sd_m=0.3, long_probability=0.0),
    Walk(long_probability=0.3),
]


@pytest.mark.parametrize("walk", WALKS)
def test_the_density_is_that_of_the_draws(walk):
    assert isinstance(walk, Motion)
    assert walk.state_names == ("x", "vx", "y", "vy")
    rng, n = np.random.default_rng(0), 40_000
    before = np.tile([1.0, 0.8, -2.0, 0.3], (n, 1))
    after = walk.propagate(before, 1.0, rng)
    np.testing.assert_allclose(after[:, [1, 3]], after[:, [0, 2]] - before[:, [0, 2]], atol=1e-12)
    axis = np.arange(-4, 4, 0.04) + 0.02
    x, y = np.meshgrid(1 + axis, -2 + axis)
    cells = np.column_stack([x.ravel(), y.ravel()])
    mass = np.exp(walk.log_density(before[: len(cells)], cells)) * 0.04**2
    assert mass.sum() == pytest.approx(1, abs=1e-3)
    # the share of the draws in the half of the cells that are most likely, by Monte Carlo error
    level = np.quantile(np.log(mass / 0.04**2), 0.9)
    inside = (walk.log_density(before, after[:, [0, 2]]) > level).mean()
    expected = mass[np.log(mass / 0.04**2) > level].sum()
    assert abs(inside - expected) < 4 * np.sqrt(0.25 / n) + 1e-3
    np.testing.assert_allclose(
        after[:, [0, 2]].mean(axis=0), mass @ cells, atol=4 * after[:, [0, 2]].std() / np.sqrt(n)
    )
