"""Echoes of a strong ship's echo are named, and no ships; a ship that sails near one is left as it is."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.io.radar_video import open_radar_video
from elusive.io.radar_video_arrays import write_radar_video_arrays
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.sea import Sea, SeaState, Still, VideoRadar, cell_places, turns
from elusive.systems.video.track import track_video_recording

ACROSS, INWARD = np.array([-900.0, 8.0, 500.0, 5.0]), np.array([-1300.0, 14.0, 600.0, -3.0])
ASIDE = INWARD[[2, 3, 0, 1]] * [1, 1, -1, -1]  # a quarter of a turn further on


@pytest.mark.parametrize(
    ("ship", "other", "ghost"),
    [
        (ACROSS, 2 * ACROSS, True),
        pytest.param(INWARD, ASIDE, True, marks=pytest.mark.thorough),
        (ACROSS, np.array([-1200.0, 9.0, 900.0, 3.0]), False),
    ],
)
def test_an_echo_of_an_echo_is_named_and_no_ship(tmp_path, ship, other, ghost):
    """It was a sure track to the end, and nothing said so."""
    radar = VideoRadar(spokes=360, samples=120, step_m=20.0, pulse_m=40.0, beam_deg=3.0, start_m=200.0)
    sea = Sea(radar, SeaState(), Still(np.zeros(cell_places(radar).shape[:2])))
    rng = np.random.default_rng(3)
    path = tmp_path / "video.npz"
    write_radar_video_arrays(path, turns(sea, 18, np.array([ship, other]), np.array([28.0, 16.0]), rng))
    outcome = track_video_recording(open_radar_video(path), VideoTracking(), None)
    now = [one[[0, 2]] + outcome.tracked.times_s[-1] * one[[1, 3]] for one in (ship, other)]
    sure = [
        min(range(2), key=lambda k: np.hypot(*(one.places[-1] - now[k])))
        for one in outcome.tracked.paths
        if one.confirmed[-1]
    ]
    assert sorted(sure) == ([0] if ghost else [0, 1])
    finding = next(one for one in outcome.findings if one.name == "video.ghosts")
    assert (finding.holds, finding.seen) == (not ghost, ghost)


@pytest.mark.parametrize("ghost", [True, False])
def test_behind_a_ship_that_comes_straight_is_an_echo_of_its_echo_or_one_in_its_company(tmp_path, ghost):
    """Both keep to it; an echo of its echo is as strong as that is, turn by turn. It was a sure track to the end."""
    radar = VideoRadar(spokes=360, samples=120, step_m=20.0, pulse_m=40.0, beam_deg=3.0, start_m=200.0)
    sea = Sea(radar, SeaState(swerling=0), Still(np.zeros(cell_places(radar).shape[:2])))
    rng, way = np.random.default_rng(2), np.array([0.6, 0.8])
    ships = np.array([[far * way[0], -11 * way[0], far * way[1], -11 * way[1]] for far in (1500.0, 1780.0)])
    parts = []
    for turn in range(22):
        power, now = rng.exponential(size=2), ships.copy()
        now[:, 0::2] += 2.5 * turn * ships[:, 1::2]
        level = np.array([30.0, 20.0]) + 10 * np.log10(power[[0, 0]] if ghost else power)
        parts.append(sea.turn(2.5 * turn, now, level, rng))
    path = tmp_path / "video.npz"
    write_radar_video_arrays(path, parts)
    outcome = track_video_recording(open_radar_video(path), VideoTracking(), None)
    last = {bool(one.confirmed[-1]): one for one in outcome.tracked.paths}
    assert len(outcome.tracked.paths) == 2
    assert set(last) == ({True, False} if ghost else {True})
    if ghost:
        assert last[False].existence[-1] <= 0.5
        assert np.hypot(*last[False].places[-1]) > np.hypot(*last[True].places[-1])
