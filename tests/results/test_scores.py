"""Scores of a log are those of the metrics on the whole recording at once, whatever its length."""

import json
import math

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.metrics import clear_mot, gospa, identity, ospa, sightings, sightings_of
from elusive.results import TrackLog, score, scored
from elusive.tracking import Step, Track


def made(steps, seed=2, offset=0.5):
    """Two targets on paths, tracks near them that change hands, and a stray one."""
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.normal(0, 0.2, (steps, 2, 2)), axis=0) + np.array([[0, 0], [50, 0]])
    truth[: steps // 3, 1] = np.nan
    log = TrackLog(("x", "vx", "y", "vy"), "m")
    for k in range(steps):
        tracks = []
        for target in range(2):
            if np.isfinite(truth[k, target, 0]) and rng.random() < 0.9:
                x, y = truth[k, target] + rng.normal(0, offset, 2)
                tracks.append(Track(1 + target + 2 * (k // 40), "confirmed", 0.9, np.array([x, 0, y, 0]), np.eye(4)))
        if k % 7 == 0:
            tracks.append(Track(10_000, "confirmed", 0.9, np.array([500.0, 0, 0, 0]), np.eye(4)))
        tracks.append(Track(10_001, "candidate", 0.9, np.array([-500.0, 0, 0, 0]), np.eye(4)))
        log.append(Step(float(k), None, None, tuple(tracks)))
    return log, truth


def test_a_long_recording_is_scored_as_a_whole():
    log, truth = made(2500)
    found = score(log, truth, 2.0)
    rows = log.rows[log.rows["status"] == 1]
    true, tracks = sightings_of(truth), sightings(rows["step"], rows["track"], rows["position"])
    mot, same = clear_mot(true, tracks, 2.0, 2500), identity(true, tracks, 2.0)
    assert (found.misses, found.false, found.mismatches) == (
        mot.misses.sum(), mot.false_positives.sum(), mot.mismatches.sum(),
    )  # fmt: skip
    assert found.mota == pytest.approx(mot.mota)
    assert found.motp == pytest.approx(mot.motp)
    assert found.greatest == pytest.approx(mot.max_deviation)
    assert found.rmse == pytest.approx(math.sqrt(np.mean(mot.deviations**2)))
    assert found.identity == same
    assert found.ospa == pytest.approx(ospa(true, tracks, 2.0, 2.0, 2500).mean())
    whole = gospa(true, tracks, 2.0, 2.0, 2500)
    np.testing.assert_allclose(found.gospa, whole)
    assert found.mean_gospa == pytest.approx(whole.distance.mean())
    total, *parts = found.rms_gospa.values()
    assert total**2 == pytest.approx(np.mean(whole.distance**2)) == pytest.approx(np.square(parts).sum())
    assert found.strays == 1
    assert score(log, truth, 2.0, ("confirmed", "candidate")).strays == 2
    assert dict(found.lines())["Tracks that never met a target"] == "1"


def test_the_covariance_is_judged_by_the_pairs():
    """Tracks drawn from their own Gaussian about the truth: chi-square of two degrees, across the pieces scored."""
    rng, steps = np.random.default_rng(5), 1500
    covariance = np.array([[0.3, 0, 0.1, 0], [0, 1, 0, 0], [0.1, 0, 0.2, 0], [0, 0, 0, 1]])
    truth, log = rng.normal(0, 5, (steps, 2, 2)) + np.array([[0, 0], [100, 0]]), TrackLog(("x", "vx", "y", "vy"), "m")
    off = rng.multivariate_normal(np.zeros(4), covariance, (steps, 2))
    for k in range(steps):
        tracks = []
        for target in (1, 0):
            mean = off[k, target] + np.insert(truth[k, target], [1, 2], 0.0)
            tracks.append(Track(9 - target, "confirmed", 1.0, mean, covariance * (1 + 3 * target)))
        tracks.append(Track(20 + k, "confirmed", 1.0, np.array([1e3, 0, 0, 0]), np.full((4, 4), np.nan)))
        log.append(Step(float(k), None, None, tuple(tracks)))
    found = score(log, truth, 9.0)
    at = np.ix_([0, 2], [0, 2])
    each = np.einsum("kti,ij,ktj->kt", off[..., [0, 2]], np.linalg.inv(covariance[at]), off[..., [0, 2]]) / [1, 4]
    assert found.nees == pytest.approx(each.mean())
    assert found.held == pytest.approx(np.mean(each <= 5.991), abs=1e-3)
    assert found.nees == pytest.approx(2 * (1 + 1 / 4) / 2, abs=4 * 2 / math.sqrt(2 * steps))
    assert dict(found.lines())["NEES"].startswith(f"{found.nees:.2f}, 2 if the deviations are right")


def test_a_place_told_without_any_deviation_is_not_judged():
    truth = np.full((3, 1, 2), 0.5)
    log = TrackLog(("x", "vx", "y", "vy"), "m")
    for k, covariance in enumerate((np.eye(4), np.zeros((4, 4)), np.ones((4, 4)) + 1e-18 * np.eye(4))):
        log.append(Step(float(k), None, None, (Track(1, "confirmed", 0.9, np.zeros(4), covariance),)))
    assert score(log, truth, 2.0).nees == pytest.approx(0.5)


def test_confirmed_tracks_and_candidates_are_written(tmp_path):
    log, truth = made(60)
    found = scored(log, truth, 2.0)
    assert found.candidates_too.false > found.confirmed.false
    found.write(tmp_path)
    told = json.loads((tmp_path / "scores.json").read_text())
    assert (told["unit"], told["cutoff"], told["order"]) == ("m", 2.0, 2.0)
    assert told["confirmed"] == pytest.approx(found.confirmed.numbers)
    table = np.genfromtxt(tmp_path / "scores.csv", delimiter=",", names=True)
    assert table.dtype.names == ("time_s", "gospa", "localisation", "missed", "false")
    np.testing.assert_allclose(table["gospa"], found.confirmed.gospa.distance)


def test_on_a_ring_the_way_is_the_shorter_one():
    log = TrackLog(("x", "vx"), "samples")
    for k in range(5):
        log.append(Step(float(k), None, None, (Track(1, "confirmed", 0.9, np.array([599.5, 0.0]), np.eye(2)),)))
    truth = np.full((5, 1, 1), 1.5)
    assert score(log, truth, 5.0).misses == 5
    found = score(log, truth, 5.0, period=600.0)
    assert found.misses == 0
    assert found.rmse == pytest.approx(2.0, rel=(5 / 600) ** 2)


def test_nothing_to_score_is_said():
    empty = TrackLog(("x", "vx", "y", "vy"), "px")
    found = score(empty, np.empty((0, 1, 2)), 4.0)
    assert math.isnan(found.mota)
    assert json.loads(scored(empty, np.empty((0, 1, 2)), 4.0).text)["confirmed"]["gospa"] is None
    assert dict(found.lines())["Error there"] == "no target is found"
    with pytest.raises(DataError, match=r"truth: has shape \(3, 1, 2\) for 0 steps of 2 axes"):
        score(empty, np.zeros((3, 1, 2)), 4.0)
