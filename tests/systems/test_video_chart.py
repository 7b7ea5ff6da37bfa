"""Radar video under a real chart: a heading and a place that are wrong are told, and what is told mends them."""

from __future__ import annotations

import re

import numpy as np
import pytest

from elusive.charts import HardWater
from elusive.charts.charted_area import lay_charts, read_charts
from elusive.geometry.local_frame import LocalFrame
from elusive.io.radar_video import open_radar_video
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.sea import Sea, SeaState, VideoRadar, cell_places, still_of, turns
from elusive.systems.video.track import track_video_recording
from tests.charts.scenes import cell_path

SITES = {"homer": ("US5AK5SI", -151.43, 59.598), "annapolis": ("US5MD1MC", -76.462, 38.965)}
HIDDEN = 12  # cells of land that are seen of each spoke: what is behind is hidden


def recorded(path, chart, lonlat_deg, off_deg, off_m):
    """Write fourteen turns of the charted land, whose azimuths and place are wrong by so much."""
    frame = LocalFrame.at(*lonlat_deg)
    charted = HardWater().bind(lay_charts(read_charts(chart), VideoTracking().charted, frame).coast)
    radar = VideoRadar(bits=8, start_m=100.0, step_m=10.0, samples=400)
    places = cell_places(radar)
    land = np.asarray(charted.probability(places.reshape(-1, 2))).reshape(places.shape[:2]) < 0.5
    land &= np.cumsum(land, axis=1) <= HIDDEN
    rng = np.random.default_rng(1)
    sea = Sea(radar, SeaState(), still_of(radar, SeaState(), land, 20, rng))
    parts = list(turns(sea, 14, np.zeros((0, 4)), np.zeros(0), rng))
    lon, lat = frame.to_lonlat(np.array([off_m]))[0]
    np.savez(
        path, amplitude=np.concatenate([part.amplitude for part in parts]), from_north=True, bits=8,
        time_s=1.7e9 + np.concatenate([part.time_s for part in parts]), start_m=radar.start_m, step_m=radar.step_m,
        azimuth_deg=(np.degrees(np.concatenate([part.azimuth_rad for part in parts])) + off_deg) % 360,
        lon_deg=lon, lat_deg=lat,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("site", "off_deg", "off_m", "named"),
    [
        pytest.param("homer", 3.0, (0.0, 50.0), {"video.azimuth", "video.place"}, marks=pytest.mark.thorough),
        pytest.param("annapolis", -3.0, (30.0, -40.0), {"video.azimuth", "video.place"}, marks=pytest.mark.thorough),
        pytest.param("annapolis", 1.0, (-50.0, 0.0), {"video.place"}, marks=pytest.mark.thorough),
        pytest.param("homer", -1.0, (-50.0, 0.0), {"video.place"}, marks=pytest.mark.thorough),
    ],
)
def test_a_radar_that_is_turned_and_misplaced_is_told_by_how_much(tmp_path, site, off_deg, off_m, named):
    name, *lonlat_deg = SITES[site]
    chart, path = cell_path(name), tmp_path / "video.npz"
    recorded(path, chart, lonlat_deg, off_deg, off_m)
    told, given = VideoTracking(), dict[str, float]()
    outcome = track_video_recording(open_radar_video(path), told, None, charts=[chart])
    found = {one.name: one for one in outcome.findings}
    azimuth, place = found["video.azimuth"], found["video.place"]
    assert azimuth.seen == pytest.approx(-off_deg, abs=1.0)
    east, north = re.search(r"(\S+) m east, (\S+) m north", dict(outcome.tracked.rows)["Place to the chart"]).groups()
    assert np.hypot(float(east) + off_m[0], float(north) + off_m[1]) < 20.0
    assert {one.name for one in (azimuth, place) if not one.holds} == named
    assert not outcome.tracked.paths
    if not place.holds:
        lon, lat = re.findall(r"-?\d+\.\d+", place.remedy)
        given = {"radar_lon_deg": float(lon), "radar_lat_deg": float(lat)}
    if not azimuth.holds:
        told = told.replace(azimuth_bias_deg=azimuth.seen)
    again = track_video_recording(open_radar_video(path), told, None, charts=[chart], **given)
    assert all(one.holds for one in again.findings if one.name in named)
