"""Rounded corners against the circle, echoes of a real coast, and a radar that is sailed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.charts import HardWater
from elusive.charts.charted_area import lay_charts, read_charts
from elusive.errors import DataError
from elusive.io import open_radar_plots
from elusive.io.routes import Route
from elusive.systems.radar.coast_echoes import draw_coast_echoes
from elusive.systems.radar.simulate import RadarSimulation, simulate_radar
from elusive.systems.radar.voyage import rounded
from tests.charts.scenes import cell_path
from tests.systems.radar.coast_scene import FRAME


def test_a_corner_is_an_arc_of_its_radius():
    corners = np.array([[0.0, 0.0], [1000.0, 0.0], [1000.0, 1000.0]])
    way, pace = rounded(corners, np.array([5.0, 8.0]), 300.0)
    arc = way[1:-1]
    np.testing.assert_allclose(np.hypot(*(arc - [700.0, 300.0]).T), 300.0, rtol=1e-12)
    np.testing.assert_allclose(way[[0, -1]], corners[[0, -1]])
    assert np.hypot(*np.diff(way, axis=0).T).sum() == pytest.approx(1400 + 300 * math.pi / 2, rel=1e-4)
    assert len(pace) == len(way) - 1
    assert pace[0] == 5
    assert (pace[1:] == 8).all()
    short, _ = rounded(corners, np.array([5.0, 5.0]), 9000.0)  # half of each leg at most
    np.testing.assert_allclose(short[[1, -2]], [[500, 0], [1000, 500]])
    for radius in (0.0, 300.0):  # a turn back, and none
        np.testing.assert_array_equal(rounded(corners[[0, 1, 0]], np.ones(2), radius)[0], corners[[0, 1, 0]])


@pytest.mark.thorough
def test_echoes_lie_on_land_near_the_shore():
    coast = lay_charts(read_charts(cell_path("US5MD1MC")), None, FRAME).coast
    found = draw_coast_echoes(coast, 50, 60.0, 6000.0, np.random.default_rng(0))
    places = found[:, [0, 2]]
    assert (HardWater().bind(coast).probability(places) == 0).all()
    assert np.hypot(*places.T).max() < 6060
    with pytest.raises(DataError, match="have no 5 places"):
        draw_coast_echoes(coast, 5, 60.0, 1.0, np.random.default_rng(0))


def test_a_sailed_radar_tells_its_way(tmp_path):
    def route(*places):
        return Route(FRAME.to_lonlat(np.array(places, dtype=float)), np.full(len(places), np.nan))

    own = route((0.0, 0.0), (100.0, 0.0))
    radar = {"radar_lon_deg": FRAME.lon_deg, "radar_lat_deg": FRAME.lat_deg}
    simulate_radar([route((0, 2000), (300, 2000))], RadarSimulation(speed_mps=5.0), tmp_path, own_route=own, **radar)
    scans = list(open_radar_plots(tmp_path / "plots.csv"))
    assert scans[10].own.x_m == pytest.approx(50.0)
    assert scans[10].own.vx_mps == pytest.approx(5.0)
    assert scans[-1].own == pytest.approx((100.0, 0.0, 0.0, 0.0), abs=1e-9)  # it has arrived
