"""Tables of bearings and of sensors: read as written, refused with file and line."""

from __future__ import annotations

import itertools
import json
import warnings

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.bearings import open_bearings
from elusive.io.sensor_files import read_sensors
from elusive.io.sources import Feed
from elusive.sensors.arrival_times import ArrivalSet
from elusive.sensors.hybrid import HybridSet

HEAD = "time_s,sensor,azimuth_deg,elevation_deg\n"
SENSORS = "sensor,x_m,y_m,z_m\nwest,0,0,1.5\neast, 70,12,2\n"


@pytest.fixture
def sites(tmp_path):
    (tmp_path / "sensors.csv").write_text(SENSORS)
    return read_sensors(tmp_path / "sensors.csv")


def written(tmp_path, text):
    (tmp_path / "bearings.csv").write_text(text)
    return tmp_path / "bearings.csv"


def test_reads_what_is_written(tmp_path, sites):
    rows = "0,west,90,10\n0,east,-45,\n\n1.5,west,359.5,nan\n1.5,west,1,5\n"
    source = open_bearings(written(tmp_path, "# made\n" + HEAD + rows), sites)
    assert sites.names == ("west", "east")
    assert np.array_equal(sites.positions_m, [[0, 0, 1.5], [70, 12, 2]])
    for _ in range(2):
        first, second = source
        assert (first.time_s, second.time_s) == (0.0, 1.5)
        assert (first.sensor.tolist(), second.sensor.tolist()) == ([0, 1], [0, 0])
        np.testing.assert_allclose(np.rad2deg(first.azimuth_rad), [90, -45])
        np.testing.assert_allclose(np.rad2deg(second.azimuth_rad), [359.5, 1])
        np.testing.assert_allclose(np.rad2deg(first.elevation_rad), [10, np.nan])
        np.testing.assert_allclose(np.rad2deg(second.elevation_rad), [np.nan, 5])


def test_reads_no_further_than_asked(tmp_path, sites):
    text = "time_s,sensor,azimuth_deg\n0,west,90\n1,east,45\n2,west,broken\n"
    (first,) = itertools.islice(open_bearings(written(tmp_path, text), sites), 1)
    assert first.time_s == 0.0
    assert np.isnan(first.elevation_rad).all()


def test_places_without_height_stand_at_nought(tmp_path):
    (tmp_path / "flat.csv").write_text("sensor,y_m,x_m\n0,1,2\n")
    assert read_sensors(tmp_path / "flat.csv").positions_m.tolist() == [[2, 1, 0]]


def test_followed_until_idle(tmp_path, sites):
    path = written(tmp_path, "time_s,sensor,azimuth_deg\n0,west,90\n0,east,300\n")
    assert [s.time_s for s in open_bearings(path, sites, feed=Feed(idle_s=0.1))] == [0.0]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", r"csv: is empty; write time_s,sensor,azimuth_deg"),
        (HEAD, r"csv: holds no bearing"),
        ("time_s,sensor\n0,west\n", r"line 1: the columns are 'time_s,sensor'; name them time_s,sensor,azimuth_deg"),
        ("time_s,sensor,azimuth_deg,azimuth_deg\n0,west,1,1\n", r"line 1: the columns are"),
        ("time_s,sensor,azimuth_deg,power\n0,west,1,1\n", r"line 1: the columns are"),
        (HEAD + "0,west,1\n", r"line 2: has 3 cells for 4 columns"),
        (HEAD + "0,wst,1,2\n", r"line 2: there is no sensor 'wst'; did you mean 'west'\?"),
        (HEAD + "0,7,1,2\n", r"line 2: there is no sensor '7'; known are west, east"),
        (HEAD + "0,west,361,2\n", r"line 2, column azimuth_deg: 361 is not from -360 to 360"),
        (HEAD + "0,west,north,2\n", r"line 2, column azimuth_deg: 'north' is no number"),
        (HEAD + "0,west,,2\n", r"line 2, column azimuth_deg: '' is no number"),
        (HEAD + "0,west,1,91\n", r"line 2, column elevation_deg: 91 is not from -90 to 90"),
        (HEAD + "1,west,1,2\n0.5,east,1,2\n", r"line 3, column time_s: 0.5 comes after 1; sort"),
        (HEAD + "inf,west,1,2\n", r"line 2, column time_s: 'inf' is no number"),
        (HEAD + "1790000000000,west,1,2\n", r"line 2, column time_s: 1790000000000 would .* milliseconds since 1970"),
    ],
)
def test_refuses(tmp_path, sites, text, sentence):
    with pytest.raises(DataError, match=sentence):
        list(open_bearings(written(tmp_path, text), sites))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("sensor,x_m\n", r"line 1: the columns are 'sensor,x_m'; name them sensor,x_m,y_m and perhaps z_m"),
        ("sensor,x_m,y_m\n", r"holds no sensor"),
        ("sensor,x_m,y_m\na,1,2\na,3,4\n", r"line 3: the sensor's name 'a' is empty or taken"),
        ("sensor,x_m,y_m\n,1,2\n", r"line 2: the sensor's name '' is empty"),
        ("sensor,x_m,y_m\na,1,up\n", r"line 2, column y_m: 'up' is no number"),
        ("sensor,x_m,y_m\na,1\n", r"line 2: has 2 cells for 3 columns"),
    ],
)
def test_refuses_sensors(tmp_path, text, sentence):
    (tmp_path / "sensors.csv").write_text(text)
    with pytest.raises(DataError, match=sentence):
        read_sensors(tmp_path / "sensors.csv")


