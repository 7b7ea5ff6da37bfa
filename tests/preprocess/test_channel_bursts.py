"""Channels that others disturb are told from people, who change both directions of a link alike."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.channel_bursts import FEWEST_LINKS, disturbed
from elusive.preprocess.fade_level import RssChange
from elusive.preprocess.link_calibration import Calibrate
from elusive.sensors.radio_network import RssFrame, directed_links_of, directions_of
from tests.ray_room import EMPTY, ray_room

NODES = 12
LOUD, CHANNEL = (35, 36, 50), 2


def test_the_rows_of_both_directions_are_those_of_one_link():
    one, other = directions_of(NODES).T
    ends = directed_links_of(NODES)
    np.testing.assert_array_equal(ends[one], ends[other][:, ::-1])
    assert sorted([*one, *other]) == list(range(len(ends)))


@pytest.mark.parametrize("seed", range(3))
def test_a_burst_on_a_channel_is_left_out_and_nothing_else(seed):
    """While two walk."""
    room, rng, change = ray_room(seed, (0.7, 0.5), frames=60), np.random.default_rng(seed), RssChange()
    state = change.init(Calibrate().over(room.frames[:EMPTY]))
    for number, frame in enumerate(room.frames[EMPTY:], EMPTY):
        level = frame.rss_dbm.copy()
        if number in LOUD:
            level[:, CHANNEL] += rng.normal(0, 8, len(level))
        state = change.step(state, RssFrame(frame.time_s, level))
        assert state.bursts.tolist() == [number in LOUD and channel == CHANNEL for channel in range(4)]
        assert np.isnan(state.rise_db[:, CHANNEL]).all() == (number in LOUD)
        assert frame.rss_dbm.shape == state.rise_db.shape


def test_of_few_links_nothing_is_known():
    rise = np.full((NODES * (NODES - 1), 1), np.nan)
    rows = directions_of(NODES)[:FEWEST_LINKS]
    rise[rows[:, 0]], rise[rows[:, 1]] = 9.0, -9.0
    assert disturbed(rise, np.ones_like(rise), NODES).all()
    rise[rows[0]] = np.nan
    assert not disturbed(rise, np.ones_like(rise), NODES).any()
