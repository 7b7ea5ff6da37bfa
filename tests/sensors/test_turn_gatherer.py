"""Spokes of radar video gathered into turns: kernels against twins, where a point is, what is not received."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.sensors import _turn_gatherer_kernels as kernels
from elusive.sensors.radar_video import RadarVideo
from elusive.sensors.spokes import Spokes
from elusive.sensors.turn_gatherer import TurnGatherer
from tests.reference import radar_video as twin

RADAR = RadarVideo(beam_deg=9.0, pulse_m=40.0, start_m=100.0, step_m=10.0, samples=128)


@pytest.mark.parametrize("width", [0.0, 0.4, 2.7])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_spokes_are_gathered_as_by_the_twin(kind, width):
    rng = np.random.default_rng(1)
    amplitude, place = rng.integers(0, 200, (50, 13)).astype(kind), rng.uniform(0, 8, 50)
    place = np.floor(1000 * place) / 1000 + 0.0005  # between the points that the twin deals out
    passed, received = rng.uniform(0, 2, (50, 3)), rng.random(50) < 0.8
    if kind is np.float32:
        amplitude[rng.random(amplitude.shape) < 0.1] = np.nan
    (total, roots, lost), counted = np.zeros((3, 8, 4), np.float32), np.zeros((5, 8))
    holes = kernels.gather(amplitude, passed, received, place, width, 3, total, roots, counted, lost)
    expected = twin.gathered(amplitude, passed, received, place, width, 3, total.shape)
    for found, one in zip((total, roots, counted, lost), expected, strict=True):
        np.testing.assert_allclose(found, one, rtol=1e-5 if width == 0 else 0.01)
    assert holes == np.isnan(amplitude[:, :12].astype(float)).reshape(50, 4, 3).any(axis=2).sum()
    spokes = counted[0].copy()
    spokes[3] = 0
    found = kernels.overlap(total, spokes, 2, 2)
    np.testing.assert_allclose(found, twin.overlapped(total.astype(float), spokes, 2, 2), rtol=2e-5)


def test_each_row_is_seen_from_where_the_radar_was_then():
    """A turn had the place of the last of its spokes that were read together: a ship was told a turn's way off."""
    azimuth, nothing = 2 * np.pi * (np.arange(720) % 360 + 0.5) / 360, np.full(720, np.nan)
    place = np.column_stack([0.05 * np.arange(720), 7.0 + np.zeros(720)])
    amplitude, times = np.ones((720, 128), np.float32), np.arange(720) / 180
    gatherer = TurnGatherer(RADAR)
    read = Spokes(times, azimuth, True, RADAR.start_m, 10.0, amplitude, 0, nothing, np.stack([nothing] * 2, 1))
    turns = gatherer.add(read, azimuth, place) + gatherer.rest()
    for number, turn in enumerate(turns):
        np.testing.assert_allclose(turn.row_place[:, 0], 9.0 * turn.row_s, atol=1e-9)  # 9 m/s
        np.testing.assert_allclose(turn.place, (9.0 * (1 + 2 * number), 7.0), atol=0.05)
    assert len(turns) == 2


def test_samples_that_were_not_received_are_no_value():
    """A cell is the mean of what was, and nothing is known of it where hardly any was."""
    azimuth, nothing = 2 * np.pi * (np.arange(360) + 0.5) / 360, np.full(360, np.nan)
    range_part = np.tile(np.repeat([1.0, 3.0], 2), 32)
    amplitude = np.repeat(range_part[None], 360, axis=0).astype(np.float32)
    amplitude[100, 30:34] = np.nan
    amplitude[200:210, 60:64] = np.nan
    gatherer = TurnGatherer(RADAR, azimuth[1] - azimuth[0])
    read = Spokes(azimuth, azimuth, True, RADAR.start_m, 10.0, amplitude, 0, nothing, np.stack([nothing] * 2, 1))
    gatherer.add(read, azimuth, (0.0, 0.0))
    (turn,) = gatherer.rest()
    row, column = np.nonzero(np.isnan(turn.power[:, :-1]))
    assert len(row)
    assert (np.abs(RADAR.azimuth_rad[row] - np.radians(205)) < np.radians(11)).all()
    assert (np.abs(RADAR.range_m[column] - 720) < 30).all()
    np.testing.assert_allclose(turn.power[np.isfinite(turn.power)], 5.0, rtol=1e-5)


