"""Tracks of accumulated evidence: tables of lives, error rates by simulation, places to a fraction of a pixel."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate.image_evidence import WhiteEvidence
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.sensors import ImageSensor
from elusive.tracking import FollowedState, Follower, Footprint, Life, PeakTracker
from elusive.tracking.fresh import Fresh

BY_FRAMES = {"confirm_risk": 1.0, "deletion_frames": 1e300}  # fresh evidence decides nothing
BORN = Fresh.expecting(9.0, 0.98, 1)


@pytest.mark.parametrize(
    ("hits", "settings", "expected"),
    [
        ("111", {}, "c c C"),
        ("10101", {}, "c c c c C"),  # hits need not come in a row
        ("1000", {"miss_frames": 3}, "c c c x"),
        ("11100", {"miss_frames": 2}, "c c C C x"),
        ("11", {"confirm_frames": 1}, "C C"),
        ("1??1?1", {}, "c c c c c C"),  # a missing frame is held against nobody
        ("1????0", {"miss_frames": 2}, "c c c c c c"),
    ],
)
def test_a_life_is_read_from_hits(hits: str, settings: dict[str, Any], expected: str):
    tracker = PeakTracker(**(BY_FRAMES | settings))
    life, _ = tracker.lifecycle.step(Life(), 1.0, 0, believed=True)
    shown = [life.status]
    for hit in hits[1:]:
        life = tracker.judged(life, 1, BORN, None if hit == "?" else hit == "1", outside=False)
        shown.append(life.status)
    assert " ".join({"candidate": "c", "confirmed": "C", "deleted": "x"}[str(status)] for status in shown) == expected


def test_a_track_that_leaves_a_bounded_frame_is_deleted():
    tracker = PeakTracker(**BY_FRAMES)
    life, _ = tracker.lifecycle.step(Life(), 1.0, 0, believed=True)
    for hit in (None, True):
        assert tracker.judged(life, 1, BORN, hit, outside=True).status == "deleted"


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


SENSOR = ImageSensor(rows=64, columns=64, psf_sigma=1.0, noise_sigma=1.0)
Target = tuple[float, float, float, float, float]  # x, y, vx, vy, dB


def frames_of(targets: list[Target], frames: int, seed: int, present: Any = None) -> Iterator[np.ndarray]:
    rng = np.random.default_rng(seed)
    for k in range(frames):
        there = targets if present is None or present(k) else []
        states = [[x + vx * k, vx, y + vy * k, vy, SENSOR.intensity_of(db)] for x, y, vx, vy, db in there]
        yield SENSOR.simulate(np.array(states).reshape(-1, 5), rng)


def followed(frames: Any, threshold: float = 6.0, **settings: Any) -> list[FollowedState]:
    """Tracks in frames of SENSOR after each of them."""
    given = {"smoothing": 0.9, "max_velocity": 1.5, "velocity_step": 0.35, "border": "bounded"} | settings
    follower = Follower(RecurrentFilter(**given), PeakTracker(), Footprint.of_point(1.0, 0.1))
    white, rng = WhiteEvidence(SENSOR, 10.0), np.random.default_rng(0)
    state, states = follower.init(rng, 0.0), []
    for k, frame in enumerate(frames, 1):
        given_evidence = None if frame is None else white.evidence(frame)
        state = follower.step(state, float(k), given_evidence, lambda *_: threshold, rng)
        states.append(state)
    return states


def confirmed(state: FollowedState) -> list[Any]:
    return [track for track in state.tracks if track.status == "confirmed"]


def placed(count: int, seed: int = 0, low: float = -1.2, high: float = 1.2) -> list[Target]:
    """Places in the middle of 40 frames, and velocities, drawn at random."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        velocity, middle = rng.uniform(low, high, 2), rng.uniform(28, 36, 2)
        found.append((*(middle - 20 * velocity).tolist(), *velocity.tolist(), 12.0))
    return found


def errors(runs: int) -> np.ndarray:
    """Errors of place and velocity of one target of 12 dB between the filter's velocities, ``(runs, 4)``."""
    found = []
    for seed, target in enumerate(placed(runs)):
        x, y, vx, vy, _ = target
        (track,) = confirmed(followed(frames_of([target], 40, seed))[-1])
        found.append(np.subtract((*track.position, *track.velocity), (x + 39 * vx, y + 39 * vy, vx, vy)))
    return np.array(found)


def test_one_target_is_placed_to_a_fraction_of_a_pixel():
    """A matched filter of 7 deviations places one frame to sqrt(2) / 7 px; 19 frames, with the velocity, to .1."""
    found = errors(12)
    rmse = np.sqrt((found**2).mean(axis=0))
    assert rmse[:2].max() < 0.15
    assert rmse[2:].max() < 0.015
    assert np.abs(found.mean(axis=0))[:2].max() < 4 * 0.1 / math.sqrt(12)


@pytest.mark.thorough
def test_places_and_velocities_are_unbiased():
    found = errors(200)
    bias, error = found.mean(axis=0), found.std(axis=0) / math.sqrt(len(found))
    assert (np.abs(bias) < 4 * error).all()
    assert np.sqrt((found[:, :2] ** 2).mean()) < 0.12


def beside_a_star(runs: int, *, star: bool) -> float:
    """Share of frames from the tenth in which a mover of 10 dB has a confirmed track within 1.5 px."""
    found = []
    for seed, (x, y, vx, vy, _) in enumerate(placed(runs, 3, -0.8, 0.8)):
        targets = [(x, y, vx, vy, 10.0), (40.0, 32.0, 0.0, 0.0, 36.0)]
        for k, state in enumerate(followed(frames_of(targets if star else targets[:1], 40, seed))):
            if k >= 10:
                near = [np.hypot(t.position[0] - x - k * vx, t.position[1] - y - k * vy) for t in confirmed(state)]
                found.append(min(near, default=99.0) < 1.5)
    return float(np.mean(found))


