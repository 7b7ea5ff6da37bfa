"""MOTChallenge, GeoJSON and netCDF, each read back by something that is not ours."""

import json

import numpy as np
import pytest
import xarray as xr

from elusive.errors import DataError
from elusive.io import TrackRow, write_geojson, write_mot_csv, write_netcdf

ROWS = [
    TrackRow(0.0, None, "none", 0.1),
    TrackRow(0.5, 7, "candidate", 0.6, 10.0, 20.0, lon_deg=-4.5, lat_deg=48.0),
    TrackRow(0.5, 2, "candidate", 0.7, 0.0, 0.0, lon_deg=5.0, lat_deg=6.0),
    TrackRow(1.0, 7, "confirmed", 0.9, 11.0, 20.5, lon_deg=-4.25, lat_deg=48.5),
]


def test_mot_boxes_are_centred_and_count_from_one(tmp_path):
    write_mot_csv(tmp_path / "m.txt", ROWS, sigma_px=0.75, n_sigma=2, rate_hz=2.0)
    table = np.loadtxt(tmp_path / "m.txt", delimiter=",")
    np.testing.assert_array_equal(table[:, :2], [[2, 2], [2, 7], [3, 7]])
    centres = table[:, 2:4] + table[:, 4:6] / 2
    np.testing.assert_allclose(centres - 1, [[0, 0], [10, 20], [11, 20.5]])
    np.testing.assert_array_equal(table[:, 4:6], 3.0)
    np.testing.assert_array_equal(table[:, 6], [0.7, 0.6, 0.9])
    np.testing.assert_array_equal(table[:, 7:], -1)
    assert (tmp_path / "m.txt").read_text().splitlines()[0] == "2,2,-0.5,-0.5,3.0,3.0,0.7,-1,-1,-1"


def test_mot_without_a_rate_takes_time_as_the_frame(tmp_path):
    write_mot_csv(tmp_path / "m.txt", [ROWS[3]], sigma_px=1)
    assert (tmp_path / "m.txt").read_text().startswith("2,7,")


@pytest.mark.parametrize("rate", [25.0, 30000 / 1001, 0.1])
def test_mot_finds_every_frame_again(tmp_path, rate):
    rows = [ROWS[3]._replace(time_s=k / rate) for k in range(2000)]
    write_mot_csv(tmp_path / "m.txt", rows, sigma_px=1, rate_hz=rate)
    frames = np.loadtxt(tmp_path / "m.txt", delimiter=",", usecols=0)
    np.testing.assert_array_equal(frames, np.arange(1, 2001))


@pytest.mark.parametrize(
    ("rows", "arguments", "match"),
    [
        (ROWS, {"sigma_px": 1}, r"time_s 0\.5 is no frame .*give rate_hz"),
        (ROWS, {"sigma_px": 1, "rate_hz": 3}, r"time_s 0\.5 is no frame .*check rate_hz"),
        ([ROWS[3]._replace(time_s=-1.0)], {"sigma_px": 1}, r"time_s -1\.0 is no frame"),
        ([ROWS[3], ROWS[3]], {"sigma_px": 1}, r"track 7 is twice in frame 1"),
        ([ROWS[3]._replace(track=-7)], {"sigma_px": 1}, r"track -7 is negative"),
        ([ROWS[3]._replace(existence=2.0)], {"sigma_px": 1}, r"row 1 of the tracks has the existence 2\.0"),
        (ROWS, {"sigma_px": 0}, r"sigma_px=0, n_sigma=2\.0: both must be positive"),
    ],
)
def test_mot_refusals(tmp_path, rows, arguments, match):
    with pytest.raises(DataError, match=match):
        write_mot_csv(tmp_path / "m.txt", rows, **arguments)
    assert list(tmp_path.iterdir()) == []


def test_geojson_is_as_rfc_7946_has_it(tmp_path):
    write_geojson(tmp_path / "t.geojson", ROWS)
    collection = json.loads((tmp_path / "t.geojson").read_text())
    assert collection["type"] == "FeatureCollection"
    assert [feature["type"] for feature in collection["features"]] == ["Feature", "Feature"]
    point, line = (feature["geometry"] for feature in collection["features"])
    assert point == {"type": "Point", "coordinates": [5.0, 6.0]}
    assert line == {"type": "LineString", "coordinates": [[-4.5, 48.0], [-4.25, 48.5]]}
    properties = collection["features"][1]["properties"]
    assert properties == {"track": 7, "status": "confirmed", "time_s": [0.5, 1.0], "existence": [0.6, 0.9]}


def test_geojson_needs_coordinates(tmp_path):
    with pytest.raises(DataError, match=r"track 3 has no lon_deg and lat_deg at time_s 1\.0; .*write CSV"):
        write_geojson(tmp_path / "t.geojson", [*ROWS, TrackRow(1.0, 3, "confirmed", 0.9, 1.0, 1.0)])
    assert list(tmp_path.iterdir()) == []
    write_geojson(tmp_path / "empty.geojson", ROWS[:1])
    assert json.loads((tmp_path / "empty.geojson").read_text()) == {"type": "FeatureCollection", "features": []}


def dataset():
    mean = np.random.default_rng(6).normal(size=(4, 2))
    coords = {"time": ("time", np.arange(4.0), {"units": "s"}), "state": ["x", "y"]}
    return xr.Dataset({"mean": (("time", "state"), mean), "existence": ("time", mean[:, 0])}, coords, {"seed": 3})


def test_netcdf_reads_back_and_repeats_bit_for_bit(tmp_path):
    for name in ("a.nc", "b.nc"):
        write_netcdf(tmp_path / name, dataset())
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "a.nc", engine="h5netcdf"), dataset())
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


def test_netcdf_refuses_what_does_not_fit_and_keeps_the_earlier_file(tmp_path):
    write_netcdf(tmp_path / "a.nc", dataset())
    before = (tmp_path / "a.nc").read_bytes()
    with pytest.raises(DataError, match=r"a\.nc: the dataset does not fit netCDF"):
        write_netcdf(tmp_path / "a.nc", dataset().assign_attrs(nested={"a": 1}))
    assert (tmp_path / "a.nc").read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["a.nc"]