def test_clutter_averages_out_alike_in_all_rows():
    """Some rows held one spoke and others two: strong clutter was three times as frequent in those as in the others."""
    radar, rng = RadarVideo(beam_deg=2.0, step_m=10.0, pulse_m=20.0, samples=1600), np.random.default_rng(0)
    azimuth, nothing = 2 * np.pi * np.arange(512) / 512, np.full(512, np.nan)
    gatherer, turns = TurnGatherer(radar, 2 * np.pi / 512), []
    for number in range(6):
        amplitude = np.sqrt(rng.exponential(size=(512, 1600))).astype(np.float32)
        read = Spokes(
            2.0 * number + azimuth / 4, azimuth, True, 0.0, 10.0, amplitude, 0, nothing, np.stack([nothing] * 2, 1)
        )  # fmt: skip
        turns += gatherer.add(read, azimuth, (0.0, 0.0))
    power = np.concatenate([turn.power[:, :-1:2] for turn in turns], axis=1)
    np.testing.assert_allclose(power.mean(axis=1), 1.0, atol=0.06)  # 4000 cells of some 3 looks: six errors
    spread = power.var(axis=1)
    assert spread.max() < 1.4 * spread.min()  # 1.15, and errors of .04; it was 1.5, and these
    assert np.isfinite(turns[0].row_s).all()
    assert np.diff(turns[1].row_s).min() > 0


def test_rows_finer_than_spokes_are_all_received():
    """Cells of a beam told at half of what spokes are apart were all unknown."""
    radar = RadarVideo(beam_deg=1.0, step_m=10.0, pulse_m=20.0, samples=64)
    azimuth, nothing = 2 * np.pi * np.arange(300) / 300, np.full(300, np.nan)
    gatherer = TurnGatherer(radar, 2 * np.pi / 300)
    read = Spokes(
        azimuth, azimuth, True, 0.0, 10.0, np.ones((300, 64), np.float32), 0, nothing, np.stack([nothing] * 2, 1)
    )  # fmt: skip
    gatherer.add(read, azimuth, (0.0, 0.0))
    (turn,) = gatherer.rest()
    np.testing.assert_allclose(turn.power[:, :-1], 1.0, rtol=1e-5)


def test_turns_are_told_apart_and_a_point_is_where_it_is():
    radar, spokes, period = RADAR, 360, 2.0
    azimuth = 2 * np.pi * (np.arange(spokes) + 0.5) / spokes
    towards, distance = np.radians(77.0), 640.0
    off = (azimuth - towards + np.pi) % (2 * np.pi) - np.pi
    beam = np.exp(-4 * np.log(2) * (off / np.radians(9.0)) ** 2)
    pulse = np.exp(-0.5 * ((radar.start_m + 10.0 * np.arange(128) - distance) / 17.0) ** 2)
    amplitude = (1 + 100 * beam[:, None] * pulse).astype(np.float32)
    gatherer, turns = TurnGatherer(radar), []
    for number in range(3):
        for part in np.array_split(np.arange(spokes), 7):
            times = period * (number + part / spokes)
            nothing = np.full(len(part), np.nan)
            read = Spokes(
                times, azimuth[part], True, radar.start_m, 10.0, amplitude[part], 0, nothing, np.stack([nothing] * 2, 1)
            )  # fmt: skip
            turns += gatherer.add(read, azimuth[part], (5.0, 6.0))
    assert len(turns) == 2
    last = gatherer.rest()[0]  # a recording of exactly one turn was refused
    np.testing.assert_allclose(last.row_s - turns[1].row_s, period)
    np.testing.assert_allclose(last.power, turns[1].power)
    assert not gatherer.rest()
    assert turns[0].place == (5.0, 6.0)
    np.testing.assert_allclose(turns[1].row_s - turns[0].row_s, period)
    assert turns[0].time_s < period <= turns[1].row_s[0] + 0.1
    s_r, s_t = radar.deviations
    for power in (turns[0].power, turns[0].even):
        row, column = np.unravel_index(np.nanargmax(power), power.shape)
        assert abs(radar.range_m[column] - distance) < 1.5 * s_r
        assert abs(radar.azimuth_rad[row] - towards) < 1.5 * s_t
    assert (turns[0].even <= turns[0].power * (1 + 1e-5))[:, :-1].all()  # Jensen's inequality
    assert np.isnan(turns[0].even).all(axis=0).nonzero()[0].tolist() == [RADAR.shape[1] - 1]  # half a pulse is no cell


