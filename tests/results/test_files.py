"""The files of a log, each read back by something that is not ours: netCDF, MOTChallenge, GeoJSON."""

import json
import math

import numpy as np
import pytest
import xarray as xr

from elusive.errors import DataError
from elusive.results import STATUSES, TrackLog, write_geojson, write_mot_csv, write_result
from elusive.results.spool import Spool
from elusive.tracking import Step, Track

FLAT = ("x", "vx", "y", "vy")


def a_log(unit="px", steps=30, seed=4, added=("score", "lon_deg")):
    log, rng = TrackLog(FLAT, unit, added, ("highest",)), np.random.default_rng(seed)
    for k in range(steps):
        tracks = []
        for number in rng.permutation(4)[: rng.integers(4)] + 1:
            root = rng.normal(size=(4, 4))
            status = STATUSES[rng.integers(3)]
            extra = {name: 5.0 for name in added if name != "score"}
            tracks.append(Track(number, status, rng.random(), rng.normal(size=4), root @ root.T, 2.5, extra))
        log.append(Step(0.5 * k, None, None, tuple(tracks)), highest=float(k))
    return log


def test_netcdf_opens_as_the_same_tracks(tmp_path):
    log = a_log()
    write_result(
        tmp_path / "r.nc", log, title="a recording", config="seed: 1\n", more={"truth": (("step",), log.times_s, {})}
    )
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as found:
        assert found.attrs["featureType"] == "trajectory"
        assert (found.attrs["config"], found.attrs["title"]) == ("seed: 1\n", "a recording")
        assert found["track"].attrs["cf_role"] == "trajectory_id"
        assert found["row_size"].attrs["sample_dimension"] == "obs"
        assert found["status"].attrs["flag_meanings"].split() == list(STATUSES)
        np.testing.assert_array_equal(found["step_time"], log.times_s)
        np.testing.assert_array_equal(found["step_highest"], np.arange(30.0))
        assert found["truth"].dims == ("step",)
        stops = np.cumsum(found["row_size"].values)
        for number, size, stop in zip(found["track"].values, found["row_size"].values, stops, strict=True):
            rows, own = found.isel(obs=slice(stop - size, stop)), log.rows[log.rows["track"] == number]
            np.testing.assert_array_equal(rows["time"], own["time_s"])
            np.testing.assert_array_equal(rows["obs_step"], own["step"])
            np.testing.assert_array_equal(rows["status"], own["status"])
            np.testing.assert_array_equal(rows["existence"], own["existence"])
            np.testing.assert_array_equal(np.column_stack([rows["x"], rows["y"]]), own["position"])
            np.testing.assert_array_equal(np.column_stack([rows["vx"], rows["vy"]]), own["velocity"])
            np.testing.assert_array_equal(rows["position_covariance"], own["covariance"])
            assert (rows["score"] == 2.5).all()
        assert found["lon_deg"].attrs["units"] == "degrees_east"
        assert found.sizes["obs"] == len(log.rows)


def test_netcdf_repeats_bit_for_bit_and_block_by_block(tmp_path):
    log = a_log()
    for name in ("a.nc", "b.nc"):
        write_result(tmp_path / name, log, title="", config="")
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()
    spooled = a_log(steps=0)
    for name in ("_rows", "_steps"):
        old = getattr(log, name)
        setattr(spooled, name, Spool(old.dtype, tmp_path, at_once=4))
        getattr(spooled, name).extend(old.records())
    write_result(tmp_path / "c.nc", spooled, title="", config="")
    with xr.open_dataset(tmp_path / "a.nc") as one, xr.open_dataset(tmp_path / "c.nc") as other:
        xr.testing.assert_identical(one, other)


def test_an_empty_log_is_a_file(tmp_path):
    write_result(tmp_path / "r.nc", TrackLog(("x", "vx"), "samples"), title="", config="")
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as found:
        assert dict(found.sizes) == {"track": 0, "obs": 0, "step": 0, "axis": 1, "axis_2": 1}
        assert "y" not in found


