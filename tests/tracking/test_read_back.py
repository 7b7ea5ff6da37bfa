"""Reading back: noise-free cases, and the likelihood of every beginning written out."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.tracking import read_back


def along(frames: int, first: int, level: float, seed: int) -> np.ndarray:
    """White evidence along a path, with a target from ``first`` on."""
    return np.random.default_rng(seed).standard_normal(frames) + level * (np.arange(frames) >= first)


def path(frames: int) -> np.ndarray:
    return np.column_stack([2.0 * np.arange(frames), 70.0 - np.arange(frames)])


def by_likelihood(x: np.ndarray) -> int:
    """Most likely first frame, the level being whatever suits each best, by the Gaussian density itself."""
    likelihood = []
    for first in range(len(x)):
        level = max(x[first:].mean(), 0)
        likelihood.append(-0.5 * np.sum(x[:first] ** 2) - 0.5 * np.sum((x[first:] - level) ** 2))
    return int(np.argmax(likelihood))


@pytest.mark.parametrize("first", [0, 7, 39])
def test_a_loud_target_is_followed_back_to_its_beginning(first):
    found = read_back(along(40, first, 30.0, 0), path(40))
    assert found.first == first
    np.testing.assert_array_equal(found.positions, path(40)[first:])


def test_the_beginning_is_the_most_likely_one():
    begun = []
    for seed in range(60):
        values = along(50, 18, 1.0, seed)
        found = read_back(values, path(50))
        assert found.first == by_likelihood(values)
        begun.append(found.first)
    assert abs(np.median(begun) - 18) <= 1
    assert np.mean(np.abs(np.array(begun) - 18) <= 5) > 0.6


def test_the_level_is_the_mean_along_the_track():
    levels = [read_back(along(50, 10, 2.0, seed), path(50)).level for seed in range(40)]
    assert np.mean(levels) == pytest.approx(2.0, abs=5 / np.sqrt(40 * 40))


def test_a_track_begins_no_earlier_than_it_came_in():
    places = path(30)
    places[:12] = np.nan
    found = read_back(np.ones(30), places)
    assert found.first == 12
    np.testing.assert_array_equal(found.positions, places[12:])
    assert read_back(np.ones(30), path(30)).first == 0


@pytest.mark.parametrize(
    ("values", "positions", "sentence"),
    [
        ([], np.empty((0, 1)), "values: must be finite"),
        ([np.nan, 1.0], path(2), "values: must be finite"),
        ([1.0, 2.0], path(3), "with as many positions"),
        ([[1.0]], path(1), "values: must be finite"),
        ([1.0, 2.0], np.array([[1.0], [np.nan]]), "positions: the last lies outside"),
    ],
)
def test_bad_input_is_refused(values, positions, sentence):
    with pytest.raises(DataError, match=sentence):
        read_back(values, positions)