@pytest.mark.thorough
def test_a_star_hides_nothing_but_what_passes_before_it():
    assert beside_a_star(6, star=True) > beside_a_star(6, star=False) - 0.1


@pytest.mark.thorough
def test_a_mover_beside_a_star_is_found_as_without_it():
    assert beside_a_star(60, star=True) > beside_a_star(60, star=False) - 0.05


def test_two_targets_four_pixels_apart_are_two():
    for seed in range(4):
        targets = [(10.0, 12.0, 0.7, 0.3, 12.0), (10.0, 16.0, 0.7, 0.3, 12.0)]
        tracks = confirmed(followed(frames_of(targets, 40, seed))[-1])
        assert len(tracks) == 2
        places = np.array(sorted(track.position for track in tracks))[:, ::1]
        expected = np.array([[37.3, 23.7], [37.3, 27.7]])
        order = np.argsort(places[:, 1])
        np.testing.assert_allclose(places[order], expected, atol=0.6)


def test_targets_that_cross_keep_their_tracks():
    for seed in range(3):
        targets = [(12.0, 32.0, 1.0, 0.0, 12.0), (32.0, 12.0, 0.0, 1.0, 12.0)]
        states = followed(frames_of(targets, 42, seed))
        first = {t.track: t.position for t in confirmed(states[10])}
        last = {t.track: t.position for t in confirmed(states[-1])}
        assert sorted(first) == sorted(last)
        for track, (x, y) in first.items():
            way = np.subtract(last[track], (x, y))
            np.testing.assert_allclose(way, (31, 0) if abs(y - 32) < 2 else (0, 31), atol=1.0)


def test_a_target_is_ended_when_it_has_gone_and_begins_anew_when_it_comes_back():
    states = followed(frames_of([(14.0, 20.0, 0.3, 0.2, 12.0)], 100, 5, present=lambda k: k < 40 or k >= 65))
    ends = next(k for k in range(40, 65) if not confirmed(states[k]))
    assert ends < 50
    assert not any(state.tracks for state in states[ends + 1 : 65])  # nothing of it is left to begin another
    assert len({track.track for state in states[:65] for track in state.tracks}) == 1
    (track,) = confirmed(states[-1])
    assert track.track == 2


def test_a_missing_frame_moves_tracks_on():
    frames: list[Any] = list(frames_of([(14.0, 20.0, 0.5, 0.2, 12.0)], 30, 6))
    frames[20] = frames[21] = None
    states = followed(frames)
    (before,), (after,) = confirmed(states[19]), confirmed(states[21])
    np.testing.assert_allclose(np.subtract(after.position, before.position), np.multiply(2, before.velocity))
    assert (states[21].seen, states[21].frames) == (20, 22)
    assert after.life == before.life


def test_tracks_move_with_the_scene():
    """The camera jumps about by whole pixels: the same tracks, where the scene is."""
    given = list(frames_of([(30.0, 30.0, 0.4, -0.2, 12.0)], 25, 7))
    steps = np.cumsum(np.random.default_rng(1).integers(-2, 3, (25, 2)), axis=0)
    flt = RecurrentFilter(smoothing=0.9, max_velocity=1.0, velocity_step=0.35)
    follower, white = Follower(flt, PeakTracker(), Footprint.of_point(1.0, 0.1)), WhiteEvidence(SENSOR, 10.0)
    rng = np.random.default_rng(0)
    still, moving = follower.init(rng, 0.0), follower.init(rng, 0.0)
    for k, (frame, step) in enumerate(zip(given, steps, strict=True), 1):
        evidence = white.evidence(frame)
        still = follower.step(still, float(k), evidence, lambda *_: 6.0, rng)
        shifted = np.roll(evidence, step[::-1], (0, 1))
        moving = follower.step(moving, float(k), shifted, lambda *_: 6.0, rng, step.tolist())
    (one,), (other,) = confirmed(still), confirmed(moving)
    np.testing.assert_allclose(np.subtract(other.position, steps[-1]) % 64, one.position, atol=1e-3)
    np.testing.assert_allclose(other.velocity, one.velocity, atol=1e-4)


@pytest.mark.parametrize(
    "evidence", [np.full(9, np.nan), np.array([1.0, np.inf]), np.zeros((2, 2, 2)), np.float64(1.0)]
)
def test_bad_evidence_is_refused(evidence):
    follower = Follower(RecurrentFilter(), PeakTracker(), Footprint.of_object(5, 5))
    rng = np.random.default_rng(0)
    with pytest.raises(DataError, match="evidence: must be a finite"):
        follower.step(follower.init(rng, 0.0), 1.0, evidence, lambda *_: 6.0, rng)


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"confirm_frames": 0}, "confirm_frames: must be greater than or equal to 1"),
        ({"confirm_risk": 0.0}, "confirm_risk: must be greater than 0"),
        ({"confirm_risk": 1.5}, "confirm_risk: must be less than or equal to 1"),
        ({"miss_frames": 0}, "miss_frames"),
        ({"deletion_frames": 0.5}, "deletion_frames"),
        ({"miss_frame": 3}, "did you mean 'miss_frames'"),
    ],
)
def test_parameters_out_of_bounds_are_refused(settings, sentence):
    with pytest.raises(ParameterError, match=sentence):
        PeakTracker(**settings)
