"""Another radar's pulses, one in a spoke, are named: ships were found less among them, and nothing said so."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.io.radar_video import open_radar_video
from elusive.sensors.spokes import join_spokes
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.sea import Sea, SeaState, Still, VideoRadar, cell_places, turns
from elusive.systems.video.spirals import LOUDER, single_samples
from elusive.systems.video.track import track_video_recording

RADAR = VideoRadar(spokes=360, samples=120, step_m=20.0, pulse_m=40.0, beam_deg=3.0, start_m=200.0)


def recorded(shape, seed):
    sea = Sea(RADAR, SeaState(shape=shape), Still(np.zeros(cell_places(RADAR).shape[:2])))
    ship = np.array([[-900.0, 8.0, 500.0, 5.0]])
    return join_spokes(list(turns(sea, 10, ship, np.array([20.0]), np.random.default_rng(seed))))


@pytest.mark.parametrize("pulses", [True, False])
def test_pulses_of_another_radar_are_named(tmp_path, pulses):
    whole, path = recorded(0.5, 4), tmp_path / "video.npz"
    amplitude = whole.amplitude.copy()
    if pulses:
        spoke = np.arange(len(amplitude))
        amplitude[spoke, (3 * spoke) % RADAR.samples] += 10 ** (25 / 20)
    np.savez(
        path, amplitude=amplitude, time_s=whole.time_s, azimuth_deg=np.degrees(whole.azimuth_rad), from_north=True,
        start_m=whole.start_m, step_m=whole.step_m, bits=32,
    )  # fmt: skip
    outcome = track_video_recording(open_radar_video(path), VideoTracking(), None)
    finding = next(one for one in outcome.findings if one.name == "video.spirals")
    assert finding.holds != pulses
    if pulses:
        assert "interference rejection" in finding.remedy


def test_speckle_stands_alone_as_rarely_as_exponential_power_does():
    """Whatever texture the sea has over a beam; within six deviations of a count."""
    rng = np.random.default_rng(1)
    whole = recorded(0.5, 1)
    texture = rng.gamma(0.5, 2.0, whole.amplitude.shape[1])
    power = texture * rng.exponential(size=(40 * whole.amplitude.shape[0], len(texture)))
    single, of_all = single_samples(whole._replace(amplitude=np.sqrt(power).astype(np.float32)))
    expected = of_all * 2 / ((LOUDER**2 + 1) * (LOUDER**2 + 2))
    assert abs(single - expected) < 6 * np.sqrt(expected)
    assert expected > 100