def test_refuses_what_is_not_there(tmp_path, sites):
    with pytest.raises(DataError, match="there is no such file"):
        open_bearings(tmp_path / "none.csv", sites)
    with pytest.raises(DataError, match="is a folder"):
        open_bearings(tmp_path, sites)
    with pytest.raises(DataError, match="cannot be read"):
        read_sensors(tmp_path / "none.csv")


def test_suspects_radians_and_says_when_one_sensor_is_all(tmp_path, sites):
    lines = [f"{k},{name},{0.1 * k:.3f}" for k in range(60) for name in ("west", "east")]
    with pytest.warns(UserWarning, match="first 50 azimuths is above 2.4; they are read as degrees and look like rad"):
        list(open_bearings(written(tmp_path, "time_s,sensor,azimuth_deg\n" + "\n".join(lines)), sites))
    alone = "time_s,sensor,azimuth_deg\n" + "\n".join(f"{k},east,{k}" for k in range(60))
    with pytest.warns(UserWarning, match="all bearings are of sensor 'east'; one sensor gives no distance"):
        list(open_bearings(written(tmp_path, alone), sites))
    both = "time_s,sensor,azimuth_deg\n" + "\n".join(f"{k},{('west', 'east')[k % 2]},{k}" for k in range(60))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(list(open_bearings(written(tmp_path, both), sites))) == 60


def test_other_marks_and_empty_cells_at_the_end(tmp_path, sites):
    text = "time_s\tsensor\tazimuth_deg\televation_deg\n0\twest\t90\t10\n1\teast\t45\t\n"
    first, second = open_bearings(written(tmp_path, text), sites)
    np.testing.assert_allclose(np.rad2deg(first.elevation_rad), [10])
    assert np.isnan(second.elevation_rad).all()


def test_columns_decide_what_is_read(tmp_path, sites):
    (alone,) = open_bearings(written(tmp_path, "time_s,sensor,arrival_s\n0,west,1e-7\n0,east,3e-7\n"), sites)
    assert isinstance(alone, ArrivalSet)
    assert alone.sensor.tolist() == [0, 1]
    np.testing.assert_array_equal(alone.arrival_s, [1e-7, 3e-7])
    text = "time_s,sensor,azimuth_deg,arrival_s\n0,west,90,\n0,east,,3e-7\n1,east,10,4e-7\n"
    first, second = open_bearings(written(tmp_path, text), sites)
    assert isinstance(first, HybridSet)
    assert (first.bearings.sensor.tolist(), first.arrivals.sensor.tolist()) == ([0], [1])
    assert (second.bearings.sensor.tolist(), second.arrivals.sensor.tolist()) == ([1], [1])
    assert second.bearings.time_s == second.arrivals.time_s == 1.0
    with pytest.raises(DataError, match="line 2, column arrival_s: 'soon' is no number"):
        list(open_bearings(written(tmp_path, "time_s,sensor,arrival_s\n0,west,soon\n"), sites))


def points(*features):
    return json.dumps({"type": "FeatureCollection", "features": [
        {"type": "Feature", **more, "geometry": {"type": "Point", "coordinates": place}} for place, more in features
    ]})  # fmt: skip


def test_sensors_may_be_points_of_geojson(tmp_path):
    text = points(
        ([8.54, 47.37, 412.0], {"properties": {"sensor": "mast", "name": "other"}}),
        ([8.55, 47.37], {"properties": {"name": "roof"}}),
        ([8.54, 47.38], {"id": 7, "properties": None}),
    )
    (tmp_path / "sensors.geojson").write_text(text)
    (tmp_path / "sensors.csv").write_text(
        "sensor,lon_deg,lat_deg,z_m\nmast,8.54,47.37,412\nroof,8.55,47.37,\n7,8.54,47.38,0\n"
    )
    found, table = (read_sensors(tmp_path / name) for name in ("sensors.geojson", "sensors.csv"))
    assert found.names == table.names == ("mast", "roof", "7")
    np.testing.assert_array_equal(found.positions_m, table.positions_m)
    assert found.frame == table.frame


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("{", "is no GeoJSON; write a Point, or a table of sensor,lon_deg,lat_deg"),
        (points(), "holds no sensor"),
        (points(([8.5], {"id": 1})), "Point 1: has no longitude and latitude"),
        (points(([8.5, 47.0], {})), "Point 1: the sensor's name '' is empty or taken"),
        (points((["a", 47.0], {"id": 1})), "lon_deg"),
    ],
)
def test_refuses_points_that_are_no_sensors(tmp_path, text, sentence):
    (tmp_path / "sensors.geojson").write_text(text)
    with pytest.raises(DataError, match=sentence):
        read_sensors(tmp_path / "sensors.geojson")
