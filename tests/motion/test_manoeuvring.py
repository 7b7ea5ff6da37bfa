"""Tukey's contaminated normal as a target's acceleration: its moments, and what a particle filter makes of a turn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.filters.particle.parts import step_matrices
from elusive.motion import ConstantVelocity, ManoeuvringVelocity
from elusive.motion.linear import LinearModel

N = 200_000


@pytest.mark.parametrize(("share", "times"), [(0.1, 30.0), (0.3, 4.0), (0.0, 30.0)])
def test_the_noise_has_its_power_and_its_tails(share, times):
    motion = ManoeuvringVelocity(q=2.0, share=share, times=times)
    moved = motion.propagate(np.tile([3.0, 1.0, -2.0, 0.5], (N, 1)), 1.5, np.random.default_rng(1))
    # of a mixture of two powers of mean one: E p^2 of E p = 1
    calm = 1 / (1 - share + share * times)
    squares = (1 - share) * calm**2 + share * (calm * times) ** 2
    Q = ConstantVelocity(q=2.0).Q(1.5)
    np.testing.assert_array_equal(motion.Q(1.5), Q)
    off = moved - ConstantVelocity(q=2.0).F(1.5) @ [3.0, 1.0, -2.0, 0.5]
    deviation = np.sqrt(np.diag(Q))
    assert np.abs(off.mean(axis=0) / deviation).max() < 4 / math.sqrt(N)
    # each product has a variance of at most 3 E p^2
    scaled = off.T @ off / N / np.outer(deviation, deviation)
    np.testing.assert_allclose(scaled, Q / np.outer(deviation, deviation), atol=4 * math.sqrt(3 * squares / N), rtol=0)
    kurtosis = (off**4).mean(axis=0) / np.diag(Q) ** 2
    eighth = 105 * ((1 - share) * calm**4 + share * (calm * times) ** 4)
    np.testing.assert_allclose(kurtosis, 3 * squares, atol=4 * math.sqrt(eighth / N))


def test_over_no_time_nothing_moves():
    states = np.arange(8.0).reshape(2, 4)
    np.testing.assert_array_equal(ManoeuvringVelocity(q=1.0).propagate(states, 0.0, np.random.default_rng(0)), states)


def test_it_draws_by_itself():
    """Compiled steps of linear motions would leave the manoeuvres out."""
    assert ManoeuvringVelocity.propagate is not LinearModel.propagate
    assert step_matrices(ManoeuvringVelocity(q=1.0), 1.0) is None
