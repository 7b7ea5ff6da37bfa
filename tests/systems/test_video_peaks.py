"""A slow strong ship is told at its echo's peak, though its cells are fixed; beside a rock a ship stays where it is."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.io.radar_video import open_radar_video
from elusive.io.radar_video_arrays import write_radar_video_arrays
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.peaks import at_peaks, peaks_after, told, told_by
from elusive.systems.video.sea import Sea, SeaState, Still, VideoRadar, cell_places, turns
from elusive.systems.video.track import track_video_recording
from elusive.tracking.track import Track
from tests.longer import longer
from tests.reference.radar_video import level_sea


@pytest.mark.thorough
def test_a_slow_strong_ship_is_told_where_it_is(tmp_path):
    """It was told 40 m ahead, where its echo comes on: all of the rest was fixed."""
    radar = VideoRadar(spokes=512, samples=160, step_m=12.5, pulse_m=25.0, beam_deg=2.0, start_m=300.0)
    sea = Sea(radar, SeaState(shape=1.0), Still(np.zeros(cell_places(radar).shape[:2])))
    ship = np.array([-900.0, 2.2, 800.0, 1.2])
    path = tmp_path / "video.npz"
    write_radar_video_arrays(path, turns(sea, 30, ship[None], np.array([38.0]), np.random.default_rng(7)))
    outcome = track_video_recording(open_radar_video(path), VideoTracking(), None)
    (track,) = outcome.tracked.paths
    off = np.hypot(*(track.places - ship[[0, 2]] - track.times_s[:, None] * ship[[1, 3]]).T)
    assert len(off) > 12
    assert np.quantile(off[-12:], 0.9) < 12.5  # a cell
    np.testing.assert_allclose(track.velocity[-1], ship[[1, 3]], atol=1.0)


TURNS = 12


def followed(bend, deviation_m, rng):
    """A track by peaks that scatter about a way, and where it truly is then."""
    times = 2.5 * np.arange(TURNS)
    east, north = 900 + 5.0 * times, 1200 - 0.5 * bend * (times - 15) ** 2
    way, cell, echo = np.column_stack([east, north]), 12.5**2 * np.eye(2), None
    for time_s, place, own in zip(times, way + rng.normal(0, deviation_m, way.shape), way, strict=True):
        echo = told_by(echo, time_s, place, own, cell)
    track = Track(1, "confirmed", 1.0, np.array([east[-1] + 40.0, 2.5, north[-1], 0.0]), 100 * np.eye(4))
    truth = np.array([east[-1], 5.0, north[-1], -bend * (times[-1] - 15)])
    return told(track, echo, times[-1], cell), truth


@pytest.mark.parametrize(
    ("bend", "deviation_m"),
    longer(
        [(0.0, 5.0), (0.0, 1.0), (0.02, 5.0), (0.05, 5.0), (0.3, 5.0), (0.3, 1.0)],
        (0.0, 5.0),
        (0.0, 1.0),
        (0.02, 5.0),
        (0.3, 5.0),
        (0.3, 1.0),
    ),
)
def test_a_track_is_as_far_off_as_it_says(bend, deviation_m):
    """Squares of errors in deviations told are 2 in the mean, or less: a cell's width is added to what scatters."""
    rng, squares, of_velocity = np.random.default_rng(5), [], []
    for _ in range(200):
        shown, truth = followed(bend, deviation_m, rng)
        for which, found in (([0, 2], squares), ([1, 3], of_velocity)):
            off = (shown.mean - truth)[which]
            found.append(off @ np.linalg.solve(shown.covariance[np.ix_(which, which)], off))
    assert np.mean(squares) < 2 + 4 * np.sqrt(4 / 200)
    assert np.mean(of_velocity) < 2 + 4 * np.sqrt(4 / 200)  # also where it hardly shows whether it turns
    assert np.mean(squares) > 2 * deviation_m**2 / (2 * deviation_m**2 + 12.5**2) / 2


@pytest.mark.parametrize(("shown", "kept"), [(0.0, False), (20.0, True)])
def test_a_track_that_its_own_cells_show_is_not_drawn_to_what_sails_along_it(shown, kept):
    """A coast's peak goes along with a ship beside it: tracks known to 8 m were told 100 to 250 m off, and sure."""
    rng, cell, echo = np.random.default_rng(8), 12.5**2 * np.eye(2), None
    for k in range(TURNS):
        at = np.array([900 + 12.5 * k, 1200.0])
        peak = at + rng.normal((0.0, 60.0), 5.0)
        echo = told_by(echo, 2.5 * k, peak, at, cell, shown=shown)
    ship = Track(1, "confirmed", 1.0, np.array([at[0], 5.0, at[1], 0.0]), np.diag([36.0, 0.25, 36.0, 0.25]))
    found = told(ship, echo, 2.5 * (TURNS - 1), cell)
    assert (abs(found.mean[2] - at[1]) < 1.0) == kept


@pytest.mark.parametrize("speed_mps", [0.0, 2.5])
def test_only_a_peak_that_sails_tells_where_a_track_is(speed_mps):
    sensor, rng, ways = RadarVideo(step_m=12.5, samples=200, beam_deg=2.0), np.random.default_rng(3), None
    (first, step, pitch), shape = sensor.grid, sensor.shape
    row, column = np.indices(shape)
    for k in range(TURNS):
        time_s, range_m = 2.5 * k, 1500.0 + speed_mps * 2.5 * k
        at = (range_m - first) / step
        echo = 3000 * np.exp(-(((row - 89) ** 2 + (column - at) ** 2) / 2.0))
        power = (1 + echo * rng.gamma(4.0, 0.25) + rng.exponential(size=shape)).astype(np.float32)
        own = np.array([1540.0 + 2.5 * time_s, 2.5, 0.0, 0.0])
        nothing = rng.exponential(size=shape).astype(np.float32)  # against what is fixed
        turn = EvidenceTurn(time_s, np.full(len(power), time_s), nothing, (0.0, 0.0), power, power, level_sea(power))
        tracks = (Track(1, "confirmed", 1.0, own, np.eye(4)),)
        ways = peaks_after(ways, tracks, turn, sensor, 1.0)
        (shown,) = at_peaks(tracks, ways, turn, sensor)
    azimuth = 90 * pitch
    if speed_mps:
        np.testing.assert_allclose(shown.mean[[0, 2]], range_m * np.array([np.sin(azimuth), np.cos(azimuth)]), atol=6.0)
        np.testing.assert_allclose(shown.mean[[1, 3]], [2.5, 0.0], atol=0.5)
    else:
        np.testing.assert_array_equal(shown.mean, own)
        assert np.sqrt(shown.covariance[0, 0]) > 10.0  # of the 1 m told: it goes away from every peak
        assert 2.0 < np.sqrt(shown.covariance[1, 1]) < 3.0