@pytest.mark.parametrize(("first", "last", "turns"), [(0, 360, 1), (6, 356, 1), (30, 360, 0), (0, 330, 0)])
def test_what_is_left_is_a_turn_from_north_to_north(first, last, turns):
    azimuth, gatherer, nothing = (
        np.radians(np.arange(first, last) + 0.5),
        TurnGatherer(RADAR),
        np.full(last - first, np.nan),
    )
    amplitude = np.ones((last - first, 128), np.float32)
    read = Spokes(
        azimuth, azimuth, True, RADAR.start_m, 10.0, amplitude, 0, nothing, np.stack([nothing] * 2, 1)
    )  # fmt: skip
    assert not gatherer.add(read, azimuth, (0.0, 0.0))
    assert len(gatherer.rest()) == turns


def test_a_blanked_sector_is_not_received():
    """It was taken for calm, and its edges were sure ships; where others have no noise either it may be calm."""
    azimuth = 2 * np.pi * (np.arange(360) + 0.5) / 360
    for noise in (True, False):
        gatherer, turns = TurnGatherer(RADAR), []
        for number in range(2):
            amplitude = np.random.default_rng(number).integers(0 if noise else 1, 4, (360, 128)).astype(np.uint8)
            amplitude *= noise
            amplitude[:, 60] = 9
            amplitude[60:120] = 0
            times, nothing = 2.0 * (number + azimuth), np.full(360, np.nan)
            read = Spokes(
                times, azimuth, True, RADAR.start_m, 10.0, amplitude, 8, nothing, np.stack([nothing] * 2, 1)
            )  # fmt: skip
            turns += gatherer.add(read, azimuth, (0.0, 0.0))
        blank = (RADAR.azimuth_rad > np.radians(66)) & (RADAR.azimuth_rad < np.radians(114))
        assert (np.isnan(turns[0].power).all(axis=1) == (blank & noise)).mean() > 0.95
        assert not np.isnan(turns[0].power[~blank & (np.abs(RADAR.azimuth_rad - np.pi / 2) > 0.6), :-1]).any()
        assert np.isnan(turns[0].even[blank]).all() == noise
        assert np.isfinite(turns[0].row_s).all()


def test_spokes_full_of_another_radars_pulses_are_not_received():
    """They hid ships. A coast that fills a sector, or a ship, is received."""
    azimuth = 2 * np.pi * (np.arange(720) + 0.5) / 720
    gatherer, turns = TurnGatherer(RADAR), []
    for number in range(2):
        rng = np.random.default_rng(number)
        amplitude = rng.integers(0, 6, (720, 128)).astype(np.uint8)
        amplitude[200:300] *= 8
        amplitude[500:508, 60] = 200
        for spoke in (100, 400, 650):
            amplitude[spoke, rng.random(128) < 0.5] = 200
        nothing = np.full(720, np.nan)
        read = Spokes(
            2.0 * (number + azimuth), azimuth, True, RADAR.start_m, 10.0, amplitude, 8, nothing,
            np.stack([nothing] * 2, 1),
        )  # fmt: skip
        turns += gatherer.add(read, azimuth, (0.0, 0.0))
    assert turns[0].spoilt == 3
    lost = np.isnan(turns[0].power).all(axis=1)
    near = np.abs(RADAR.azimuth_rad[:, None] - azimuth[[100, 400, 650]]).min(axis=1)
    assert lost.any()
    assert near[lost].max() < 2 * RADAR.grid[2]
    assert np.isfinite(turns[0].row_s).all()
