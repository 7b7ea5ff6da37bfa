"""A track that never moves and whose levels keep steady is the room's; who has come, or sways, stays somebody."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.geometry.areas import Area
from elusive.preprocess.fade_level import RssChange
from elusive.preprocess.link_calibration import Calibration
from elusive.systems.links.by_links import LinksChain, LinksMethod
from elusive.systems.links.resting import MOVED_M, after_frame
from elusive.tracking.lifecycle import Life
from elusive.tracking.superposed_state import Target
from tests.longer import longer
from tests.tracking.link_scenes import shadowed_links, states_of

AREA = Area.rectangle(-4, 4, -4, 4)
INTERVAL_S, PLACE = 0.5, np.array([1.2, -0.8])


def followed(frames, sensor):
    """States of the chain after each frame."""
    rng = np.random.default_rng(3)
    chain = LinksChain(LinksMethod().tracker(sensor, AREA), AREA, 1.0, True)
    state = chain.init(np.empty(0), rng)
    for number, frame in enumerate(frames):
        state = chain.step(state, INTERVAL_S * number, frame, rng)
        yield state


def stood(seed, sways, frames, walks=0, varies=False):
    """What somebody who appears does, or who walks there first, and stands: readings that stay, wander or vary."""
    rng, sensor = np.random.default_rng(seed), shadowed_links(seed)
    nobody = states_of(np.empty((0, 2)))
    quiet = [sensor.simulate(nobody, rng) for _ in range(6)]
    coming = [sensor.simulate(states_of(PLACE[None] - [0.35 * k, 0.0]), rng) for k in range(walks, 0, -1)]
    drawn = [sensor.simulate(states_of(PLACE[None]), rng) for _ in range(frames)]
    done, left = drawn[0], 0.8  # of what is done, after a frame
    standing = []
    for number in range(frames):
        if sways:
            done = drawn[0] + left * (done - drawn[0]) + np.sqrt(1 - left**2) * sways * (drawn[number] - drawn[0])
        now = drawn[number] if varies else done
        standing.append(now + sensor.simulate(nobody, rng))
    return [*quiet, *coming, *standing], sensor


@pytest.mark.parametrize("varies", [False, True])
@pytest.mark.parametrize("seed", longer([0, 1], 1))
def test_what_never_moves_and_keeps_steady_is_the_rooms(seed, varies):
    """A shelf, or a fan: where it was taken for somebody, and soon."""
    frames, sensor = stood(seed, 0.0, 70, varies=varies)
    number, changed = next((k, state.changed) for k, state in enumerate(followed(frames, sensor)) if state.changed)
    assert INTERVAL_S * number < 40
    assert np.linalg.norm(changed.places - PLACE, axis=1).min() < 1
    assert (changed.variance_db2 is not None) == varies
    if not varies:
        after = np.array(frames[20:])
        assert np.nanmedian(np.abs(changed.level_db - np.nanmean(after, axis=0))) < 0.5


@pytest.mark.parametrize("period_s", longer([6.0, 13.0], 13.0))
def test_what_turns_to_and_fro_is_the_rooms(period_s):
    """A fan's head: its levels wander from one second to the next, but not over turns."""
    rng, sensor = np.random.default_rng(1), shadowed_links(0)
    nobody, somebody = states_of(np.empty((0, 2))), states_of(PLACE[None])
    middle, left, ahead = (sensor.simulate(somebody, rng) for _ in range(3))
    frames = [sensor.simulate(nobody, rng) for _ in range(6)]
    for turned in 2 * np.pi * INTERVAL_S / period_s * np.arange(200):
        now = middle + 0.7 * (np.cos(turned) * (left - middle) + np.sin(turned) * (ahead - middle))
        frames.append(now + sensor.simulate(nobody, rng))
    told = list[float]()
    for state in followed(frames, sensor):
        if state.changed is not None:
            break
        told += [track.existence for track in state.tracks if track.status == "confirmed"]
    assert np.linalg.norm(state.changed.places - PLACE, axis=1).min() < MOVED_M
    assert told[-1] < 0.7  # .50 to .64 of a lone track over four seeds
    assert state.changed.variance_db2 is not None


def test_two_tracks_of_one_change_go_together():
    """Lest the links beside the second keep their levels, as if they ran by somebody."""
    frames, sensor = stood(0, 0.0, 40)
    states = list(followed(frames, sensor))
    number = next(k for k, state in enumerate(states) if state.changed)
    before, state = states[number - 1 : number + 1]
    (target,) = (one for one in state.belief.targets if one.life.track in state.changed.tracks)
    name, time_s = target.life.track, INTERVAL_S * number
    (late,) = after_frame({}, [target], sensor, frames[number], time_s)[0].values()  # found in this frame
    both = [target, target._replace(life=target.life._replace(track=name + 1))]
    _, changed = after_frame({**before.rests, name + 1: late}, both, sensor, frames[number], time_s)
    assert changed.tracks == (name, name + 1)
    assert len(changed.places) == 1


