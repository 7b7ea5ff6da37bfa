"""The level that radios write of all that is fainter is told by the calibration, and taken for not heard."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.preprocess.fade_level import RssChange
from elusive.preprocess.link_calibration import Calibrate
from elusive.sensors.radio_network import RssFrame
from elusive.systems.links.checks import LinkFacts
from elusive.systems.links.track import LinkTracking, track
from tests.ray_room import EMPTY, ray_room

ROOMS = range(4)


def read(room, step_db=1.0, share=0.0, lowest=None):
    """The room's frames in steps, with a share of the levels at the floor."""
    floor = np.nanquantile(room.frames[0].rss_dbm, share) if lowest is None else lowest
    return [RssFrame(f.time_s, np.maximum(np.round(f.rss_dbm / step_db) * step_db, floor)) for f in room.frames]


@pytest.mark.parametrize("step_db", [0.01, 1.0, 3.0])
@pytest.mark.parametrize("seed", ROOMS)
def test_levels_that_thin_out_have_no_floor(seed, step_db):
    frames = read(ray_room(seed, (0.7,), frames=1), step_db, lowest=-math.inf)
    assert Calibrate().over(frames[:EMPTY]).floor_dbm == -math.inf


@pytest.mark.parametrize("share", [0.1, 0.2, 0.4])
@pytest.mark.parametrize("seed", ROOMS)
def test_a_floor_is_found_and_what_lies_there_is_not_heard(seed, share):
    frames = read(ray_room(seed, (0.7,), frames=20), share=share)
    calibration = Calibrate().over(frames[:EMPTY])
    levels = np.array([frame.rss_dbm for frame in frames])
    assert calibration.floor_dbm == np.nanmin(levels)
    lies = np.nanmedian(levels[:EMPTY], axis=0) == np.nanmin(levels)
    assert (np.isnan(calibration.mean_dbm) == lies).mean() >= 0.99  # but where half the frames lie there
    change = RssChange()
    state = change.init(calibration)
    for frame in frames[EMPTY:]:
        state = change.step(state, frame)
        assert np.isnan(state.rise_db[frame.rss_dbm == calibration.floor_dbm]).all()


def test_it_is_named():
    room = ray_room(0, (0.7,), frames=5)
    facts = LinkFacts(room.nodes)
    for step in track(read(room, share=0.1), room.nodes, LinkTracking(calibration_frames=EMPTY)):
        facts.add(step)
    (floor,) = (finding for finding in facts.findings() if finding.name == "links.floor")
    assert not floor.holds
    assert floor.seen == pytest.approx(0.1, abs=0.03)
