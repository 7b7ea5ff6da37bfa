"""A log with somebody in its calibration: who walks is found all the same, and who stays where they are is named."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.io.link_logs import LinkLog
from elusive.systems.links.empty_room import with_empty_room
from elusive.systems.links.results import LinkRun
from elusive.systems.links.track import LinkTracking, track
from tests.longer import longer
from tests.ray_room import EMPTY, HALF_M, ray_room

TRACKING = LinkTracking(calibration_frames=EMPTY, fit_frames=0)
NODES, CHANNELS, FRAMES = 10, 2, 90


def sitting(seed, frames):
    """Places of somebody who sits and sways by a centimetre."""
    rng = np.random.default_rng([9, seed])
    places, sways = [], np.zeros(2)
    spot = rng.uniform(-0.6 * HALF_M, 0.6 * HALF_M, 2)
    for _ in range(frames):
        sways = 0.8 * sways + 0.6 * rng.normal(0, 0.01, 2)
        places.append(spot + sways)
    return np.array(places)


def logged(room, first=0):
    """The room's log from a frame on."""
    return LinkLog("log", room.channels, lambda: ((room.name, *frame) for frame in room.frames[first:]), -10.0)


def told(room, first=0):
    """Share of the frames after the calibration with as many as there are, and what is said of the calibration."""
    log, recorded = with_empty_room(logged(room, first), TRACKING)
    people = {frame.time_s: len(there) for frame, there in zip(room.frames, room.truth, strict=True)}
    right = []
    with LinkRun("log", room.nodes, TRACKING, recorded=recorded) as run:
        for step in track(log, room.nodes, TRACKING):
            run.append(step)
            if step.time_s > room.frames[first].time_s and not step.state.calibrating:
                right.append(sum(one.status == "confirmed" for one in step.tracks) == people[step.time_s])
        (finding,) = (one for one in run.outcome().findings if one.name == "links.calibration")
    return np.mean(right), finding


@pytest.mark.parametrize("seed", longer([31, 32, 33], 31, 33))
def test_who_walks_throughout_is_found(seed):
    """Nobody, without a finding, where the frames with them are taken for the empty room's."""
    right, finding = told(ray_room(seed, [0.7], NODES, CHANNELS, FRAMES), EMPTY)
    assert right > 0.9
    assert not finding.holds
    assert not finding.grave
    assert "taken from the whole log" in finding.sentence


@pytest.mark.parametrize("seed", longer([31, 32, 33], 31, 33))
def test_who_sits_there_throughout_is_named(seed):
    """They belong to the room that is learned."""
    _, finding = told(ray_room(seed, [], NODES, CHANNELS, FRAMES, sits=sitting(seed, EMPTY + FRAMES)))
    assert not finding.holds
    assert finding.grave


@pytest.mark.parametrize("seed", longer([31, 32, 33], 31))
def test_of_an_empty_room_nothing_is_learned(seed):
    log = logged(ray_room(seed, [0.7], NODES, CHANNELS, FRAMES))
    assert with_empty_room(log, TRACKING) == (log, None)


def test_the_room_is_learned_from_all_of_a_long_log():
    """Somebody sits there in a quarter of it, the calibration in it."""
    room = ray_room(31, [], NODES, CHANNELS, 1800, sits=sitting(31, 450))
    log, recorded = with_empty_room(logged(room), TRACKING)
    assert recorded is not None
    made, nobody, there = (
        np.mean([frame.rss_dbm for frame in some], axis=0)
        for some in (list(log)[:EMPTY], room.frames[450:], room.frames[:EMPTY])
    )
    assert np.nanmean((made - nobody) ** 2) < 0.1 * np.nanmean((there - nobody) ** 2)