def tracked(number, place, rng):
    """A confirmed track somewhere."""
    states = np.column_stack([states_of(place[None])[:, k] + rng.normal(0, 0.2, 100) for k in range(4)])
    life, even = Life(track=number, status="confirmed"), np.full(100, 0.01)
    return Target(life, 1.0, states, even, states_of(place[None])[0], 0.04 * np.eye(4))


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize(("sways", "another"), [(0.0, True), (0.0, False), (0.5, True)])
def test_who_stands_where_another_was_found_who_walks_on_is_watched(seed, sways, another):
    """As many are there as have come: of a shelf that has taken over the track of who put it down it is told so."""
    rng, sensor = np.random.default_rng(seed), shadowed_links(seed)
    nobody, done = states_of(np.empty((0, 2))), sensor.simulate(states_of(PLACE[None]), rng)
    rests, told, now = {}, [], done
    for number in range(80):
        now = done + 0.8 * (now - done) + 0.6 * sways * (sensor.simulate(states_of(PLACE[None]), rng) - done)
        targets = [tracked(1, PLACE - [0.35 * max(8 - number, 0), 0.0], rng)]
        if another and number > 20:  # and goes round in a circle
            turned = 0.2 * (number - 20)
            targets.append(tracked(2, np.array([-1.5 - np.cos(turned), 1.5 + np.sin(turned)]), rng))
        people = [states_of(target.mean[[0, 2]][None]) for target in targets[1:]]
        frame = now + sum(sensor.simulate(one, rng) for one in [nobody, *people])
        rests, changed = after_frame(rests, targets, sensor, frame, INTERVAL_S * number)
        told.append((changed is not None, rests[1].came, rests[1].nobody))
    assert told[19][1]
    assert any(one for one, _, _ in told) == (another and not sways)
    assert told[-1][1] == (not another)
    assert (told[-1][2] > 0.5) == (another and not sways)


@pytest.mark.parametrize("later", [0, 4])
def test_who_walks_on_by_the_number_of_what_rests_leaves_theirs_there(later):
    """A walker passes a shelf that has never moved, and their tracks exchange their numbers, at once or after a gap."""
    rng, sensor = np.random.default_rng(0), shadowed_links(0)
    frame = sensor.simulate(states_of(np.empty((0, 2))), rng)
    east = np.array([1.0, 0.0])
    places = [{1: PLACE - 0.4 * (10 - k) * east, **({2: PLACE} if k > 3 else {})} for k in range(9)]
    gone = [PLACE + 0.4 * k * east for k in range(9)]
    places += [{2: place, **({1: PLACE} if k >= later else {})} for k, place in enumerate(gone)]
    places += [{2: gone[-1], 1: PLACE + 0.2 * k * east} for k in range(5)]
    rests, told = {}, []
    for number, now in enumerate(places):
        targets = [tracked(name, place, rng) for name, place in now.items()]
        rests, _ = after_frame(rests, targets, sensor, frame, INTERVAL_S * number)
        told.append({name: rests[name].came for name in now})
    assert told[8] == {1: True, 2: False}
    assert told[20] == {1: False, 2: True}
    assert told[22] == {1: False, 2: True}  # that it is told to be .6 m off is no way


@pytest.mark.thorough
@pytest.mark.parametrize("seed", longer([0, 1], 1))
def test_who_has_come_or_sways_stays(seed):
    """Sure of who does both, as nobody stands quite still."""
    for walks, sways, least in ((8, 0.0, 0.85), (0, 0.15, 0.85), (8, 0.15, 0.99)):
        frames, sensor = stood(seed, sways, 100, walks)
        states = list(followed(frames, sensor))
        assert not any(state.changed for state in states)
        (track,) = (track for track in states[-1].tracks if track.status == "confirmed")
        assert track.existence > least


def test_existence_falls_while_a_track_never_moves_and_keeps_steady():
    """From 1 / 1.12 to even, when it is the room's: nobody is sure who has not been seen to come."""
    frames, sensor = stood(0, 0.0, 40)
    states = list(followed(frames, sensor))
    number = next(k for k, state in enumerate(states) if state.changed)
    told = [track.existence for state in states[:number] for track in state.tracks if track.status == "confirmed"]
    assert told[0] == pytest.approx(1 / 1.12, abs=0.02)
    assert told[-1] == pytest.approx(0.5, abs=0.05)
    assert np.all(np.diff(told) < 0.02)


def test_the_room_goes_on_from_the_levels_that_it_has_now():
    """Links that run by others stay as they were."""
    mean, variance = np.full((6, 2), -60.0), np.ones((6, 2))
    state = RssChange().init(Calibration(0.0, mean, variance, ()))
    level_db, away = np.arange(12.0).reshape(6, 2), np.arange(6) < 4
    level_db[0, 0] = np.nan
    now = state.changed(level_db, 3 * variance, away)
    told = np.where(away[:, None], np.nan_to_num(level_db), 0.0)
    assert now.calibration.mean_dbm == pytest.approx(mean + told)
    assert now.calibration.variance_db2 == pytest.approx(np.where(away[:, None], 3.0, 1.0) * variance)
    assert now.settled.mean_db == pytest.approx(-told)
    assert state.changed(level_db, None, away).calibration.variance_db2 is state.calibration.variance_db2
