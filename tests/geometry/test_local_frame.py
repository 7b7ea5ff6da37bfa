"""The local frame against geodesics on the ellipsoid."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from pyproj import Geod

from elusive.charts.chart import as_geometries
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from tests.charts.scenes import FRAME, drawn

GEOD = Geod(ellps="WGS84")


def test_ranges_and_bearings_from_the_origin_are_exact():
    rng = np.random.default_rng(1)
    places = np.column_stack([5 + rng.uniform(-3, 3, 200), 53 + rng.uniform(-2, 2, 200)])
    bearing, _, distance = GEOD.inv(np.full(200, 5.0), np.full(200, 53.0), *places.T)
    x, y = FRAME.to_local(places).T
    np.testing.assert_allclose(np.hypot(x, y), distance, atol=1e-5)
    np.testing.assert_allclose((np.rad2deg(np.arctan2(x, y)) - bearing + 180) % 360, 180, atol=1e-8)


def test_lengths_across_are_stretched_as_stated():
    for distance in (50e3, 200e3, 500e3):
        xy = np.array([[0.0, distance], [1.0, distance]])
        (a, b), (c, d) = FRAME.to_lonlat(xy)
        true = GEOD.inv(a, b, c, d)[2]
        assert 1 / true - 1 == pytest.approx(LocalFrame.distortion(distance), rel=0.02)
    assert LocalFrame.distortion(50e3) == pytest.approx(1.03e-5, rel=0.01)
    assert LocalFrame.distortion(0.0) == 0.0


def test_there_and_back():
    places = np.random.default_rng(2).uniform([1, 51], [9, 55], (100, 2))
    np.testing.assert_allclose(FRAME.to_lonlat(FRAME.to_local(places)), places, atol=1e-10)


def test_long_edges_bend_as_parallels_do():
    along = FRAME.project(as_geometries([shapely.LineString([(4, 53), (6, 53)])]))[0]
    middle = FRAME.to_local([[4.5, 53.0]])[0]
    assert shapely.distance(along, shapely.Point(middle)) < 0.05
    chord = shapely.LineString(FRAME.to_local([[4, 53], [6, 53]]))
    assert shapely.distance(chord, shapely.Point(middle)) > 100


def test_a_scene_on_both_sides_of_the_antimeridian():
    edge = LocalFrame.at(180.0, -17.0)
    box = edge.unproject(as_geometries([shapely.box(-9000, -500, 11000, 500)]))
    lon = shapely.get_coordinates(box)[:, 0]
    assert lon.min() < -179
    assert lon.max() > 179
    chart = drawn("fiji", [], shapely.box(0, 0, 1, 1))
    chart.coverage[:] = box
    frame = LocalFrame.about([chart])
    assert frame.lat_deg == pytest.approx(-17.0, abs=1e-3)
    assert abs(frame.lon_deg) == pytest.approx(180 - 1000 / 106_500, abs=1e-3)
    assert shapely.area(frame.project(box)).sum() == pytest.approx(20e6, rel=1e-3)
    assert chart.extent_deg[0] > 179 > -179 > chart.extent_deg[2]


def test_what_is_too_far_apart_is_refused():
    far = drawn("far", [], shapely.box(0, 0, 1.2e6, 10))
    with pytest.raises(DataError, match=r"reach 6[01][0-9] km from their middle"):
        LocalFrame.about([far])


@pytest.mark.parametrize("place", [(0.0, 91.0), (400.0, 0.0), (float("nan"), 0.0)])
def test_what_is_no_place_is_refused(place):
    with pytest.raises(DataError, match="no longitude and latitude"):
        LocalFrame.at(*place)
