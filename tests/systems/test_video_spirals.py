"""Another radar's pulses, one in a spoke, are named and taken out: ships were lost among them, or dozens were there."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.io.radar_video import open_radar_video
from elusive.sensors.spokes import join_spokes
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.sea import Sea, SeaState, Still, VideoRadar, cell_places, turns
from elusive.systems.video.track import track_video_recording
from tests.longer import longer

RADAR = VideoRadar(spokes=360, samples=120, step_m=20.0, pulse_m=40.0, beam_deg=3.0, start_m=200.0)
SHIP = np.array([-900.0, 8.0, 500.0, 5.0])
EACH = [  # the sea, pulses of another radar, how far they are turned from spoke to spoke, whether they are named
    (SeaState(law="weibull", shape=0.8, clutter_db=20.0), None, 0.0, False),
    (SeaState(shape=0.5), 25.0, 5.219, True),
    (SeaState(shape=1.0), 40.0, 5.219, True),
    (SeaState(shape=1.0), 40.0, 0.7, True),
    (SeaState(shape=1.0), 25.0, -1.3, True),
]


@pytest.mark.parametrize(
    ("state", "pulses_db", "further", "named"),
    [
        (SeaState(shape=0.5), None, 0.0, False),
        *longer(EACH, *EACH[:4]),
    ],
)
def test_pulses_of_another_radar_are_named_and_hide_no_ship(tmp_path, state, pulses_db, further, named):
    """So many samples further in each spoke; where that is less than a pulse, no ship was found, silently."""
    sea = Sea(RADAR, state, Still(np.zeros(cell_places(RADAR).shape[:2])))
    whole = join_spokes(list(turns(sea, 18, SHIP[None], np.array([20.0]), np.random.default_rng(4))))
    path, amplitude = tmp_path / "video.npz", whole.amplitude.copy()
    if pulses_db is not None:
        spoke = np.arange(len(amplitude))
        for k, level in enumerate((0.5, 1.0, 0.5)):
            amplitude[spoke, (np.floor(further * spoke).astype(int) + k) % RADAR.samples] += level * 10 ** (
                pulses_db / 20
            )
    np.savez(
        path, amplitude=amplitude, time_s=whole.time_s, azimuth_deg=np.degrees(whole.azimuth_rad), from_north=True,
        start_m=whole.start_m, step_m=whole.step_m, bits=32,
    )  # fmt: skip
    outcome = track_video_recording(open_radar_video(path), VideoTracking(), None)
    finding = next(one for one in outcome.findings if one.name == "video.spirals")
    assert finding.holds != named
    if named:
        assert "interference rejection" in finding.remedy
    if state.law == "k":
        (track,) = outcome.tracked.paths
        away = track.places[-1] - SHIP[[0, 2]] - track.times_s[-1] * SHIP[[1, 3]]
        assert np.hypot(*away) < 60.0
