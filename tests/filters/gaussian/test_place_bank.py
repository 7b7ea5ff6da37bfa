"""The way of a target from its places: as sure as it is, whatever places err by and however hard the target turns."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.filters.gaussian.place_bank import POWERS, PlaceBank

CELL = 100.0 * np.eye(2)
ANYWHERE = 1 / 320.0**2


def followed(power, scale, rng, *, turns=12, stray=False):
    """Squared errors of place and velocity, in deviations told, of a way drawn with one power."""
    interval_s = 2.5
    state, bank = np.array([900.0, rng.normal(0, 8.0), 1200.0, rng.normal(0, 8.0)]), None
    carry = np.kron(np.eye(2), np.array([[1.0, interval_s], [0.0, 1.0]]))
    noise = np.array([[interval_s**3 / 3, interval_s**2 / 2], [interval_s**2 / 2, interval_s]])
    root = np.sqrt(power) * np.kron(np.eye(2), np.linalg.cholesky(noise))
    for k in range(turns):
        if k:
            state = carry @ state + root @ rng.standard_normal(4)
        place = state[[0, 2]] + 10.0 * scale * rng.standard_normal(2)
        if stray and k % 6 == 5:
            place = state[[0, 2]] + rng.uniform(-160, 160, 2)
        if bank is None:
            bank = PlaceBank.begun(0.0, place, CELL, 8.0)
        else:
            bank, _ = bank.ahead(k * interval_s).seen(place, CELL, ANYWHERE)
    mean, covariance = bank.moments()
    return [
        (mean - state)[which] @ np.linalg.solve(covariance[np.ix_(which, which)], (mean - state)[which])
        for which in ([0, 2], [1, 3])
    ]


@pytest.mark.parametrize(
    ("power", "scale", "stray"), [(1e-4, 0.1, False), (0.01, 0.4, False), (0.3, 0.1, False), (0.1, 0.2, True)]
)
def test_a_way_is_as_sure_as_it_is(power, scale, stray):
    rng = np.random.default_rng(4)
    squares = np.array([followed(power, scale, rng, stray=stray) for _ in range(100)])
    assert (squares.mean(axis=0) < 2 + 4 * np.sqrt(4 / 100)).all()  # chi-square of two degrees, of other powers less
    assert (squares.mean(axis=0) > 0.2).all()


def test_density_of_the_next_place_is_one():
    bank = PlaceBank.begun(0.0, np.zeros(2), CELL, 4.0)
    bank, _ = bank.ahead(2.5).seen(np.array([10.0, -5.0]), CELL, ANYWHERE)
    bank, side = bank.ahead(5.0), np.arange(-160, 160, 4.0) + 2.0
    total = sum(np.exp(bank.seen(np.array([x, y]), CELL, ANYWHERE)[1]) for x in side for y in side) * 16.0
    assert total == pytest.approx(1.0, abs=0.01)  # of few places the square does not hold all


def test_prediction_keeps_probability_and_grows_by_the_mean_power():
    bank = PlaceBank.begun(0.0, np.zeros(2), CELL, 4.0)
    ahead = bank.ahead(3.0)
    np.testing.assert_allclose(ahead.weights.sum(), 1.0)
    np.testing.assert_allclose(ahead.moments()[1][1, 1], 16.0 + 3.0 * POWERS.mean())
    assert bank.ahead(-1.0).time_s == 0.0
