"""People's walk: the density is that of what is drawn, and many short intervals are the same walk as a long one."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import Motion
from elusive.motion.walk import Walk
from tests.longer import longer

WALKS = [
    Walk(),
    Walk(speeds_mps=(0.6,), straight_q=0.01, turn_rate_hz=0.2),
    Walk(turn_rate_hz=1e-3, straight_q=0.1, long_rate_hz=1e-9),
    Walk(long_rate_hz=0.3),
]
VELOCITY = np.array([0.8, 0.3])


@pytest.mark.parametrize("walk", WALKS)
@pytest.mark.parametrize("interval_s", [0.7, 1.5])
def test_the_density_is_that_of_the_draws(walk, interval_s):
    assert isinstance(walk, Motion)
    assert walk.state_names == ("x", "vx", "y", "vy")
    rng, n = np.random.default_rng(0), 40_000
    before = np.tile([1.0, VELOCITY[0], -2.0, VELOCITY[1]], (n, 1))
    after = walk.propagate(before, interval_s, rng)
    axis = np.arange(-4, 4, 0.04) + 0.02
    x, y = np.meshgrid(1 + axis, -2 + axis)
    cells = np.column_stack([x.ravel(), y.ravel()])
    mass = np.exp(walk.log_density(before[: len(cells)], cells, interval_s)) * 0.04**2
    assert mass.sum() == pytest.approx(1, abs=0.01)  # of long steps, a few end further off
    # the share of the draws in the half of the cells that are most likely, by Monte Carlo error
    level = np.quantile(np.log(mass / 0.04**2), 0.9)
    inside = (walk.log_density(before, after[:, [0, 2]], interval_s) > level).mean()
    expected = mass[np.log(mass / 0.04**2) > level].sum()
    assert abs(inside - expected) < 4 * np.sqrt(0.25 / n) + 1e-3
    np.testing.assert_allclose(
        after[:, [0, 2]].mean(axis=0), mass @ cells / mass.sum(), atol=4 * after[:, [0, 2]].std() / np.sqrt(n) + 0.01
    )


@pytest.mark.parametrize("walk", longer(WALKS, WALKS[0], *WALKS[2:]))
def test_many_short_intervals_are_the_same_walk_as_a_long_one(walk):
    """Mean and covariance of place and velocity after 1.2 s, by Monte Carlo error: drawn at once, and in 12 steps."""
    n = 60_000
    start = np.tile([0.0, VELOCITY[0], 0.0, VELOCITY[1]], (n, 1))
    once = walk.propagate(start, 1.2, np.random.default_rng(0))
    rng, often = np.random.default_rng(1), start
    for _ in range(12):
        often = walk.propagate(often, 0.1, rng)
    for moments in (lambda states: states, lambda states: states[:, [0, 0, 1]] * states[:, [0, 1, 1]]):
        one, other = moments(once), moments(often)
        error = np.sqrt((one.var(axis=0) + other.var(axis=0)) / n)
        assert (np.abs(one.mean(axis=0) - other.mean(axis=0)) < 4 * error + 1e-3).all()


def test_no_time_is_no_walk():
    states = np.random.default_rng(0).normal(size=(5, 4))
    np.testing.assert_array_equal(Walk().propagate(states, 0.0, np.random.default_rng(0)), states)


def test_each_speed_is_kept_as_often():
    """Long after, a velocity is drawn from any of the deviations: mean square, and what a mixture has of the fourth."""
    walk, n = Walk(speeds_mps=(0.2, 1.0), turn_rate_hz=50, straight_q=0.0, long_rate_hz=1e-9), 200_000
    velocity = walk.propagate(np.zeros((n, 4)), 1.0, np.random.default_rng(0))[:, 1]
    assert walk.speed_sd_mps == pytest.approx(np.sqrt(0.52))
    assert np.mean(velocity**2) == pytest.approx(0.52, rel=0.02)
    assert np.mean(velocity**4) == pytest.approx(3 * (0.2**4 + 1) / 2, rel=0.05)