def test_a_fault_leaves_the_earlier_file(tmp_path):
    write_result(tmp_path / "r.nc", a_log(), title="", config="")
    before = (tmp_path / "r.nc").read_bytes()
    with pytest.raises((TypeError, ValueError)):
        write_result(
            tmp_path / "r.nc", a_log(), title="", config="", more={"wrong": (("step",), np.array([{}] * 30), {})}
        )
    assert (tmp_path / "r.nc").read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["r.nc"]


def still(*steps, unit="px", existence=0.75):
    log = TrackLog(FLAT, unit, ("score",))
    for k, tracks in enumerate(steps):
        of_step = [
            Track(number, status, existence, np.array([x, 0.0, y, 0.0]), np.full((4, 4), np.nan), 7.5)
            for number, status, x, y in tracks
        ]
        log.append(Step(k / 25, None, None, tuple(of_step)))
    return log


def test_mot_boxes_are_centred_and_count_from_one(tmp_path):
    log = still(
        [],
        [(7, "candidate", 10.0, 20.0), (2, "confirmed", 0.0, 0.0)],
        [(7, "confirmed", 11.0, 20.5), (2, "deleted", 0, 0)],
    )
    write_mot_csv(tmp_path / "m.txt", log, sigma_px=0.75, first_frame=3)
    table = np.loadtxt(tmp_path / "m.txt", delimiter=",")
    np.testing.assert_array_equal(table[:, :2], [[5, 2], [5, 7], [6, 7]])
    np.testing.assert_allclose(table[:, 2:4] + table[:, 4:6] / 2 - 1, [[0, 0], [10, 20], [11, 20.5]])
    np.testing.assert_array_equal(table[:, 4:6], 3.0)
    np.testing.assert_array_equal(table[:, 6], 0.75)
    np.testing.assert_array_equal(table[:, 7:], -1)
    assert (tmp_path / "m.txt").read_text().splitlines()[0] == "5,2,-0.5,-0.5,3.0,3.0,0.75,-1,-1,-1"
    write_mot_csv(tmp_path / "s.txt", still([(1, "confirmed", 5.0, 5.0)], existence=math.nan), sigma_px=1)
    assert (tmp_path / "s.txt").read_text().split(",")[6] == "7.5"  # where a score alone is known


def test_mot_refusals(tmp_path):
    with pytest.raises(DataError, match="must be positive"):
        write_mot_csv(tmp_path / "m.txt", still([]), sigma_px=0)
    with pytest.raises(DataError, match="the tracks are in m; MOTChallenge needs x and y in pixels"):
        write_mot_csv(tmp_path / "m.txt", still([], unit="m"), sigma_px=1)
    assert list(tmp_path.iterdir()) == []


def test_geojson_is_as_rfc_7946_has_it(tmp_path):
    log = still([(2, "candidate", 5.0, 6.0), (7, "candidate", 0, 1)], [(7, "confirmed", 2.0, 3.0)], unit="m")
    write_geojson(tmp_path / "t.geojson", log, lambda places: places / 10)
    collection = json.loads((tmp_path / "t.geojson").read_text())
    assert collection["type"] == "FeatureCollection"
    assert [feature["type"] for feature in collection["features"]] == ["Feature", "Feature"]
    point, line = (feature["geometry"] for feature in collection["features"])
    assert point == {"type": "Point", "coordinates": [0.5, 0.6]}
    assert line == {"type": "LineString", "coordinates": [[0.0, 0.1], [0.2, 0.3]]}
    properties = collection["features"][1]["properties"]
    assert properties == {"track": 7, "status": "confirmed", "time_s": [0.0, 0.04], "existence": [0.75, 0.75]}
    write_geojson(tmp_path / "e.geojson", still([], unit="m"), lambda places: places)
    assert json.loads((tmp_path / "e.geojson").read_text()) == {"type": "FeatureCollection", "features": []}
    write_geojson(tmp_path / "n.geojson", still([(1, "confirmed", 0, 0)], unit="m", existence=math.nan), lambda at: at)
    assert json.loads((tmp_path / "n.geojson").read_text())["features"][0]["properties"]["existence"] == [None]
    with pytest.raises(DataError, match="GeoJSON needs places on the ground"):
        write_geojson(tmp_path / "p.geojson", still([]), lambda places: places)
