"""A long ship is one track in the middle of its echo; two ships are two; what goes nowhere is no ship under way."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.io.radar_video import open_radar_video
from elusive.io.radar_video_arrays import write_radar_video_arrays
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.systems.video.echoes import MOST_CELLS, POINTLIKE, echo_at, sea_deviation
from elusive.systems.video.hulls import as_ships, hulls_after
from elusive.systems.video.long_echoes import NOTHING, with_middles
from elusive.systems.video.moved import moved_after, without_still
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.sea import Sea, SeaState, Still, VideoRadar, cell_places, turns
from elusive.systems.video.track import track_video_recording
from elusive.tracking.track import Track
from tests.longer import longer
from tests.reference.radar_video import level_sea

SENSOR = RadarVideo(step_m=12.5, samples=200, beam_deg=2.0)
TOP = 90  # row whose middle is north and a quarter of a turn


def turn_of(power, time_s=0.0):
    """Return a turn of power over a sea of 1."""
    power = power.astype(np.float32)
    return EvidenceTurn(time_s, np.full(len(power), time_s), power, (0.0, 0.0), power, power, level_sea(power))


def points(places, powers):
    """Power of echoes of points at columns of the row that looks east."""
    row, column = np.indices(SENSOR.shape)
    echo = sum(
        p * np.exp(-((row - TOP + 1) ** 2 + (column - c) ** 2) / 1.44) for c, p in zip(places, powers, strict=True)
    )
    return 1.0 + echo


def track(number, column, status="confirmed", existence=1.0):
    azimuth = TOP * SENSOR.grid[2]
    far = SENSOR.grid[0] + column * SENSOR.grid[1]
    mean = np.array([far * np.sin(azimuth), 0.0, far * np.cos(azimuth), 0.0])
    return Track(number, status, existence, mean, np.diag([25.0, 1.0, 25.0, 1.0]))


def test_an_echo_of_a_point_is_at_its_peak_and_a_long_one_at_its_middle():
    point = echo_at(turn_of(points([60.3], [1000.0])), SENSOR, TOP, 62, 1.0)
    np.testing.assert_allclose(np.hypot(*point.at), SENSOR.grid[0] + 60.3 * SENSOR.grid[1], atol=0.1 * SENSOR.grid[1])
    np.testing.assert_array_equal(point.reach, POINTLIKE)
    long = echo_at(turn_of(points(np.arange(50, 71), np.full(21, 1000.0))), SENSOR, TOP, 52, 1.0)
    np.testing.assert_allclose(np.hypot(*long.at), SENSOR.grid[0] + 60 * SENSOR.grid[1], atol=0.1 * SENSOR.grid[1])
    out = long.at / np.hypot(*long.at)
    far = np.sqrt(out @ long.reach @ out) / SENSOR.grid[1]  # an even echo of n cells: its deviation is n / sqrt(12)
    assert 20 / np.sqrt(12) < far < 26 / np.sqrt(12)


def test_the_middle_of_a_long_echo_is_steadier_than_its_peak():
    """Nine places whose power is drawn anew in each turn: the peak is any of them."""
    rng, off = np.random.default_rng(1), []
    for _ in range(60):
        power = points(np.linspace(48, 72, 9), 3000 * rng.exponential(size=9))
        off.append(np.hypot(*echo_at(turn_of(power), SENSOR, TOP, 60, 1.0).at) - SENSOR.grid[0] - 60 * SENSOR.grid[1])
    assert np.std(off) < 0.4 * 24 / np.sqrt(12) * SENSOR.grid[1]  # of what an even choice among the places scatters


def test_of_a_long_echo_only_the_middle_stands_out():
    """Whatever parts of it come and go; a point, the sea's own spots and a coast stay as they are."""
    rng, off = np.random.default_rng(6), []
    for _ in range(20):
        power = points(np.arange(48, 73), 3000 * rng.exponential(size=25)) - 1 + rng.exponential(size=SENSOR.shape)
        turn = turn_of(power)
        told = with_middles(turn, SENSOR, sea_deviation(turn)).evidence
        hull = told[TOP - 2 : TOP + 1, 48:73]
        row, column = np.unravel_index(hull.argmax(), hull.shape)
        off.append([row - 1, column - 12])
        assert np.delete(hull, np.arange(column - 2, column + 3), axis=1).max() <= NOTHING
        np.testing.assert_array_equal(told[: TOP - 15], turn.evidence[: TOP - 15])
    assert np.abs(off).max() <= 2  # the cells about a middle that are told
    for places in ([60.0], np.arange(20, 101)):
        turn = turn_of(points(places, np.full(len(places), 3000.0)) * rng.exponential(size=SENSOR.shape))
        assert with_middles(turn, SENSOR, sea_deviation(turn)) is turn


