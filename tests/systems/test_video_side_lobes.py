"""A very strong ship's side lobes, all round at its range and along its azimuth, are no ships of their own."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.io.radar_video import open_radar_video
from elusive.io.radar_video_arrays import write_radar_video_arrays
from elusive.preprocess.side_lobes import without_side_lobes
from elusive.sensors.spokes import join_spokes
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.simulate import START_S, VideoSimulation, scenario_of, spokes_of
from elusive.systems.video.track import track_video_recording
from tests.reference.radar_video import level_sea


def lobes_added(spokes, ship, radar, rng, *, level_db, below_db):
    """Add a ship of a power over the noise to a turn, and lobes round the turn and to 400 m before and behind it."""
    x, vx, y, vy = ship
    time_s = spokes.time_s[0] - START_S
    distance = radar.start_m + radar.step_m * np.arange(radar.samples)
    off_m = distance - math.hypot(x + time_s * vx, y + time_s * vy)
    off = (spokes.azimuth_rad - math.atan2(x + time_s * vx, y + time_s * vy) + math.pi) % (2 * math.pi) - math.pi
    beam = np.exp(-4 * math.log(2) * (off / math.radians(radar.beam_deg)) ** 2)
    pulse = np.exp(-math.log(4) * (off_m / radar.pulse_m) ** 2)
    lobes = math.sqrt(0.5) * 10 ** (below_db / 20) * np.abs(rng.standard_normal((2, *spokes.amplitude.shape)))
    shape = beam[:, None] * pulse + lobes[0] * pulse + lobes[1] * beam[:, None] * (np.abs(off_m) < 400)
    phase = np.exp(2j * math.pi * rng.random(shape.shape))
    return spokes._replace(
        amplitude=np.abs(spokes.amplitude + 10 ** (level_db / 20) * shape * phase).astype(np.float32)
    )  # fmt: skip


def test_side_lobes_of_a_strong_ship_are_no_ships(tmp_path):
    """They were 20 to 33 sure tracks, and nothing said so."""
    radar = {"spokes": 360, "samples": 120, "step_m": 20.0, "pulse_m": 40.0, "beam_deg": 3.0, "start_m": 200.0}
    simulation = VideoSimulation(
        turns=14, ships=1, snr_db=(15, 15), speed_mps=(10, 10), coast_north_m=None, rocks=0, radar=radar, seed=3
    )
    rng = np.random.default_rng(3)
    scenario = scenario_of(simulation, rng)
    strong = np.array([-1500.0, 9.0, 900.0, 14.0])
    turns = [
        lobes_added(spokes, strong, simulation.radar, rng, level_db=42, below_db=-28)
        for spokes in spokes_of(scenario, simulation, rng)
    ]
    whole, path = join_spokes(turns), tmp_path / "video.npz"
    write_radar_video_arrays(path, [whole])
    outcome = track_video_recording(open_radar_video(path), VideoTracking(), None)
    assert len(outcome.tracked.paths) == 2
    for ship in (strong, scenario.ships[0]):
        track = min(outcome.tracked.paths, key=lambda one: np.hypot(*(one.places[-1] - ship_at(ship, one.times_s[-1]))))
        assert np.hypot(*(track.places[-1] - ship_at(ship, track.times_s[-1]))) < 100.0
        assert len(track.times_s) > 7


def ship_at(ship, time_s):
    return ship[[0, 2]] + (time_s - START_S) * ship[[1, 3]]


@pytest.mark.parametrize(("lobes_db", "hidden"), [(14.0, True), (-99.0, False)])
def test_a_ship_at_a_strong_ones_range_is_hidden_by_lobes_that_are_there_alone(lobes_db, hidden):
    """Evidence of exponential power in a sea of power 1; a ship 9 dB over the lobes' mean is none of them."""
    rng = np.random.default_rng(5)
    power = rng.exponential(size=(180, 120)).astype(np.float32)
    power[:, 60] += 10 ** (lobes_db / 10) * rng.exponential(size=180)
    power[[40, 130], 60] = 1e5, 10**1.1
    power[90, 60] = 10**2.6
    evidence = power.copy()
    found = without_side_lobes(evidence, power, level_sea(power), np.zeros(power.shape, bool))
    assert np.isnan(found[130, 60]) == hidden
    assert np.isfinite(found[[40, 90], 60]).all()
    np.testing.assert_array_equal(found[:, :50], evidence[:, :50])
    assert np.isnan(found[:, 60]).mean() > 0.8 if hidden else np.isfinite(found[100:170]).all()


def test_only_the_peak_of_a_strong_echo_tells_where_it_is():
    """A track sat 160 m from the peak: all of an echo of 45 dB is rarer than any clutter."""
    down, right = np.indices((60, 80))
    fall = ((down - 30) ** 2 + (right - 40) ** 2) / 1.2**2
    power = (1 + 10**4.5 * 2.0**-fall).astype(np.float32)
    power[27, 46] = 1e4  # more than twice the amplitude of the echo there: another's
    found = without_side_lobes(np.log(power) ** 2, power, level_sea(power), np.zeros(power.shape, bool))
    kept = np.argwhere(np.isfinite(found) & (power > 10))
    assert {tuple(place) for place in kept.tolist()} >= {(30, 40), (29, 41), (27, 46)}
    assert np.isnan(found[30, [36, 37, 43, 44]]).all()
    assert len(kept) < 20
