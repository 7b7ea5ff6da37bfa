"""Tracks of accumulated evidence: tables of lives, brute-force assignment, error rates by simulation."""

from __future__ import annotations

import math
from itertools import permutations
from typing import Any

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.tracking import Peak, PeakTracker, PeakTrackerState, find_peaks
from elusive.tracking.fresh import Fresh, sample

LETTERS = {"candidate": "c", "confirmed": "C", "deleted": "x"}
BY_FRAMES = {"confirm_risk": 1.0, "deletion_frames": 1e300}  # fresh evidence decides nothing
NOISE = np.random.default_rng(0).standard_normal(100)


def shown(state: PeakTrackerState) -> str:
    return "+".join(f"{LETTERS[track.status]}{track.track}" for track in state.tracks) or "."


def lived(places: list[float | None], shape: int = 100, **settings: Any) -> list[PeakTrackerState]:
    """Tracks of one peak a frame, at rest, or none."""
    tracker = PeakTracker(**(BY_FRAMES | settings))
    state, states = tracker.init(), []
    for place in places:
        peaks = [] if place is None else [Peak((float(place),), (0.0,), 9.0)]
        state = tracker.step(state, peaks, NOISE[:shape], 6.0)
        states.append(state)
    return states


@pytest.mark.parametrize(
    ("places", "settings", "expected"),
    [
        ([], {}, ""),
        ([None, 50, 50, 50], {}, ". c1 c1 C1"),
        ([50, None, 50, None, 50], {}, "c1 c1 c1 c1 C1"),  # peaks need not come in a row
        ([50, None, None, None], {"miss_frames": 3}, "c1 c1 c1 x1"),
        ([50, 50, 50, None, None, None], {"miss_frames": 2}, "c1 c1 C1 C1 x1 ."),  # shown once as deleted
        ([50, 50], {"confirm_frames": 1}, "C1 C1"),
        ([50, 56, 50], {"gate": 5.0}, "c1 c1+c2 c1+c2"),  # too far to be the same
        ([50, 55, 50], {"gate": 5.0, "velocity_gain": 0.0}, "c1 c1 C1"),  # the gate itself is within
        ([99, 1, 99], {}, "c1 c1 C1"),  # round the ring
        ([98, 1], {"border": "bounded", "gate": 5.0}, "c1 c1+c2"),
        ([50, None, 50, None, None], {"miss_frames": 1}, "c1 x1 c2 x2 ."),
    ],
)
def test_a_life_is_read_from_peaks(places: list[float | None], settings: dict[str, Any], expected: str):
    assert " ".join(shown(state) for state in lived(places, **settings)) == expected


def test_tracks_are_counted_and_their_numbers_never_used_twice():
    places: list[float | None] = []
    for i in range(6):
        places += [10.0 + 15 * i, None]
    states = lived(places, miss_frames=1)
    assert [shown(state) for state in states[::2]] == [f"c{i}" for i in range(1, 7)]
    assert states[-1].born == 6


def test_a_track_that_leaves_a_bounded_map_is_deleted():
    tracker = PeakTracker(border="bounded", **BY_FRAMES)
    state = tracker.step(tracker.init(), [Peak((97.0,), (2.0,), 9.0)], NOISE, 6.0)
    state = tracker.step(state, [Peak((99.0,), (2.0,), 9.0)], NOISE, 6.0)
    assert shown(state) == "c1"
    assert shown(tracker.step(state, [], NOISE, 6.0)) == "x1"


def test_a_missing_frame_moves_tracks_on_and_holds_nothing_against_them():
    tracker = PeakTracker(miss_frames=1)
    state = tracker.step(tracker.init(), [Peak((97.0, 5.0), (2.0, -1.0), 9.0)], NOISE.reshape(1, 100), 6.0)
    for _ in range(3):
        state = tracker.step(state, [], None, 6.0)
    (track,) = state.tracks
    assert (track.status, track.position, track.life.missed) == ("candidate", (3.0, 0.0), 0)
    assert (state.frames, state.seen) == (4, 1)
    assert track.fresh == Fresh.expecting(9.0, 0.98, 1)