def test_what_reaches_further_than_a_ship_is_no_ships_middle():
    coast = echo_at(turn_of(points(np.arange(20, 101), np.full(81, 1000.0))), SENSOR, TOP, 60, 1.0)
    np.testing.assert_array_equal(coast.reach, POINTLIKE)


@pytest.mark.parametrize(("between", "slope"), [(True, 1.0), (False, 1.0), (True, 0.3), (False, 0.3)])
def test_tracks_between_whom_the_echo_goes_on_are_one_ship(between, slope):
    """Whatever a receiver makes of power: ``slope`` 1, or nearly its logarithm."""
    rng, hulls, told = np.random.default_rng(2), None, []
    places = np.linspace(50, 62, 7) if between else np.array([50.0, 62.0])
    for k in range(12):
        moved = places + 2 * k
        tracks = (track(3, 50 + 2 * k), track(7, 62 + 2 * k))
        power = points(moved, 1000 * rng.exponential(size=len(moved))) * rng.exponential(size=SENSOR.shape)
        turn = turn_of(power**slope, 2.5 * k)
        hulls = hulls_after(hulls, tracks, turn, SENSOR, sea_deviation(turn))
        told.append(as_ships(tracks, hulls))
    assert [[(one.track, one.status) for one in some] for some in told[:2]] == 2 * [
        [(3, "confirmed"), (7, "confirmed")]
    ]
    if not between:
        assert all(len(some) == 2 for some in told)
        return
    ends = [some for some in told if any(one.status == "deleted" for one in some)]
    assert [[(one.track, one.status) for one in some] for some in ends] == [[(3, "confirmed"), (7, "deleted")]]
    assert [one.track for one in told[-1]] == [3]
    alone = (track(7, 72),)  # the other part is lost: the ship keeps its number
    hulls = hulls_after(hulls, alone, turn_of(points(places + 22, np.full(7, 1000.0)), 30.0), SENSOR, 1.0)
    assert [one.track for one in as_ships(alone, hulls)] == [3]
    gone = (track(7, 74, "deleted", 0.0),)  # and its end is the ship's
    hulls = hulls_after(hulls, gone, turn_of(points(places + 24, np.full(7, 1000.0)), 32.5), SENSOR, 1.0)
    assert [(one.track, one.status) for one in as_ships(gone, hulls)] == [(3, "deleted")]


def test_the_end_of_a_part_is_not_told():
    """It ended for those who follow when it was found to be a part."""
    hulls, places = None, np.arange(50, 63)
    tracks = (track(3, 50), track(7, 62))
    turn = turn_of(points(places, np.full(len(places), 1000.0)))
    for _ in range(4):
        hulls = hulls_after(hulls, tracks, turn, SENSOR, 1.0)
    assert hulls.ships == {7: 3}
    ended = (tracks[0], track(7, 62, "deleted", 0.0))
    for _ in range(2):
        hulls = hulls_after(hulls, ended, turn, SENSOR, 1.0)
        assert [(one.track, one.status) for one in as_ships(ended, hulls)] == [(3, "confirmed")]
        ended = tracks[:1]
    assert hulls.ships == {}


