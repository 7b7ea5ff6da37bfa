"""The edge of what a mast hides is named: the sea beside it stood above its sector's level, as ships."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.io.radar_video import open_radar_video
from elusive.sensors.spokes import join_spokes
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.sea import Sea, SeaState, Still, VideoRadar, cell_places, turns
from elusive.systems.video.track import track_video_recording


@pytest.mark.parametrize("hidden_db", [14.0, 0.0])
def test_a_sector_behind_a_mast_is_named(tmp_path, hidden_db):
    """Three to five tracks stood along its edges, sure, in 36 turns."""
    radar = VideoRadar(spokes=360, samples=120, step_m=20.0, pulse_m=40.0, beam_deg=3.0, start_m=200.0)
    sea = Sea(radar, SeaState(shape=0.5), Still(np.zeros(cell_places(radar).shape[:2])))
    whole = join_spokes(list(turns(sea, 10, np.zeros((0, 4)), np.zeros(0), np.random.default_rng(2))))
    azimuth, path = np.degrees(whole.azimuth_rad), tmp_path / "video.npz"
    seen = np.where((azimuth > 80) & (azimuth < 140), 10 ** (-hidden_db / 20), 1.0)
    np.savez(
        path, amplitude=whole.amplitude * seen[:, None].astype(np.float32), time_s=whole.time_s, azimuth_deg=azimuth,
        from_north=True, start_m=whole.start_m, step_m=whole.step_m, bits=32,
    )  # fmt: skip
    outcome = track_video_recording(open_radar_video(path), VideoTracking(), None)
    finding = next(one for one in outcome.findings if one.name == "video.shadows")
    assert finding.holds == (hidden_db == 0)
    if not finding.holds:
        told = float(finding.sentence.split()[1])
        assert min(abs(told - 80), abs(told - 140)) < 10
