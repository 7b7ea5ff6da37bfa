"""Tracks of a recorded log given what came later: nearer, and no surer than they are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from elusive.cli import main
from elusive.motion.walk import Walk
from elusive.systems.links.smoothed import track_smoothed
from elusive.systems.links.track import LinkTracking, track
from tests.systems.links.test_radio_log_people import DATA, EMPTY, recorded
from tests.walked_room import EMPTY as ROOM_EMPTY
from tests.walked_room import write_room


@pytest.mark.parametrize("interval_s", [0.1, 1.0, 4.0])
def test_moments_of_the_walk_are_those_of_its_draws(interval_s):
    """From a velocity as it is in the long run; within four standard errors."""
    walk, rng, n = Walk(), np.random.default_rng(0), 50_000
    spread = walk.speed_sd_mps**2 + walk.straight_q / walk.turn_rate_hz
    before = np.zeros((n, 4))
    before[:, [1, 3]] = np.sqrt(spread) * rng.standard_normal((n, 2))
    after = walk.propagate(before, interval_s, rng)
    F, Q = walk.moments(interval_s)
    rest = after - before @ F.T
    error = np.sqrt(np.mean((rest[:, :, None] * rest[:, None, :]) ** 2, axis=0) / n)
    assert (np.abs(rest.T @ rest / n - Q) <= 4 * error + 1e-12).all()
    assert (np.abs(rest.mean(axis=0)) <= 4 * rest.std(axis=0) / np.sqrt(n) + 1e-12).all()


@pytest.mark.thorough
@pytest.mark.skipif(not DATA.exists(), reason=f"needs the radio log under {DATA}")
@pytest.mark.parametrize("every", [6, 1])
def test_a_recorded_walker_is_nearer_and_ellipses_hold_as_before(every):
    nodes, log, truth = recorded()
    kept = [k for k in range(len(log)) if k < EMPTY or k % every == 0]
    frames, places = [log[k] for k in kept], truth[kept]
    errors, held = {}, {}
    for follow in (track, track_smoothed):
        away = [
            (one.mean[[0, 2]] - place, one.covariance[np.ix_([0, 2], [0, 2])])
            for step, place in zip(follow(frames, nodes, LinkTracking(calibration_frames=EMPTY)), places, strict=True)
            for one in step.tracks
            if one.status == "confirmed" and np.isfinite(place[0])
        ]
        errors[follow] = np.mean([np.linalg.norm(off) for off, _ in away])
        held[follow] = np.mean([off @ np.linalg.solve(wide, off) < chi2.ppf(0.95, 2) for off, wide in away])
    assert errors[track_smoothed] < 0.98 * errors[track]
    assert errors[track_smoothed] <= 0.7
    assert 0.9 <= held[track_smoothed] <= 0.97


def test_the_command_smooths_files_and_refuses_what_comes_once(tmp_path, capsys):
    room = write_room(tmp_path)
    asked = ["--nodes", room / "nodes.csv", "--calibration-frames", ROOM_EMPTY, "--fit-frames", 0, "--smooth"]

    def ended(*more):
        with pytest.raises(SystemExit) as stop:
            main([str(word) for word in ("track", "links", *more, *asked)])
        return stop.value.code or 0

    assert ended(room / "log.csv", "--out", tmp_path / "out") == 0
    assert "smooth: true" in (tmp_path / "out" / "config.yaml").read_text()
    assert ",confirmed," in (tmp_path / "out" / "tracks.csv").read_text()
    assert ended(room / "log.csv", "--follow", "--idle-s", 1, "--out", tmp_path / "live") == 2
    assert "cannot know what comes later" in " ".join(capsys.readouterr().err.split())
    assert ended(room / "log.csv", "--method", "image", "--out", tmp_path / "image") == 2
    assert "smooth" in capsys.readouterr().err
