"""Two tracks that go together are told from two people who meet."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from elusive.systems.links.beside import BESIDE, LEAST_S, Pairs
from elusive.systems.links.checks import LinkFacts
from tests.tracking.link_scenes import border
from tests.tracking.test_walking_speeds import walked

SD_M = 0.3


def seen(places, interval_s=0.5, numbers=(1, 2)):
    """What is found of tracks at the places ``(T, P, 2)``."""
    pairs = Pairs()
    for number, there in enumerate(places):
        tracks = [
            SimpleNamespace(track=name, status="confirmed", mean=np.array([x, 0, y, 0]), covariance=np.eye(4) * SD_M**2)
            for name, (x, y) in zip(numbers, there, strict=False)
        ]
        pairs.add(SimpleNamespace(time_s=interval_s * number, tracks=tracks))
    return pairs


def test_two_who_walk_are_told_apart_and_one_who_is_two_is_not():
    rng = np.random.default_rng(2)
    one, two = (np.array(walked(np.random.default_rng(seed), 0.7, 0.5, 200)) for seed in (0, 1))
    assert seen(np.stack([one, two], axis=1)).closest is None or seen(np.stack([one, two], axis=1)).closest.share < 0.4
    twice = np.stack([one, one + rng.normal(0, SD_M, one.shape)], axis=1)
    assert seen(twice).closest.share > BESIDE
    facts = LinkFacts(border(8, 3.0))
    facts._pairs_there = seen(twice)
    assert not facts._beside().holds
    assert "counted twice" in facts._beside().sentence


def test_they_are_judged_after_seconds_and_remembered_when_they_are_gone():
    together = np.zeros((100, 2, 2))
    assert seen(together[: round(LEAST_S / 0.1) - 1], 0.1).closest is None
    left = [*together, *np.zeros((50, 1, 2))]
    assert seen(left, 0.1).closest.share == pytest.approx(1.0)
    assert seen(left, 0.1).closest.frames == 100
