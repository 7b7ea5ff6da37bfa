"""A log that is followed as it comes is tracked by what its first frames say of the site, as a recorded one is."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from elusive.sensors.link_shadowing import LinkShadowing
from elusive.systems.links.by_links import LinksMethod
from elusive.systems.links.live_site import BEYOND, FRAMES, SHARE_SD, sure
from elusive.systems.links.simulate import LinkSimulation
from elusive.systems.links.site import EXPLAINED
from elusive.systems.links.track import LinkTracking, track
from elusive.tracking.memory import Memory
from tests.longer import longer
from tests.ray_room import EMPTY as RAY_EMPTY
from tests.ray_room import ray_room

EMPTY, LATE = 10, 15  # frames; within which somebody who came is known, beside those that tell the site
PARAMETERS = LinkTracking(calibration_frames=EMPTY)


def door(seed, nodes=41):
    """Frames, nodes and how many are there in each of a hall whose people come in ten frames a second."""
    hall = LinkSimulation(
        walks={"users": 3, "total_positions": 140, "step_distance_m": 0.12, "latest_entrance": 60},
        network={"kind": "border", "nodes": nodes}, interval_s=0.1, seed=seed,
    )  # fmt: skip
    truth = hall.truth()
    frames = list(hall.frames(hall.images(truth)))
    return frames, hall.bind().nodes, np.isfinite(truth).all(axis=2).sum(axis=1)


def confirmed(steps):
    return np.array([sum(track.status == "confirmed" for track in step.tracks) for step in steps[EMPTY:]])


@pytest.mark.thorough
def test_one_who_comes_in_is_one_from_the_first_frame_on():
    """By the effect of a basement they were up to 19, each .999 sure."""
    frames, nodes, there = door(3)
    steps = list(track(frames, nodes, PARAMETERS))
    many = confirmed(steps)
    assert (many > there).mean() <= 0.01
    assert (many < there).sum() <= FRAMES + LATE * there.max()
    assert "radiation of 2" in steps[-1].state.remarks[-1]  # 20 dB, as it is simulated


@pytest.mark.thorough
def test_people_in_halls_are_as_many_as_they_are():
    extra = [confirmed(list(track(frames, nodes, PARAMETERS))) - there for frames, nodes, there in map(door, range(8))]
    assert np.mean([(many > 0).mean() for many in extra]) <= 0.02
    assert np.max(extra) <= 1


@pytest.mark.thorough
def test_what_frames_said_of_the_site_outlives_a_restart():
    frames, nodes, _ = door(3, nodes=16)
    whole = [(step.tracks, step.state.site) for step in track(frames, nodes, PARAMETERS)][EMPTY:]
    told = [number for number, (_, site) in enumerate(whole) if site]
    for broken in (told[0] - 3, told[0] + 3):  # while it is looked at, and afterwards
        memory = Memory()
        for number, _ in enumerate(track(frames, nodes, PARAMETERS, memory)):
            if number == EMPTY + broken:
                break
        kept = pickle.loads(pickle.dumps((memory.held, memory.first, memory.time_s)))
        gone_on = [(step.tracks, step.state.site) for step in track(frames, nodes, PARAMETERS, Memory(*kept))]
        for (tracks, site), (expected, said) in zip(gone_on, whole[broken + 1 :], strict=True):
            assert site == said
            assert [one.track for one in tracks] == [one.track for one in expected]
            assert all(np.array_equal(one.mean, other.mean) for one, other in zip(tracks, expected, strict=True))


@pytest.mark.thorough
@pytest.mark.parametrize("seed", longer([0, 5], 5))
def test_a_room_of_rays_is_tracked_by_shadowing(seed):
    room = ray_room(seed, (0.7,), frames=60)
    parameters = LinkTracking(calibration_frames=RAY_EMPTY)
    looked, unlooked = (
        [[one.mean.tolist() for one in step.tracks] for step in track(room, room.nodes, one)]
        for one in (parameters, parameters.replace(fit_frames=0))
    )
    assert looked == unlooked


@pytest.mark.thorough
def test_an_effect_that_was_given_stays_while_frames_come():
    frames, nodes, _ = door(3, nodes=16)
    given = PARAMETERS.replace(method=LinksMethod(effect=LinkShadowing(far_sd_db=2.0)))
    assert not any(step.state.site for step in track(frames, nodes, given))


def test_chance_makes_no_sum_over_voxels():
    """Of logs whose shares are what they are in rooms of rays and less, one in a thousand is taken for one at most."""
    rng = np.random.default_rng(0)
    shares = EXPLAINED - 0.05 + SHARE_SD * rng.standard_normal((1000, 60))
    taken = sum(any(sure(row[:n]) for n in range(1, 61)) for row in shares)
    assert taken <= 5  # 1.1 expected at most: beyond BEYOND + .5 deviations once, over about five independent means
    assert sure(np.full(FRAMES, EXPLAINED + BEYOND * SHARE_SD / np.sqrt(FRAMES) + 1e-9))
    assert not sure(np.ones(FRAMES - 1))