@pytest.mark.parametrize("seed", range(40))
def test_assignment_equals_brute_force(seed):
    rng = np.random.default_rng(seed)
    tracker = PeakTracker(gate=25.0, **BY_FRAMES)
    period = np.array([100.0, 80.0])

    def peaks(count: int) -> list[Peak]:
        return [Peak(tuple(rng.uniform(0, period).tolist()), (0.0, 0.0), 9.0) for _ in range(count)]

    noise = rng.standard_normal((80, 100))
    first, second = peaks(rng.integers(1, 5)), peaks(rng.integers(1, 5))
    state = tracker.step(tracker.init(), first, noise, 6.0)
    links, free = tracker._assign(list(state.tracks), second, period)

    way = np.array([[np.subtract(a.position, b.position) for b in second] for a in first])
    distance = np.linalg.norm((way + period / 2) % period - period / 2, axis=-1)
    choices = [*range(len(second)), *[None] * len(first)]
    rated = []
    for choice in set(permutations(choices, len(first))):
        pairs = [distance[i, j] for i, j in enumerate(choice) if j is not None]
        if all(pair <= 25 for pair in pairs):
            rated.append((-len(pairs), sum(pairs), choice))
    most, least, _ = min(rated, key=lambda rating: rating[:2])
    pairs = [distance[i, j] for i, j in enumerate(links) if j is not None]
    assert (-len(pairs), pytest.approx(sum(pairs))) == (most, least)
    assert sorted([*free, *(j for j in links if j is not None)]) == list(range(len(second)))


def test_the_expected_level_is_what_noise_free_evidence_has():
    # P_k = level (1 - a^k); Var_k = (1 - a)^2 (1 - a^2k) / (1 - a^2)
    for smoothing, frames in ((0.98, 1), (0.98, 40), (0.5, 3), (0.0, 5)):
        average = 1.7 * (1 - smoothing**frames)
        variance = (1 - smoothing) ** 2 * sum(smoothing ** (2 * i) for i in range(frames))
        fresh = Fresh.expecting(average / math.sqrt(variance), smoothing, frames)
        assert fresh.level == pytest.approx(1.7)
    assert fresh.weight == pytest.approx(1.0)


def test_level_and_spread_follow_the_target():
    rng = np.random.default_rng(1)
    fresh = Fresh.expecting(8.0, 0.98, 60)
    for _ in range(2000):
        fresh = fresh.after(4 + 2 * rng.standard_normal(), 0.98)
    effective = 1.98 / 0.02  # frames in an average of this smoothing
    assert abs(fresh.level - 4) < 5 * 2 / math.sqrt(effective)
    assert abs(fresh.spread - 4) < 5 * 4 * math.sqrt(2 / effective)


def test_false_alarms_are_confirmed_no_more_often_than_the_risk():
    rng, runs, confirmed = np.random.default_rng(2), 1500, 0
    for _ in range(runs):
        fresh = Fresh.expecting(6.5, 0.98, 60)
        while fresh.against < math.log(100) and fresh.best < -math.log(0.05):
            fresh = fresh.after(rng.standard_normal(), 0.98)
        confirmed += fresh.best >= -math.log(0.05)
    assert confirmed / runs < 0.05 + 4 * math.sqrt(0.05 * 0.95 / runs)
    assert confirmed > 0


@pytest.mark.parametrize(("level", "deviation"), [(0.6, 1.0), (3.5, 2.0)])
def test_a_target_that_is_there_is_deleted_no_more_often_than_wanted(level, deviation):
    rng, lengths = np.random.default_rng(3), []
    score = level / Fresh.expecting(1.0, 0.98, 60).level
    for _ in range(60):
        fresh, frames = Fresh.expecting(score, 0.98, 60), 0
        while fresh.against <= math.log(40) and frames < 2000:
            fresh, frames = fresh.after(level + deviation * rng.standard_normal(), 0.98), frames + 1
        lengths.append(frames)
    assert np.mean(lengths) > 40
    assert np.mean(lengths) < 2000


def followed(present: list[bool], level: float, velocity: float, seed: int, smoothing: float = 0.98) -> list[Any]:
    """Filter, peaks and tracks of a target in a signal of 240 samples: its place, peaks and tracks in each frame."""
    recurrent = RecurrentFilter(smoothing=smoothing, max_velocity=3)
    tracker, rng = PeakTracker(smoothing=smoothing), np.random.default_rng(seed)
    belief, state, found = recurrent.init(rng, 0.0), tracker.init(), []
    for frame, there in enumerate(present):
        place = round(200 + velocity * frame) % 240
        evidence = rng.standard_normal(240)
        if there:
            evidence[place] += level
            evidence[[place - 1, (place + 1) % 240]] += 0.6 * level
        belief = recurrent.step(belief, belief.time_s + 1, evidence, rng)
        peaks = find_peaks(
            belief.score, belief.velocity, recurrent.motion_vectors(1), 5.5,
            smoothing=smoothing, frames=frame + 1, window=3,
        )  # fmt: skip
        state = tracker.step(state, peaks, evidence, 5.5)
        found.append((place, peaks, state))
    return found


