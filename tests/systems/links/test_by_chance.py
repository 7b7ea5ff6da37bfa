"""What somebody gains by chance in frames of an empty room is told by its own frames, and asked of whoever comes."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.link_calibration import Calibrate
from elusive.sensors.link_shadowing import LinkShadowing, TemperedRise
from elusive.sensors.radio_network import RssFrame
from elusive.systems.links.by_chance import BEYOND, gained_by_chance
from elusive.systems.links.track import LinkTracking, track
from tests.ray_room import EMPTY as RAY_EMPTY
from tests.ray_room import ray_room
from tests.systems.links.test_live_site import EMPTY, PARAMETERS, door
from tests.tracking.link_scenes import border

NODES = border(10, 4.0)
AXIS = np.arange(-3.8, 4.0, 0.4)
CELLS = np.column_stack([axis.ravel() for axis in np.meshgrid(AXIS, AXIS)])


def quiet(frames, seed=0, channels=4):
    return np.random.default_rng(seed).normal(-60, 1, (frames, 90, channels))


def sensed(levels):
    """The sensor of a calibration on frames of levels, and their changes from its mean."""
    calibration = Calibrate().over([RssFrame(0.5 * k, frame) for k, frame in enumerate(levels)])
    sensor = LinkShadowing().links(NODES, calibration.mean_dbm, calibration.variance_db2)
    return sensor, levels - calibration.mean_dbm


@pytest.mark.parametrize("frames", [2, 10, 40])
def test_of_a_room_that_is_quiet_nothing_is_asked(frames):
    assert gained_by_chance(*_with_cells(quiet(frames))) == 0.0


def test_what_frames_after_the_calibration_gain_is_told_by_its_own():
    """Of links that share noise, from ten frames: it is beyond nearly all that comes, and not far beyond."""
    frames, nodes, there = door(0)
    first = int(np.flatnonzero(there)[0])
    levels = np.array([frame.rss_dbm for frame in frames[: EMPTY + first]])
    calibration = Calibrate().over(frames[:EMPTY])
    sensor = LinkShadowing().links(nodes, calibration.mean_dbm, calibration.variance_db2)
    cells, _ = LinkTracking().area_of(nodes).cells(0.8)
    asked = gained_by_chance(sensor, cells, levels[:EMPTY] - calibration.mean_dbm)
    gains = []
    for level in levels[EMPTY:]:
        ratio = sensor.log_ratio(sensor.expected_at(cells), TemperedRise(level - calibration.mean_dbm, 1.0), ())
        gains.append(np.logaddexp.reduce(ratio) - np.log(len(ratio)))
    assert max(gains) > 0  # somebody would have been seen
    assert np.mean(np.array(gains) > asked) <= 0.02
    assert asked <= np.mean(gains) + 3 * BEYOND * np.std(gains)


def test_one_disturbance_hides_nobody():
    """It looks like somebody by the calibration on the other frames, but most frames do not."""
    levels = quiet(20)
    levels[7, :18] += np.random.default_rng(1).normal(0, 6, levels[7, :18].shape)
    sensor, _ = sensed(np.delete(levels, 7, axis=0))
    assert (
        sensor.log_ratio(sensor.expected_at(CELLS), levels[7] - np.delete(levels, 7, axis=0).mean(axis=0), ()).max() > 0
    )
    assert gained_by_chance(*_with_cells(levels)) == 0.0


@pytest.mark.thorough
def test_nobody_is_tracked_before_a_hall_is_known():
    """Candidates, .98 sure and more, were in 7 of 48 frames and 20 of 22, one of them confirmed in another hall."""
    for seed in (0, 5):
        frames, nodes, there = door(seed)
        steps = list(track(frames[: EMPTY + int(np.flatnonzero(there)[0])], nodes, PARAMETERS))
        assert not any(step.tracks for step in steps)


@pytest.mark.thorough
def test_a_room_of_rays_is_tracked_as_before():
    room = ray_room(0, (0.7,), frames=40)
    steps = list(track(room, room.nodes, LinkTracking(calibration_frames=RAY_EMPTY)))
    assert steps[-1].state.people.by_chance == 0.0


def _with_cells(levels):
    sensor, rises = sensed(levels)
    return sensor, CELLS, rises
