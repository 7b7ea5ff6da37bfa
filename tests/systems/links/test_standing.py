"""A track that stays where it is for half a minute is told from one that walks."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from elusive.systems.links.standing import AGAIN_S, Stays
from tests.tracking.test_walking_speeds import walked

SD_M = 0.4


def judged(places, interval_s):
    """What is found of a track whose places are told, with errors that last a second."""
    rng, stays, error = np.random.default_rng(1), Stays(), np.zeros(2)
    left = np.exp(-interval_s)
    for number, place in enumerate(places):
        error = left * error + np.sqrt(1 - left**2) * rng.normal(0, 0.3 * SD_M, 2)
        mean = np.array([place[0] + error[0], 0.0, place[1] + error[1], 0.0])
        track = SimpleNamespace(track=1, status="confirmed", mean=mean, covariance=np.eye(4) * SD_M**2)
        stays.add(SimpleNamespace(time_s=interval_s * number, tracks=[track]))
    return stays


@pytest.mark.parametrize("interval_s", [0.1, 2.0])
def test_who_walks_and_then_stands_is_found_where_they_stand(interval_s):
    walk = walked(np.random.default_rng(0), 0.5, interval_s, round(40 / interval_s))
    assert judged(walk, interval_s).first is None
    stays = judged([*walk, *[walk[-1]] * round(40 / interval_s)], interval_s)
    assert stays.first.time_s == pytest.approx(40 + 30, abs=8)
    assert np.linalg.norm(stays.first.place - walk[-1]) < SD_M
    assert stays.least.spread == pytest.approx(0.3, abs=0.15)


def test_half_a_minute_is_not_told_from_less_or_by_few_frames():
    assert judged([np.zeros(2)] * 29, 1.0).least is None
    assert judged([np.zeros(2)] * 20, 10.0).least is None


@pytest.mark.parametrize(
    ("silent_s", "off_m", "one"), [(0, 0.0, True), (AGAIN_S - 2, 1.0, True), (AGAIN_S + 2, 0.0, False), (0, 5.0, False)]
)
def test_a_track_that_is_found_again_where_it_was_lost_is_one_stay(silent_s, off_m, one):
    """A fan leaves such ones, which nobody was told of."""
    stays = Stays()
    for second in range(45):
        later = second >= 20
        mean = np.array([off_m * later, 0.0, 0.0, 0.0])
        track = SimpleNamespace(track=1 + later, status="confirmed", mean=mean, covariance=np.eye(4))
        seen = not 20 <= second < 20 + silent_s
        stays.add(SimpleNamespace(time_s=float(second), tracks=[track] if seen else []))
    assert (stays.least is not None) == one


@pytest.mark.parametrize("unmoved", [(), (1,)])
def test_what_has_never_moved_stays_though_its_place_wanders(unmoved):
    """A fan that turns moves its track by more than its deviation."""
    rng, stays = np.random.default_rng(1), Stays()
    for second in range(40):
        mean = np.array([rng.normal(0, 2 * SD_M), 0.0, rng.normal(0, 2 * SD_M), 0.0])
        track = SimpleNamespace(track=1, status="confirmed", mean=mean, covariance=np.eye(4) * SD_M**2)
        stays.add(SimpleNamespace(time_s=float(second), tracks=[track]), unmoved)
    assert (stays.first is not None) == bool(unmoved)
