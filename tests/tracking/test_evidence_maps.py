"""Targets in maps of evidence: Bayes in a closed form, one that is found, none in noise, a chart that counts once."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import Beginnings, EvidenceSensor, Looked
from elusive.errors import DataError
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.tracking.evidence_maps import EvidenceTracker
from tests.reference.radar_video import level_sea

RADAR = RadarVideo(beam_deg=6.0, pulse_m=50.0, start_m=100.0, step_m=25.0, samples=120)


class Told:
    """A user's own sensor: each look says as much, and begins one target in all."""

    ratios = np.array([4.0])

    def __init__(self, ratios, dense=0.0):
        self.said, self.dense = ratios, dense

    def arrival_s(self, places, measurement):
        return np.full(len(places), float(measurement))

    def density(self, places, measurement):
        return np.full(len(places), self.dense)

    def look(self, mean, covariance, levels, background, existence, number, measurement, gate):
        said = np.full(len(mean), np.log(self.said[measurement]))
        return Looked(
            mean, covariance, levels, background + np.array([measurement, 1.0]), said, np.zeros((1, 1), np.float32)
        )

    def beginnings(self, measurement, looked, least, most):
        n = int(measurement == 0)
        return Beginnings(
            np.zeros((n, 2)), np.tile(np.eye(2), (n, 1, 1)), np.zeros(n), np.full((n, 1), 30.0), 0.01, np.array([0.5])
        )


class Shore:
    """Half of what is asked for is water, at every place."""

    def log_probability(self, states):
        return np.full(len(states), np.log(0.5))


@pytest.mark.parametrize("parts", [1, 7])
def test_existence_is_bayes(parts):
    """Of parts together: they exclude each other."""
    said = [1.0, 5.0, 0.3, 80.0]
    assert isinstance(Told(said), EvidenceSensor)
    tracker = EvidenceTracker(sensor=Told(said), velocity_parts=parts, mean_life_s=50.0, targets_first=2.0, q=0.0)
    rng = np.random.default_rng(0)
    state, odds = tracker.init(rng), 2.0 * 0.01 * 30.0
    for number in range(4):
        state = tracker.step(state, float(number), number, rng)
        if number:
            there = odds / (1 + odds) * np.exp(-1 / 50)
            odds = there / (1 - there) * said[number]
        np.testing.assert_allclose(state.targets.existence.sum(), odds / (1 + odds), rtol=1e-12)
        assert len(set(state.targets.number.tolist())) == 1
    np.testing.assert_allclose(state.targets.background, [[6.0, 3.0]] * parts)  # what the sensor gave of three looks
    np.testing.assert_allclose(state.targets.whole().background, [[6.0, 3.0]])


def test_what_a_chart_says_counts_once():
    rng = np.random.default_rng(0)
    found = []
    for known in ((), (Shore(),)):
        tracker = EvidenceTracker(sensor=Told([1.0] * 6), knowledge=known, mean_life_s=1e12)
        state = tracker.init(rng)
        for number in range(6):
            state = tracker.step(state, float(number), number, rng)
        found.append(state.targets.existence.sum())
    odds = [one / (1 - one) for one in found]
    assert odds[1] / odds[0] == pytest.approx(0.5)


def test_without_a_measurement_it_predicts_and_time_goes_forwards():
    rng = np.random.default_rng(0)
    tracker = EvidenceTracker(sensor=Told([1.0] * 3), velocity_parts=1, speed_sd_mps=3.0, q=0.0)
    state = tracker.step(tracker.init(rng), 0.0, 0, rng)
    state = tracker.step(state, 10.0, None, rng)
    np.testing.assert_allclose(state.targets.covariance[0, 0, 0], 1 + 900)
    with pytest.raises(DataError, match="comes after"):
        tracker.step(state, 5.0, None, rng)


def sailed(ships, db, turns, seed, **rules):
    """Tracks of each turn of maps in which ships shine through exponential noise."""
    rng = np.random.default_rng(seed)
    tracker = EvidenceTracker(sensor=RADAR, **rules)
    state, period, seen = tracker.init(rng), 2.5, []
    rows = RADAR.shape[0]
    for number in range(turns):
        row_s = period * (number + np.arange(rows) / rows)
        evidence = rng.exponential(size=RADAR.shape)
        for x, vx, y, vy in ships:
            for _ in range(2):
                row = int(np.round(np.arctan2(x, y) / (2 * np.pi / rows) - 1)) % rows
                x, y = (x, y) if _ else (x + vx * row_s[row], y + vy * row_s[row])
            column = int(np.round((np.hypot(x, y) - RADAR.range_m[0]) / RADAR.cell_m))
            evidence[row, column] = rng.exponential(1 + 10 ** (db / 10))
        time_s = period * (number + 1)
        ones = np.ones(RADAR.shape, np.float32)
        turn = EvidenceTurn(
            time_s, row_s, evidence.astype(np.float32), (0.0, 0.0), ones, ones, level_sea(ones)
        )  # fmt: skip
        state = tracker.step(state, time_s, turn, rng)
        seen.append((time_s, state))
    return seen


