"""Fixed echoes of land beside ships: none becomes a track, and every ship does."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from elusive.charts import Coast, CoastPart, HardWater, NearestWater
from elusive.sensors.radar import RadarSensor
from elusive.systems.radar.land import LandEchoes, land_shares
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.survey import survey
from elusive.systems.radar.track import track_radar
from tests.systems.radar.coast_scene import area_of, coast_scene, land_of

SENSOR = RadarSensor(detection_probability=0.9, false_alarms=2.0, max_range_m=5000.0, doppler_probability=0.0)
NEAR_M = 50.0


def confirmed(scene, parameters, coast):
    """Ship of each confirmed track, minus one: of none; and the ships that have one in the last scan."""
    water = HardWater().bind(coast)
    tracker = parameters.bind(SENSOR, coast, survey(scene.scans, water).land_plots(SENSOR, water))
    nearest: dict[int, int] = {}
    last: set[int] = set()
    for step, ships in zip(track_radar(scene.scans, tracker, parameters), scene.ships, strict=True):
        last = set()
        for track in step.tracks:
            if track.status == "confirmed":
                off = np.hypot(*(ships[:, [0, 2]] - track.mean[[0, 2]]).T)
                ship = int(off.argmin()) if off.min() < NEAR_M else -1
                nearest[track.track] = max(nearest.get(track.track, -1), ship)
                last.add(ship)
    return list(nearest.values()), last


def test_a_shore_full_of_echoes_is_no_fleet():
    """Thirty echoes and a ship."""
    edge = np.column_stack([np.linspace(-6000, 6000, 61), 2000 + 300 * np.sin(np.arange(61))])
    land = shapely.Polygon([*edge, (6000, 8000), (-6000, 8000)])
    coast = Coast.of(CoastPart(land, 10.0))
    scene = coast_scene(SENSOR, land, np.random.default_rng(3), echoes=30, ships=1, scans=24)
    tracks, last = confirmed(scene, RadarTracking(knowledge=NearestWater(), particles=1000), coast)
    assert last == {0}
    assert tracks.count(-1) == 0


@pytest.mark.thorough
@pytest.mark.parametrize("error", ["fresh", "persistent"])
@pytest.mark.parametrize("seed", range(4))
def test_of_120_echoes_on_a_real_coast_two_tracks_are_left_at_most(error, seed):
    area = area_of()
    scene = coast_scene(SENSOR, land_of(area, 5000.0), np.random.default_rng(seed))
    tracks, last = confirmed(scene, RadarTracking(coast={"coast_error": error}), area.coast)
    assert last >= {0, 1}
    assert tracks.count(-1) <= 2


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(4))
def test_echoes_of_the_true_coast_under_the_coarse_chart(seed):
    """The finer cell of the same place is the truth: the coarse coast is 4 m off it at the median, 40 m at 95 %."""
    area = area_of()
    truth = shapely.intersection(land_of(area_of("US5MD1MC"), 5000.0), shapely.box(-3600, -4600, 900, 3000))
    scene = coast_scene(SENSOR, truth, np.random.default_rng(seed))
    tracks, last = confirmed(scene, RadarTracking(), area.coast)
    assert last >= {0, 1}
    assert tracks.count(-1) <= 2


def test_land_is_known_band_by_band():
    """All beyond 2500 m: of two bands, to 1667 and to 5000 m, none of the nearer and three quarters of the other."""
    far = shapely.box(-9000, -9000, 9000, 9000) - shapely.Point(0, 0).buffer(2500, quad_segs=64)
    water = NearestWater().bind(Coast.of(CoastPart(far, 10.0)))
    assert land_shares(SENSOR, water, 2)[:, 0] == pytest.approx([0.0, 0.75], abs=0.02)
    assert land_shares(SENSOR, water) == pytest.approx(0.5, abs=0.01)


def test_land_is_as_dense_in_plots_as_the_recording():
    """Half of the view is land: its density there, summed over the view, is what was counted."""
    coast = Coast.of(CoastPart(shapely.box(0, -9000, 9000, 9000), 10.0))
    water = NearestWater().bind(coast)
    assert land_shares(SENSOR, water) == pytest.approx(0.5, abs=0.01)
    echoes = LandEchoes(SENSOR, water, 12.0)
    rng = np.random.default_rng(5)
    scan = SENSOR.replace(false_alarms=20_000.0).simulate(np.zeros((0, 4)), rng)
    volume = 2 * np.pi * 5000.0
    both = np.exp(echoes.log_scattered(scan)) + np.exp(echoes.new(scan).log_intensity)
    assert volume * both.mean() == pytest.approx(12.0, abs=4 * volume * both.std() / len(both) ** 0.5)
    assert echoes.new(scan.select_detections(np.zeros(0, dtype=int))).log_intensity.shape == (0,)
