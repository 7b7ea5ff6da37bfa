"""Trackers of people on heads whose right answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError, ElusiveError, ParameterError
from elusive.geometry.areas import Area
from elusive.metrics import clear_mot, sightings, sightings_of
from elusive.tracking.lifecycle import Lifecycle
from elusive.tracking.people import Entrance, events_between
from elusive.tracking.people_hungarian import HungarianTracker
from elusive.tracking.people_radius import RadiusTracker
from elusive.tracking.track import Track

AREA = Area.rectangle(-12, 12, -12, 12)
STRIP = Entrance(area=AREA, width_m=2.0)
BOTH = pytest.mark.parametrize("tracker", [RadiusTracker(), HungarianTracker()], ids=["radius", "hungarian"])


def follow(tracker, frames):
    """States after each frame; a frame is a list of places."""
    state, states = tracker.init(), []
    for time_s, heads in enumerate(frames):
        places = np.array(heads, dtype=np.float64).reshape(-1, 2)
        state = tracker.step(state, time_s, places, np.full(len(places), 5.0))
        states.append(state)
    return states


def table(states):
    rows = [
        (frame, one.track, *one.position)
        for frame, state in enumerate(states)
        for one in state.tracks
        if one.life.lives
    ]
    frame, track, x, y = np.array(rows).T
    return sightings(frame.astype(int), track.astype(int), np.stack([x, y], axis=1))


def shown(state):
    return [
        Track(one.track, one.life.status, np.nan, np.array([*one.position, *one.velocity])[[0, 2, 1, 3]],
              np.full((4, 4), np.nan), extra={"missed_frames": one.life.missed})
        for one in state.tracks
    ]  # fmt: skip


def events(tracker, states):
    pairs = zip([tracker.init(), *states[:-1]], states, strict=True)
    return [
        (event.time_s, event.track, event.what)
        for before, after in pairs
        for event in events_between(after.time_s, shown(before), shown(after), tracker.entrance, tracker.near_within_m)
    ]


def walk(start, step, frames):
    return np.array(start) + np.arange(frames)[:, None] * np.array(step)


@BOTH
def test_one_person_from_the_door_to_the_other_side(tracker):
    tracker = tracker.replace(entrance=STRIP)
    path = walk((-12.0, 0.0), (0.8, 0.1), 31)
    states = follow(tracker, [*([place] for place in path), *[[]] * 6])
    scored = clear_mot(sightings_of(path[:, None]), table(states[:31]))
    assert scored.mota == 1.0
    assert scored.max_deviation == pytest.approx(0.0, abs=1e-12)
    confirmed = tracker.life.confirm_frames - 1
    # who was going out and is seen no more has left; by the thesis after as many frames as anywhere
    ended = 31 + (tracker.life.delete_frames - 1 if tracker.kind == "radius" else 0)
    assert [event for event in events(tracker, states) if event[2] not in ("missed", "found")] == [
        (0, 1, "appeared"),
        (confirmed, 1, "confirmed"),
        (ended, 1, "left"),
    ]
    assert [one.life.status for one in states[ended].tracks] == ["deleted"]
    assert states[ended + 1].tracks == ()


@BOTH
def test_who_appears_in_the_middle(tracker):
    """In the thesis's tracker a blob away from the entrance is spurious; anywhere is an entrance without a strip."""
    frames = [[(0.0, 0.0)]] * 5
    assert follow(tracker.replace(entrance=STRIP), frames)[-1].tracks == ()
    assert [one.life.status for one in follow(tracker, frames)[-1].tracks] == ["confirmed"]


@BOTH
def test_a_gap_is_bridged_and_told(tracker):
    path = walk((-10.0, 0.0), (0.6, 0.0), 20)
    frames = [[place] if k not in (9, 10, 11) else [] for k, place in enumerate(path)]
    states = follow(tracker, frames)
    assert {one.track for state in states for one in state.tracks} == {1}
    assert (9, 1, "missed") in events(tracker, states)
    assert (12, 1, "found") in events(tracker, states)


@BOTH
def test_deleted_after_as_many_frames_as_asked(tracker):
    tracker = tracker.replace(life=tracker.life.replace(delete_frames=4))
    states = follow(tracker, [*[[(0.0, 0.0)]] * 12, *[[]] * 5])
    statuses = [[one.life.status for one in state.tracks] for state in states[12:]]
    assert statuses == [["confirmed"]] * 3 + [["deleted"], []]
    assert (15, 1, "left") in events(tracker, states)
    tracker = tracker.replace(entrance=STRIP)
    lost = follow(
        tracker,
        [*[[place] for place in walk((-11, 0), (1, 0), 12)], *[[]] * 5],
    )
    assert (15, 1, "lost") in events(tracker, lost)