def test_a_faint_ship_is_found_where_it_is():
    ship = (-900.0, 9.0, 1500.0, -2.0)
    for seed in range(2):
        time_s, state = sailed([ship], 9.0, 40, seed)[-1]
        truth = np.array([ship[0] + time_s * ship[1], ship[1], ship[2] + time_s * ship[3], ship[3]])
        # one recording in fifteen may have a track of noise, of these odds (Ville's inequality)
        sure = [
            track
            for track in state.tracks
            if track.status == "confirmed" and np.abs(track.mean - truth)[::2].max() < 500
        ]
        assert len(sure) == 1, seed
        off = sure[0].mean - truth
        assert off @ np.linalg.solve(sure[0].covariance, off) < 30, seed


def test_noise_holds_no_ship():
    for seed in range(2):
        for _, state in sailed([], 0.0, 40, seed):
            assert not [track for track in state.tracks if track.status == "confirmed"], seed


def test_what_does_not_move_is_told_and_not_confirmed():
    seen = sailed([(-900.0, 0.0, 1500.0, 0.0)], 20.0, 25, 1)
    tracks = [track for track in seen[-1][1].tracks if track.status != "deleted"]
    assert [track.status for track in tracks] == ["candidate"]
    assert tracks[0].existence > 0.99
    assert tracks[0].extra["moves"] < 3


def test_a_track_that_ends_is_told_once():
    rng = np.random.default_rng(0)
    tracker = EvidenceTracker(sensor=Told([1.0, 1e4, 1e4, 1e-9, 1.0]), velocity_parts=1)
    state, told = tracker.init(rng), []
    for number in range(5):
        state = tracker.step(state, float(number), number, rng)
        told.append([track.status for track in state.tracks])
    assert told == [[], ["candidate"], ["candidate"], ["deleted"], []]


def test_what_is_given_up_is_looked_for_again():
    """Targets that are there and unknown are as many as Bayes has it: those of a cell given up are among them again.

    It is when no denser than they are: of odds .6 / 1000, over a variance of 1 m^2 and that of 1 s at 8 m/s.
    """
    rules = {"velocity_parts": 1, "mean_life_s": 1e12, "births_per_h": 1e-9, "targets_first": 2.0, "q": 0.0}
    odds, given = 0.6e-3, 0.6e-3 / (1 + 0.6e-3)
    alike = given / (2 * np.pi * (1 + 8.0**2))  # density [1 / m^2] of one target in view, which are 1
    for dense, left in ((0.99 * alike, 1), (1.01 * alike, 0)):
        rng = np.random.default_rng(0)
        tracker = EvidenceTracker(sensor=Told([1.0, 1e-3], dense), **rules)
        state = tracker.step(tracker.init(rng), 0.0, 0, rng)
        np.testing.assert_allclose(state.unseen, [1.0])
        state = tracker.step(state, 1.0, 1, rng)
        assert len(state.targets.existence) == left
        np.testing.assert_allclose(state.unseen, [0.5 + (1 - left) * odds / (1 + odds)], rtol=1e-9)


def test_parts_of_velocity_are_one_target():
    """Together they exist as one does, and spread as it does, to the rounding of where they lie."""
    rng, begun = np.random.default_rng(0), []
    for count in (1, 7):
        tracker = EvidenceTracker(sensor=Told([1.0]), velocity_parts=count)
        begun.append(tracker.step(tracker.init(rng), 0.0, 0, rng).targets)
    one, parts = begun
    assert parts.existence.sum() == pytest.approx(one.existence[0])
    whole = parts.whole()
    np.testing.assert_allclose(whole.covariance[0], one.covariance[0], atol=0.005 * one.covariance.max())
    weights = parts.existence / parts.existence.sum()
    mean = weights @ parts.mean
    off = parts.mean - mean
    spread = np.einsum("t,tij->ij", weights, parts.covariance + off[:, :, None] * off[:, None])
    np.testing.assert_allclose(mean, one.mean[0], atol=1e-12)
    np.testing.assert_allclose(spread, one.covariance[0], atol=0.005 * spread.max())


def test_a_strong_ship_is_one_track_from_its_first_echo_on():
    """Its seven velocities were a sure track each until they were told apart, of which only one was a ship's."""
    ship = (-900.0, 9.0, 1500.0, -2.0)
    for seed in range(4):
        for number, (time_s, state) in enumerate(sailed([ship], 20.0, 6, seed)):
            place = np.array([ship[0] + time_s * ship[1], ship[2] + time_s * ship[3]])
            near = [t for t in state.tracks if t.status != "deleted" and np.hypot(*(t.mean[[0, 2]] - place)) < 500]
            assert len(near) == 1 or (number == 0 and not near), (seed, number)


def test_another_target_in_the_same_place_adds_its_odds():
    """A part of odds 2 to no target, and another target of odds 1 to none, in one place: 2 + 1, beside a part of 1."""
    tracker = EvidenceTracker(sensor=Told([1.0]), velocity_parts=1)
    begun = tracker.step(tracker.init(np.random.default_rng(0)), 0.0, 0, np.random.default_rng(0)).targets
    three = begun.kept(np.zeros(3, np.int64))._replace(
        existence=np.array([0.5, 0.25, 0.5]),
        number=np.array([1, 1, 2]),
        mean=np.array([np.zeros(4), [900.0, 0, 0, 0], np.zeros(4)]),
    )
    left = tracker._without_doubles(three)
    assert left.number.tolist() == [1, 1]
    np.testing.assert_allclose(left.existence, np.array([0.5 + 0.25, 0.25]) / 1.25)
