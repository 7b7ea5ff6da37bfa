"""Reading back: noise-free cases, and the likelihood of every beginning written out."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.tracking import read_back


def scene(frames: int, first: int, level: float, seed: int, shape: tuple[int, ...] = (60, 90)) -> list[np.ndarray]:
    """White evidence, with a target from ``first`` on that ends at x = 20, y = 30 and moves by 2, -1."""
    rng = np.random.default_rng(seed)
    maps = [rng.standard_normal(shape) for _ in range(frames)]
    for k in range(first, frames):
        ago = frames - 1 - k
        maps[k][(30 + ago) % shape[0], (20 - 2 * ago) % shape[1]] += level
    return maps


def by_likelihood(maps: list[np.ndarray]) -> int:
    """Most likely first frame, the level being whatever suits each best, by the Gaussian density itself."""
    values = []
    for ago, given in enumerate(reversed(maps)):
        values.append(given[(30 + ago) % given.shape[0], (20 - 2 * ago) % given.shape[1]] / np.sqrt(np.mean(given**2)))
    x = np.array(values[::-1])
    likelihood = []
    for first in range(len(x)):
        level = max(x[first:].mean(), 0)
        likelihood.append(-0.5 * np.sum(x[:first] ** 2) - 0.5 * np.sum((x[first:] - level) ** 2))
    return int(np.argmax(likelihood))


@pytest.mark.parametrize("first", [0, 7, 39])
def test_a_loud_target_is_followed_back_to_its_beginning(first):
    found = read_back(scene(40, first, 30.0, 0), (20.0, 30.0), (2.0, -1.0))
    assert found.first == first
    ago = np.arange(39 - first, -1, -1)
    np.testing.assert_array_equal(found.positions, np.stack([(20 - 2 * ago) % 90, (30 + ago) % 60], axis=1))


def test_the_beginning_is_the_most_likely_one():
    begun = []
    for seed in range(60):
        maps = scene(50, 18, 1.0, seed)
        found = read_back(maps, (20.0, 30.0), (2.0, -1.0))
        assert found.first == by_likelihood(maps)
        begun.append(found.first)
    assert abs(np.median(begun) - 18) <= 1
    assert np.mean(np.abs(np.array(begun) - 18) <= 5) > 0.6


def test_the_level_is_the_mean_along_the_track():
    levels = [read_back(scene(50, 10, 2.0, seed), (20.0, 30.0), (2.0, -1.0)).level for seed in range(40)]
    assert np.mean(levels) == pytest.approx(2.0, abs=5 / np.sqrt(40 * 40))


def test_a_bounded_map_is_not_left():
    maps = [np.ones(50) for _ in range(30)]
    found = read_back(maps, (10.0,), (2.0,), border="bounded")
    np.testing.assert_array_equal(found.positions[:, 0], [0, 2, 4, 6, 8, 10])
    assert found.first == 24
    assert read_back(maps, (10.0,), (2.0,)).first == 0
    assert read_back(maps, (49.0,), (-3.0,), border="bounded").first == 29
    assert read_back(maps, (10.0,), (0.0,), border="bounded").first == 0


def test_missing_frames_count_for_nothing_but_time():
    maps: list[np.ndarray | None] = list(scene(30, 10, 30.0, 1))
    for missing in (8, 15, 16, 29):
        maps[missing] = None
    found = read_back(maps, (20.0, 30.0), (2.0, -1.0))
    assert found.first == 10
    assert len(found.positions) == 20


@pytest.mark.parametrize(
    ("evidence", "position", "velocity", "error", "sentence"),
    [
        ([], (1.0,), (0.0,), DataError, "evidence: there is none"),
        ([None, None], (1.0,), (0.0,), DataError, "evidence: there is none"),
        ([np.ones((3, 3))], (1.0,), (0.0,), DataError, "maps must have 1 axes"),
        ([np.ones(3)], (1.0,), (0.0, 0.0), ParameterError, "of one length"),
        ([np.ones(3)], (np.nan,), (0.0,), ParameterError, "must be finite"),
        ([np.full(3, np.nan)], (1.0,), (0.0,), DataError, "finite"),
        ([np.zeros(3)], (1.0,), (0.0,), DataError, "all zero"),
        ([np.ones(3), np.ones(4)], (1.0,), (0.0,), DataError, "one shape"),
        ([np.ones(3)], (7.0,), (0.0,), DataError, "outside"),
    ],
)
def test_bad_input_is_refused(evidence, position, velocity, error, sentence):
    with pytest.raises(error, match=sentence):
        read_back(evidence, position, velocity, border="bounded")