def test_a_target_is_found_confirmed_and_ended_long_before_the_filter_forgets():
    frames = followed([False] * 60 + [True] * 60 + [False] * 60, 2.5, 2.0, seed=4)
    states = [state for _, _, state in frames]
    assert not any(state.tracks for state in states[:60])
    last = states[119]
    (track,) = last.tracks
    assert (track.track, track.status, track.velocity) == (1, "confirmed", (2.0,))
    assert track.position == (frames[119][0],)
    ends = next(i for i in range(120, 180) if states[i].tracks[0].status == "deleted")
    remembered = sum(bool(peaks) for _, peaks, _ in frames[120:])
    assert ends - 120 < 20 < 40 < remembered
    assert not any(state.tracks for state in states[ends + 1 :])  # the peak is still there, and begins nothing


def test_a_target_that_comes_back_begins_a_new_track():
    states = [state for *_, state in followed(([False] * 30 + [True] * 60) * 2, 3.0, -1.0, seed=5)]
    assert [track.track for track in states[89].tracks] == [1]
    (track,) = states[-1].tracks
    assert (track.track, track.status) == (2, "confirmed")


@pytest.mark.parametrize("velocity", [0.5, -0.3])
def test_velocities_between_those_of_the_filter_are_found(velocity):
    # the filter's peaks then lead and lag in turn, each with the nearest of its own velocities
    tracker, rng = PeakTracker(**BY_FRAMES), np.random.default_rng(6)
    state, found = tracker.init(), []
    for frame in range(200):
        true = 30 + velocity * frame
        ahead = rng.random() < velocity % 1
        peak = Peak(((round(true) + (1 if ahead else -1)) % 100,), (float(math.floor(velocity) + ahead),), 9.0)
        state = tracker.step(state, [peak], NOISE, 6.0)
        found.append(((state.tracks[0].position[0] - true + 50) % 100 - 50, state.tracks[0].velocity[0]))
    assert state.born == 1
    error, slope = np.array(found[50:]).T
    assert np.mean(slope) == pytest.approx(velocity, abs=0.03)
    assert np.std(slope) < 0.25
    assert np.sqrt(np.mean(error**2)) < 1.0


def test_evidence_is_sampled_at_the_nearest_cell_in_its_own_deviations():
    evidence = np.array([[0.0, 3.0, 0.0], [0.0, 0.0, 4.0]])
    assert sample(evidence, (1.4, -0.4)) == pytest.approx(3 / math.sqrt(25 / 6))
    assert sample(evidence, (2.0, 1.0)) == pytest.approx(4 / math.sqrt(25 / 6))
    assert sample(evidence, (2.6, 1.0)) == 0.0
    assert sample(evidence, (0.0, -0.6)) == 0.0


@pytest.mark.parametrize(
    "evidence",
    [np.full(9, np.nan), np.array([1.0, np.inf]), np.zeros(9), np.zeros((2, 2, 2)), np.float64(1.0), np.ones((3, 3))],
)
def test_bad_evidence_is_refused(evidence):
    with pytest.raises(DataError, match=r"^(evidence: must be a finite|peaks: must have 2 coordinates)"):
        PeakTracker().step(PeakTracker().init(), [Peak((1.0,), (0.0,), 9.0)], evidence, 6.0)


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"gate": 0.0}, "gate: must be greater than 0"),
        ({"confirm_frames": 0}, "confirm_frames: must be greater than or equal to 1"),
        ({"confirm_risk": 0.0}, "confirm_risk: must be greater than 0"),
        ({"confirm_risk": 1.5}, "confirm_risk: must be less than or equal to 1"),
        ({"miss_frames": 0}, "miss_frames"),
        ({"deletion_frames": 0.5}, "deletion_frames"),
        ({"position_gain": 0.0}, "position_gain"),
        ({"velocity_gain": 1.5}, "velocity_gain"),
        ({"smoothing": 1.0}, "smoothing: must be less than 1"),
        ({"miss_frame": 3}, "did you mean 'miss_frames'"),
    ],
)
def test_parameters_out_of_bounds_are_refused(settings, sentence):
    with pytest.raises(ParameterError, match=sentence):
        PeakTracker(**settings)
