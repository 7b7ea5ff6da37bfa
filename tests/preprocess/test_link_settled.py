"""A room whose levels have changed for good is learned anew; people who stand in it are not taken for the room."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.fade_level import RssChange
from elusive.preprocess.link_calibration import Calibration
from elusive.preprocess.link_settled import ANOTHER_ROOM, away_from
from elusive.sensors.radio_network import RssFrame, directed_links_of
from tests.longer import longer
from tests.tracking.link_scenes import border

NODES, SD = border(12, 4.0), 0.6
LEVEL = np.random.default_rng(1).normal(-60, 5, (132, 4))
CHANGE = RssChange(occupied_s=None, empty_s=None)
EVERYWHERE = away_from(NODES, np.empty((0, 2)))


def followed(rise_at, away, frames, interval_s=0.5):
    """States of a log whose levels are the empty room's, what ``rise_at`` adds, and noise."""
    rng, state = np.random.default_rng(2), CHANGE.init(Calibration(0.0, LEVEL, np.full(LEVEL.shape, SD**2), ()))
    states = []
    for number in range(1, frames + 1):
        level = LEVEL + rise_at(number) + rng.normal(0, SD, LEVEL.shape)
        state = CHANGE.step(state, RssFrame(number * interval_s, level), away=away)
        states.append(state)
    return states


@pytest.mark.parametrize("interval_s", longer([0.1, 0.5, 2.0], 0.1))
def test_levels_that_step_are_the_rooms_from_then_on(interval_s):
    step = np.where(np.random.default_rng(3).random((132, 1)) < 0.4, 4.0, 0.0)
    at = round(30 / interval_s)
    states = followed(lambda number: step * (number > at), EVERYWHERE, round(100 / interval_s) + at, interval_s)
    shares = np.array([state.settled_share for state in states])
    assert shares[:at].max() < 0.01
    assert shares.max() > ANOTHER_ROOM
    # 2 deviations and the running mean's own error are what can be left
    np.testing.assert_allclose(states[-1].calibration.mean_dbm, LEVEL + step, atol=2 * SD + 4 * SD / 4)
    assert np.abs(states[-1].calibration.mean_dbm - LEVEL - step).mean() < 0.5 * SD


def test_who_walks_is_not_the_room():
    ends = NODES.positions_m[directed_links_of(12)]
    straight = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)

    def walking(number):
        place = np.array([3 * np.sin(0.05 * number), 2 * np.cos(0.08 * number)])
        return -6 * np.exp(-(np.linalg.norm(ends - place, axis=2).sum(axis=1) - straight) / 0.2)[:, None]

    states = followed(walking, EVERYWHERE, 300)
    assert max(state.settled_share for state in states) < ANOTHER_ROOM / 3
    np.testing.assert_array_equal(states[-1].calibration.mean_dbm, LEVEL)


def test_what_a_person_who_is_known_holds_off_is_not_counted():
    """Somebody who stands quite still for a minute."""
    place = np.array([[0.5, 0.3]])
    away = away_from(NODES, place)
    assert 0.2 < away.mean() < 0.8
    held = np.where(away, 0.0, -4.0)[:, None]
    states = followed(lambda number: held, away, 120)
    assert max(state.settled_share for state in states) < 0.01
    np.testing.assert_array_equal(states[-1].calibration.mean_dbm, LEVEL)
    counted = followed(lambda number: held, EVERYWHERE, 120)
    assert max(state.settled_share for state in counted) > ANOTHER_ROOM
