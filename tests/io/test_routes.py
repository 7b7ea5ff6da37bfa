"""Routes: waypoints as a table or a line, and what is no route."""

from __future__ import annotations

import json

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.routes import read_route

PLACES = [[4.0, 52.0], [4.01, 52.0], [4.01, 52.02]]


def line(places, **properties):
    geometry = {"type": "LineString", "coordinates": places}
    return {"type": "Feature", "properties": properties or None, "geometry": geometry}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", "lon_deg,lat_deg\n4.0,52.0\n4.01,52.0\n4.01,52.02\n"),
        ("a.txt", "# home\nlat_deg;lon_deg\n\n52.0;4.0\r\n52.0;4.01\n52.02;4.01"),
        ("a.csv", "lon_deg,lat_deg,speed_mps\n4.0,52.0,\n4.01,52.0,nan\n4.01,52.02,\n"),
        ("a.geojson", json.dumps(line(PLACES))),
        ("a.json", json.dumps({"type": "LineString", "coordinates": [[*place, 3.0] for place in PLACES]})),
        ("a.geojson", json.dumps({"type": "FeatureCollection", "features": [{"type": "Feature"}, line(PLACES)]})),
    ],
)
def test_forms(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    route = read_route(tmp_path / name)
    np.testing.assert_array_equal(route.lonlat_deg, PLACES)
    assert np.isnan(route.speed_mps).all()


def test_speeds(tmp_path):
    (tmp_path / "a.csv").write_text("lon_deg,lat_deg,speed_mps\n4.0,52.0,3\n4.01,52.0,\n")
    np.testing.assert_array_equal(read_route(tmp_path / "a.csv").speed_mps, [3, np.nan])
    (tmp_path / "a.geojson").write_text(json.dumps(line(PLACES, speed_mps=5)))
    np.testing.assert_array_equal(read_route(tmp_path / "a.geojson").speed_mps, [5, 5, 5])


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("a.csv", "", "is empty; write lon_deg,lat_deg"),
        ("a.csv", "lon_deg,lat_deg\n4,52,1\n", "line 2: has 3 cells for 2 columns"),
        ("a.csv", "lon_deg,lat_deg\n4,inf\n", "'inf' is no number"),
        ("a.csv", "lon_deg,lon_deg\n4,4\n", "name them lon_deg,lat_deg"),
        ("a.csv", "lon_deg,lat_deg,speed_mps\n4,52,0\n4,53,1\n", "waypoint 1: its speed, 0 m/s, is not positive"),
        ("a.geojson", "{", "is no GeoJSON"),
        ("a.geojson", "[" * 100_000, "is no GeoJSON"),
        ("a.geojson", "{}", "holds 0 LineStrings"),
        ("a.geojson", json.dumps({"type": "FeatureCollection", "features": [line(PLACES)] * 2}), "holds 2 LineStrings"),
        ("a.geojson", json.dumps(line([[4.0]])), "are no numbers"),
        ("a.geojson", json.dumps(line([["x", 1], [2, 3]])), "are no numbers"),
        ("a.geojson", json.dumps(line([{"x": 1}, 3])), "are no numbers"),
        ("a.geojson", json.dumps(line([[4, 1e999], [2, 3]])), "not finite"),
        ("a.geojson", json.dumps(line([[4, 1]])), "holds 1 waypoints"),
        ("a.geojson", json.dumps(line(PLACES, speed_mps="fast")), "are no numbers"),
        ("a.geojson", json.dumps(line(PLACES, speed_mps=-1)), "is not positive"),
    ],
)
def test_refusals(tmp_path, name, text, sentence):
    (tmp_path / name).write_text(text)
    with pytest.raises(DataError, match=sentence):
        read_route(tmp_path / name)
    with pytest.raises(DataError, match="cannot be read"):
        read_route(tmp_path / f"no-{name}")
