"""What is fast begins with three peaks, as likely as the sums over all threes say, and what three peaks tell of it."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy import stats

from elusive.tracking.peak_swift import Unclaimed, Ways, swift
from tests.tracking.test_peaks import recorded, resting

WAYS = Ways(8.0, 40.0, 0.3, 1e-2, 0.9, 0.35, 4.0)


def unclaimed(rng: np.random.Generator, count: int) -> Unclaimed:
    return Unclaimed(
        rng.uniform(0, 40, (count, 2)), rng.uniform(1, 5, count), rng.normal(0, 0.3, count),
        rng.random(count) < 0.5, rng.normal(-6, 1, count), *np.ones((4, count)),
    )  # fmt: skip


def alike(change: float) -> float:
    """Density of a level's change, Student's of three degrees of freedom over its deviation, to a percent."""
    return float(stats.t(3).pdf(change / WAYS.level_spread) / WAYS.level_spread)


def odds(first: Unclaimed, second: Unclaimed, third: Unclaimed, i: int, j: int, k: int) -> float:
    way = second.place[j] - first.place[i]
    length, off = np.hypot(*way), third.place[k] - second.place[j] - way
    if not WAYS.least_px < length < WAYS.most_px or len({first.bright[i], second.bright[j], third.bright[k]}) > 1:
        return 0.0
    spread = first.variance[i] + 4 * second.variance[j] + third.variance[k] + 2 / 3 * WAYS.q + (0.05 * length) ** 2
    clutter = [WAYS.tail * np.exp(one.log_density[a]) for one, a in ((second, j), (third, k))]
    once = WAYS.detected * alike(second.level[j] - first.level[i]) / (np.pi * WAYS.most_px**2) / clutter[0]
    again = WAYS.detected * alike(third.level[k] - second.level[j]) / clutter[1]
    again *= np.prod(stats.norm(0, np.sqrt(spread)).pdf(off))
    return float(WAYS.appear / np.exp(first.log_density[i]) * once * again)


@pytest.mark.parametrize("seed", range(3))
def test_three_peaks_are_as_likely_one_target_as_their_densities_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frames = [unclaimed(rng, count) for count in (6, 7, 8)]
    every = {one: odds(*frames, *one) for one in product(range(6), range(7), range(8))}
    found, taken = swift(WAYS, *frames), [set[int](), set[int](), set[int]()]
    expected = []
    for one in sorted(every, key=every.__getitem__, reverse=True):
        if every[one] > np.exp(-12.0) and not any(a in used for a, used in zip(one, taken, strict=True)):
            expected.append(one)
            for a, used in zip(one, taken, strict=True):
                used.add(a)
    assert expected
    assert found.third.tolist() == [one[2] for one in expected]
    np.testing.assert_allclose(np.exp(found.log_odds), [every[one] for one in expected], rtol=0.03)
    places = [[frame.place[a] for frame, a in zip(frames, one, strict=True)] for one in expected]
    np.testing.assert_array_equal(found.place, places)


def test_nothing_begins_where_nothing_is() -> None:
    rng = np.random.default_rng(0)
    frames = [unclaimed(rng, count) for count in (5, 5, 5)]
    for k in range(3):
        some = [one.rarest(0) if a == k else one for a, one in enumerate(frames)]
        assert not len(swift(WAYS, *some).third)


def sure(path: np.ndarray, seed: int) -> list[tuple[float, float]]:
    """Velocities of what is surely there after a path, among twenty points at rest and noise, and faster than 5 px."""
    rng = np.random.default_rng(seed)
    last = recorded(rng, np.concatenate([np.full((12, 2), np.nan), path]), resting(rng)[:20])[-1]
    velocity = [track.mean[[1, 3]] for track in last.tracks if track.existence > 0.9]
    return [(float(x), float(y)) for x, y in velocity if np.hypot(x, y) > 5]


@pytest.mark.thorough
def test_what_crosses_the_frame_in_seven_frames_is_followed_from_the_fourth() -> None:
    path, found = np.array([8.0, 30.0]) + np.outer(np.arange(7), [20.0, 6.0]), np.zeros(3, int)
    for seed in range(20):
        for k, frames in enumerate((3, 5, 7)):
            found[k] += any(np.hypot(x - 20, y - 6) < 1.5 for x, y in sure(path[:frames], seed))
    assert found[0] == 0  # three peaks are no proof
    assert found[1] >= 16  # all twenty without chance; before, none
    assert found[2] >= 18


def test_in_noise_nothing_is_fast() -> None:
    for seed in range(20):
        assert not sure(np.full((8, 2), np.nan), seed)
