"""Radios whose own gain changes are told from people, who change both directions of a link alike."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.fade_level import RssChange
from elusive.preprocess.link_calibration import Calibrate
from elusive.preprocess.node_gains import FEWEST_LINKS, node_gains, of_readings
from elusive.sensors.radio_network import RssFrame, directed_links_of
from elusive.systems.links.checks import LinkFacts
from elusive.systems.links.track import LinkTracking, track
from tests.longer import longer
from tests.ray_room import EMPTY, ray_room

NODES, CHANGED = 12, 3
ENDS = directed_links_of(NODES)
QUIET = np.full((len(ENDS), 4), 0.6)


def spoilt(room, side, gain_db, first):
    """The room's frames with a node's gain changed, as it sends (0) or hears (1)."""
    at = ENDS[:, side] == CHANGED
    return [
        RssFrame(frame.time_s, np.where(at[:, None] & (k >= first), frame.rss_dbm + gain_db, frame.rss_dbm))
        for k, frame in enumerate(room.frames)
    ]


def states(frames):
    change = RssChange()
    state, told = change.init(Calibrate().over(frames[:EMPTY])), []
    for frame in frames[EMPTY:]:
        state = change.step(state, frame)
        told.append(state)
    return told


@pytest.mark.parametrize(("side", "gain_db"), longer([(0, -5.0), (1, 4.0), (0, 3.0)], (1, 4.0), (0, 3.0)))
def test_a_gain_is_taken_out_while_somebody_walks(side, gain_db):
    room = ray_room(0, (0.7,), frames=60)
    whole, found = states(room.frames), states(spoilt(room, side, gain_db, EMPTY + 20))
    assert not any(state.gains_db.any() for state in (*whole, *found[:20]))
    for before, after in zip(whole[20:], found[20:], strict=True):
        wanted = np.zeros((NODES, 2))
        wanted[CHANGED, side] = gain_db
        np.testing.assert_allclose(after.gains_db, wanted, atol=0.6)  # whole decibels
        np.testing.assert_allclose(after.rise_db, before.rise_db, atol=1.0)


@pytest.mark.parametrize("gains_db", longer([[-6.0, -3.0], [5.0, -4.0]], [-6.0, -3.0]))
def test_both_gains_of_a_radio_are_taken_out_while_somebody_walks(gains_db):
    """Of a radio that came back with other settings."""
    room = ray_room(1, (0.7,), frames=60)
    first = EMPTY + 20
    one = room._replace(frames=spoilt(room, 0, gains_db[0], first))
    whole, found = states(room.frames), states(spoilt(one, 1, gains_db[1], first))
    for before, after in zip(whole[20:], found[20:], strict=True):
        np.testing.assert_allclose(after.gains_db[CHANGED], gains_db, atol=0.8)
        assert not np.delete(after.gains_db, CHANGED, axis=0).any()
        np.testing.assert_allclose(after.rise_db, before.rise_db, atol=1.5)


@pytest.mark.parametrize("seed", longer([0, 1], 1))
def test_a_gain_of_both_ways_alike_is_taken_out_while_somebody_walks(seed):
    """An antenna that is turned."""
    room = ray_room(seed, (0.7,), frames=60)
    first = EMPTY + 20
    turned = spoilt(room._replace(frames=spoilt(room, 0, -6.0, first)), 1, -6.0, first)
    whole, found = states(room.frames), states(turned)
    assert not any(state.gains_db.any() for state in (*whole, *found[:20]))
    assert not found[19].gains_db.any()
    for state in found[22:]:  # walkers by the node stir most of its links
        np.testing.assert_allclose(state.gains_db[CHANGED], -6.0, atol=1.5)
    assert not any(np.delete(state.gains_db, CHANGED, axis=0).any() for state in found)


def test_a_room_or_an_air_that_has_changed_is_no_radios_gain():
    assert not node_gains(np.full(QUIET.shape, -4.0), QUIET, NODES).any()


def test_who_stands_by_a_node_changes_both_directions():
    """All of its links lose 8 dB, give or take what both directions share."""
    rng = np.random.default_rng(0)
    loss = np.zeros((NODES, NODES, 4))
    loss[CHANGED] = 8 + rng.normal(0, 2, (NODES, 4))
    loss = np.maximum(loss, loss.transpose(1, 0, 2))
    rise = -loss[ENDS[:, 0], ENDS[:, 1]] + rng.normal(0, 0.6, QUIET.shape)
    assert not node_gains(rise, QUIET, NODES).any()


def test_of_few_links_or_one_direction_nothing_is_known():
    rise = np.where(ENDS[:, [1]] == CHANGED, 4.0, 0.0) + np.zeros(QUIET.shape)
    assert node_gains(rise, QUIET, NODES)[CHANGED].tolist() == [0.0, 4.0]
    assert not node_gains(np.where(ENDS[:, [0]] == CHANGED, np.nan, rise), QUIET, NODES).any()
    few = directed_links_of(FEWEST_LINKS)
    off = np.where(few[:, [1]] == 1, 4.0, 0.0)
    assert not node_gains(off, np.ones_like(off), FEWEST_LINKS).any()


def test_it_is_added_to_the_readings_of_both_ends():
    gains = np.zeros((NODES, 2))
    gains[2], gains[5] = (1.0, 10.0), (100.0, 1000.0)
    added = dict(zip(map(tuple, ENDS.tolist()), of_readings(gains)[:, 0], strict=True))
    assert (added[2, 5], added[5, 2], added[2, 0], added[0, 2]) == (1001.0, 110.0, 1.0, 10.0)


def test_a_radio_whose_gain_jumps_is_nobody_and_is_named():
    """It was a person, 1.0 sure, in .77 of the empty frames of two rooms, without a grave word."""
    room = ray_room(0, (0.7,), frames=1)
    quiet = room.frames[:EMPTY] + [RssFrame(frame.time_s + 0.5 * EMPTY, frame.rss_dbm) for frame in room.frames[:EMPTY]]
    facts, tracked = LinkFacts(room.nodes), 0
    parameters = LinkTracking(calibration_frames=EMPTY)
    for step in track(spoilt(room._replace(frames=quiet), 1, 4.0, EMPTY + 5), room.nodes, parameters):
        facts.add(step)
        tracked += len(step.tracks)
    assert tracked == 0
    (gain,) = (finding for finding in facts.findings() if finding.name == "links.gain")
    assert not gain.holds
    assert not gain.grave
    assert gain.seen == pytest.approx(4.0, abs=0.6)
    assert f"what {room.nodes.names[CHANGED]} hears" in gain.sentence