@pytest.mark.parametrize("slope", [1.0, 0.3])
def test_the_seas_deviation_is_that_of_an_exponential(slope):
    """Ships, an eighth of all cells here, hardly change it."""
    power = np.random.default_rng(3).exponential(size=SENSOR.shape) ** slope
    level = np.exp(slope * np.mean(np.log(np.random.default_rng(4).exponential(size=100_000))))
    # quartiles of n such logarithms are 1.26 / sqrt(n) apart, relative; all of nine tenths of the most are looked at
    assert sea_deviation(turn_of(power / level)) == pytest.approx(slope, rel=4 * 1.26 / np.sqrt(0.9 * MOST_CELLS))
    power[: len(power) // 8] *= 100.0
    assert sea_deviation(turn_of(power / level)) == pytest.approx(slope, rel=0.5)


def test_ships_that_part_are_two_again():
    """Two that were one echo at first, as side by side in a lock."""
    hulls = None
    for k in range(16):
        apart = 6 if k < 6 else 6 + 2 * (k - 5)
        places = np.arange(50, 57) if k < 6 else np.array([50.0, 50.0 + apart])
        tracks = (track(1, 50), track(2, 50 + apart))
        hulls = hulls_after(hulls, tracks, turn_of(points(places, np.full(len(places), 1000.0)), 2.5 * k), SENSOR, 1.0)
        if k == 5:
            assert hulls.ships == {2: 1}
    assert hulls.ships == {}


def test_a_track_that_has_left_no_place_is_a_candidate():
    moved, told = None, []
    for k in range(8):
        tracks = (track(1, 60 + (k % 2)), track(2, 80 + 3 * k)._replace(existence=0.8))
        turn = turn_of(points([60], [1.0]), 2.5 * k)
        moved = moved_after(moved, tracks, {}, turn, SENSOR)
        told.append({one.track: one.status for one in without_still(tracks, moved)})
    assert {some[1] for some in told} == {"candidate"}
    assert [some[2] for some in told] == ["candidate"] + ["confirmed"] * 7


def test_where_a_guess_was_is_no_place_that_a_track_has_left():
    """A buoy seen from a ship under way was told as one itself: its first places were known to 30 m, and it to 5."""
    moved, turn = None, turn_of(points([60], [1.0]), 0.0)
    for k in range(30):
        off, deviation = (40.0, 30.0) if k < 2 else (0.0, 5.0)
        buoy, slow = track(1, 60), track(2, 80)
        covariance = np.array(buoy.covariance)
        covariance[np.ix_([0, 2], [0, 2])] = deviation**2 * np.eye(2)
        buoy, slow = (one._replace(mean=np.array(one.mean), covariance=covariance) for one in (buoy, slow))
        buoy.mean[0] += off
        slow.mean[0] += 1.5 * k
        moved = moved_after(moved, (buoy, slow), {}, turn, SENSOR)
    assert moved.left == {2}


@pytest.mark.parametrize(
    ("step_m", "samples", "length_m", "speed"),
    longer([(12.5, 100, 150, 9.0), (5.0, 240, 240, 4.0)], (5.0, 240, 240, 4.0)),
)
def test_a_hull_of_many_cells_is_one_ship_where_it_is(step_m, samples, length_m, speed, tmp_path):
    """It was two to four tracks on it, sure of places at bow and stern and of wrong speeds; of 48 cells a wrong one."""
    radar = VideoRadar(spokes=360, samples=samples, step_m=step_m, pulse_m=2 * step_m, beam_deg=2.0, start_m=300.0)
    sea, rng = Sea(radar, SeaState(shape=1.0), Still(np.zeros(cell_places(radar).shape[:2]))), np.random.default_rng(4)
    way, count = np.array([0.8, -0.6]), round(length_m / 2 / step_m) + 1
    along = np.linspace(-length_m / 2, length_m / 2, count)[:, None] * way
    start = np.array([-1100.0, 700.0])
    parts = np.column_stack(
        [start[0] + along[:, 0], np.full(count, speed * way[0]), start[1] + along[:, 1], np.full(count, speed * way[1])]
    )
    path = tmp_path / "video.npz"
    write_radar_video_arrays(path, turns(sea, 26, parts, 24.0 + 5.0 * rng.standard_normal(count), rng))
    outcome = track_video_recording(open_radar_video(path), VideoTracking(), None)
    now = start + outcome.tracked.times_s[-1] * speed * way
    sure = [
        one for one in outcome.tracked.paths if one.confirmed[-1] and one.times_s[-1] == outcome.tracked.times_s[-1]
    ]
    (ship,) = sure
    off = ship.places[-1] - now
    assert np.hypot(*off) < length_m / 2  # on the hull
    np.testing.assert_allclose(ship.velocity[-1], speed * way, atol=2.0)
