from __future__ import annotations

import numpy as np

from elusive.io.radar_video import open_radar_video
from elusive.io.radar_video_arrays import write_radar_video_arrays
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.sea import Sea, SeaState, Still, VideoRadar, cell_places, turns
from elusive.systems.video.track import track_video_recording


def test_a_sea_that_saturates_hides_ships_and_is_told(tmp_path):
    """Of three ships of 17 to 30 dB none was found, and nothing was said: near the radar the sea was at 255 itself."""
    radar = VideoRadar(spokes=256, samples=200, step_m=12.5, pulse_m=25.0, start_m=300.0, bits=8, gain=30.0)
    for clutter_db, some in ((-10.0, False), (25.0, True)):
        still = Still(np.zeros(cell_places(radar).shape[:2]))
        sea, path = Sea(radar, SeaState(shape=5.0, clutter_db=clutter_db), still), tmp_path / f"{some}.npz"
        write_radar_video_arrays(path, turns(sea, 8, np.zeros((0, 4)), np.zeros(0), np.random.default_rng(0)))
        outcome = track_video_recording(open_radar_video(path), VideoTracking(), None)
        (found,) = (one for one in outcome.findings if one.name == "video.saturated")
        assert found.holds != some
        assert (found.seen > 0.2) == some
