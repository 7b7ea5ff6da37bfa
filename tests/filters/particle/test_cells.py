"""Survivors spread cell by cell: mean and covariance stay, and what is apart stays apart."""

from __future__ import annotations

import numpy as np

from elusive.filters.particle.cells import spread


def test_two_clouds_stay_two_with_their_moments():
    rng = np.random.default_rng(4)
    n = 4000
    states = rng.normal(0, 0.2, (n, 5)) + np.array([1.0, 0.0, 1.0, 0.0, 8.0])
    states[: n // 4, [0, 2]] += 10.0
    drawn = spread(states, np.full(n, 1 / n), 3.0, rng)
    far = drawn[:, 0] > 6.0
    assert far.mean() == 0.25
    assert not ((drawn[:, 0] > 2.5) & (drawn[:, 0] < 9.5)).any()  # nothing between them
    for part, before in ((drawn[far], states[: n // 4]), (drawn[~far], states[n // 4 :])):
        # standard errors of a mean of 1000 at .2: .0063; of a deviation: .0045
        assert np.abs(part.mean(axis=0) - before.mean(axis=0)).max() < 5 * 0.0063
        assert np.abs(part.std(axis=0) - before.std(axis=0)).max() < 5 * 0.0045