def test_crossing_paths_are_told_apart_by_velocity():
    """Two cross at a right angle and are one head for three frames; by distance alone the numbers may swap."""
    frames = 21
    a, b = walk((-5.0, 0.0), (0.5, 0.0), frames), walk((0.0, 5.0), (0.0, -0.5), frames)
    heads = [[p, q] if np.linalg.norm(p - q) > 1.2 else [(p + q) / 2] for p, q in zip(a, b, strict=True)]
    assert sum(len(one) == 1 for one in heads) == 3
    tracker = HungarianTracker()
    states = follow(tracker, heads)
    scored = clear_mot(sightings_of(np.stack([a, b], axis=1)), table(states))
    assert scored.mota == 1.0
    assert {what for *_, what in events(tracker, states)} >= {"near", "apart", "missed", "found"}


def test_no_two_heads_have_one_number_and_the_nearest_takes_it():
    tracker = RadiusTracker()
    states = follow(tracker, [[(0.0, 0.0)], [(1.0, 0.0), (0.4, 0.0)]])
    numbers = {one.position: one.track for one in states[-1].tracks}
    assert numbers == {(0.4, 0.0): 1, (1.0, 0.0): 2}


def test_radius_memory_and_enlargement():
    """Eq. 3.22: a head within r of any of the last n frames' heads; 1.5 r where two tracks are near."""
    tracker = RadiusTracker(radius_m=1.0, memory_frames=2)
    gone_two = [[(0.0, 0.0)], [], [(0.9, 0.0)]]
    assert [one.track for one in follow(tracker, gone_two)[-1].tracks] == [1]
    gone_three = [[(0.0, 0.0)], [], [], [(0.9, 0.0)]]
    assert [one.track for one in follow(tracker, gone_three)[-1].tracks] == [1, 2]
    far = [[(0.0, 0.0)], [(1.2, 0.0)]]
    assert [one.track for one in follow(tracker, far)[-1].tracks] == [1, 2]
    company = [[(0.0, 0.0), (0.0, 1.9)], [(1.2, 0.0), (0.0, 1.9)]]
    assert [one.track for one in follow(tracker, company)[-1].tracks] == [1, 2]
    apart = [[(0.0, 0.0), (0.0, 2.1)], [(1.2, 0.0), (0.0, 2.1)]]
    assert [one.track for one in follow(tracker, apart)[-1].tracks] == [1, 2, 3]


def test_confirmed_by_n_of_the_last_n_max():
    tracker = RadiusTracker(
        life=Lifecycle(confirm_frames=3, confirm_window=4, delete_frames=3, drop_frames=3), memory_frames=3
    )
    here, gone = [(0.0, 0.0)], []
    often = follow(tracker, [here, gone, here, here])
    assert [state.tracks[0].life.status for state in often] == ["candidate"] * 3 + ["confirmed"]
    seldom = follow(tracker, [here, gone, here, gone, here, gone, here])
    assert {state.tracks[0].life.status for state in seldom} == {"candidate"}


def test_assignment_is_the_best_in_sum():
    """The nearest head of the first track is the only one within the gate of the second."""
    tracker = HungarianTracker(gate_m=2.0)
    states = follow(tracker, [[(0.0, 0.0), (1.5, 0.0)], [(-0.9, 0.0), (0.2, 0.0)]])
    places = {one.track: one.position for one in states[-1].tracks}
    assert places == {1: (-0.9, 0.0), 2: (0.2, 0.0)}


@BOTH
def test_a_long_run_forgets_who_has_gone(tracker):
    rng = np.random.default_rng(0)
    state = tracker.init()
    for time_s in range(3000):
        places = rng.uniform(-12, 12, (rng.integers(3), 2))
        state = tracker.step(state, time_s, places, np.ones(len(places)))
        assert len(state.tracks) < 40
    assert state.time_s == 2999


@BOTH
@pytest.mark.parametrize(
    ("positions", "intensities", "sentence"),
    [
        ([[0.0, np.nan]], [1.0], "one is not finite"),
        ([[0.0, 1.0]], [1.0, 2.0], r"have shapes \(1, 2\) and \(2,\)"),
        ([[0.0, 1.0, 2.0]], [1.0], r"have shapes \(1, 3\)"),
    ],
)
def test_refused_heads(tracker, positions, intensities, sentence):
    with pytest.raises(DataError, match=sentence):
        tracker.step(tracker.init(), 0.0, np.array(positions), np.array(intensities))


def test_refused_parameters():
    with pytest.raises(ParameterError, match="give the area too"):
        Entrance(width_m=2.0)
    with pytest.raises(ElusiveError, match="no track is ever confirmed"):
        HungarianTracker(life={"confirm_frames": 6, "confirm_window": 5})


def test_a_track_has_the_velocity_of_its_heads_at_any_times():
    """1.5 m/s, seen at uneven times, with gaps of several seconds that the velocity bridges."""
    times = np.cumsum(np.random.default_rng(0).uniform(0.1, 3.0, 40))
    tracker, state = HungarianTracker(), HungarianTracker().init()
    for time_s in times:
        state = tracker.step(state, time_s, np.array([[1.5 * time_s, 0.0]]), np.ones(1))
        assert [one.track for one in state.tracks] == [1]
    np.testing.assert_allclose(state.tracks[0].velocity, (1.5, 0.0), atol=1e-9)
    with pytest.raises(DataError, match="sort the measurements by time"):
        tracker.step(state, 0.0, np.empty((0, 2)), np.empty(0))
