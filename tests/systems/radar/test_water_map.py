"""P(water) as GeoTIFF and netCDF: what stands in the cells, and what other tools need to place them."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
import tifffile
import xarray as xr

from elusive.charts import ExactWater, FieldWater
from elusive.charts.charted_area import lay_charts, read_charts
from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.systems.radar import water_map
from elusive.systems.radar.water_map import ChartParameters, write_water_map
from tests.charts.test_outlines import LAKE, LAND, write

PARAMETERS = ChartParameters(imprecision={"coast_sigma_m": 40.0}, map_cell_m=50.0)
WEST, SOUTH, EAST, NORTH = LAND.buffer(0.003).bounds


@pytest.fixture
def charts(tmp_path):
    """Land with a lake; what is 0.003 degrees about it is covered."""
    return read_charts(write(tmp_path / "a.geojson", LAND, LAKE, levels=[1, 2], bbox=[WEST, SOUTH, EAST, NORTH]))


def geotiff(path):
    """Values, and longitude and latitude of the cells' middles, from the tags alone (GeoTIFF 1.1, annex B.6)."""
    with tifffile.TiffFile(path) as tif:
        tags = tif.pages[0].tags
        values = tif.pages[0].asarray()
        width, height, _ = tags[33550].value
        column, row, _, lon, lat, _ = tags[33922].value
        keys = np.reshape(tags[34735].value, (-1, 4))
        nodata = tags[42113].value
    rows, columns = values.shape
    assert keys[0].tolist() == [1, 1, 0, len(keys) - 1]
    # geographic; a cell is an area, not a point; WGS 84; degrees
    assert {key: value for key, _, _, value in keys[1:].tolist()} == {1024: 2, 1025: 1, 2048: 4326, 2054: 9102}
    assert nodata == "nan"
    return values, lon + (np.arange(columns) + 0.5 - column) * width, lat - (np.arange(rows) + 0.5 - row) * height


def expected_at(charts, lon, lat):
    scene = lay_charts(charts, PARAMETERS)
    points = scene.frame.to_local(np.stack(np.meshgrid(lon, lat), axis=-1).reshape(-1, 2))
    water = FieldWater().bind(scene.coast)
    return np.where(water.known(points), water.probability(points), np.nan).reshape(len(lat), len(lon))


def test_a_geotiff_holds_the_probability_at_the_cells_middles(tmp_path, charts, monkeypatch):
    monkeypatch.setattr(water_map, "TILE", 64)  # several tiles, the last ones not full
    path = tmp_path / "water.tif"
    cells = write_water_map(path, charts, PARAMETERS)
    values, lon, lat = geotiff(path)
    assert values.dtype == np.float32
    assert values.shape == (len(cells.lat_deg), len(cells.lon_deg))
    assert max(values.shape) > 64
    assert max(values.shape) % 64
    assert lon == pytest.approx(cells.lon_deg, abs=1e-9)
    assert lat == pytest.approx(cells.lat_deg, abs=1e-9)
    assert values == pytest.approx(expected_at(charts, lon, lat), abs=1e-6, nan_ok=True)
    assert lat[0] > lat[-1]
    assert lon[0] - WEST == pytest.approx(0.5 * (lon[1] - lon[0]))
    assert NORTH - lat[0] == pytest.approx(0.5 * (lat[0] - lat[1]))
    assert lon[-1] + 0.5 * (lon[1] - lon[0]) >= EAST - 1e-9
    assert (lat[0] - lat[1]) * 111_132 == pytest.approx(50)
    middle = np.deg2rad(0.5 * (NORTH + SOUTH))
    assert (lon[1] - lon[0]) * 111_132 * np.cos(middle) == pytest.approx(50)
    assert np.nanmin(values) < 0.01
    assert np.nanmax(values) > 0.99


def test_a_netcdf_says_the_same(tmp_path, charts):
    write_water_map(tmp_path / "water.nc", charts, PARAMETERS, ExactWater())
    write_water_map(tmp_path / "water.tiff", charts, PARAMETERS, ExactWater())
    values, lon, lat = geotiff(tmp_path / "water.tiff")
    with xr.open_dataset(tmp_path / "water.nc", engine="h5netcdf") as data:
        assert data.attrs["Conventions"] == "CF-1.8"
        found = data["water_probability"]
        assert np.array_equal(found, values, equal_nan=True)
        assert found.dims == ("lat", "lon")
        assert found.attrs["units"] == "1"
        assert data[found.attrs["grid_mapping"]].attrs["grid_mapping_name"] == "latitude_longitude"
        for name, at, unit in (("lat", lat, "degrees_north"), ("lon", lon, "degrees_east")):
            assert data[name].values == pytest.approx(at, abs=1e-9)
            assert data[name].attrs["units"] == unit
        assert data["lat"].attrs["standard_name"] == "latitude"


def test_what_no_chart_covers_is_not_a_number(tmp_path, charts):
    extent = (WEST - 0.01, SOUTH - 0.01, EAST, NORTH)
    parameters = PARAMETERS.replace(map_extent_deg=extent, map_cell_m=200.0)
    write_water_map(tmp_path / "water.tif", charts, parameters)
    values, lon, lat = geotiff(tmp_path / "water.tif")
    outside = (lon < WEST) | (lon > EAST), (lat < SOUTH) | (lat > NORTH)
    unknown = outside[1][:, None] | outside[0]
    # a tenth of a cell is left for edges that are straight in the one projection and bent in the other
    near = np.abs(np.subtract.outer(lat, [SOUTH, NORTH])).min(axis=1)[:, None] < 2e-4
    near = near | (np.abs(np.subtract.outer(lon, [WEST, EAST])).min(axis=1) < 2e-4)
    assert unknown.any()
    assert np.array_equal(np.isnan(values)[~near], unknown[~near])


@pytest.mark.thorough
def test_the_usual_cell_is_half_a_deviation_or_what_fits(tmp_path, charts, monkeypatch):
    parameters = PARAMETERS.replace(map_cell_m=None)
    cells = write_water_map(tmp_path / "a.nc", charts, parameters)
    assert cells.height_deg * 111_132 == pytest.approx(20.0)
    monkeypatch.setattr(water_map, "USUAL_CELLS", 1000)
    fewer = write_water_map(tmp_path / "b.nc", charts, parameters)
    assert 1000 <= len(fewer.lat_deg) * len(fewer.lon_deg) < 1200


def test_too_many_cells_are_refused_with_a_size_that_is_taken(tmp_path, charts, monkeypatch):
    monkeypatch.setattr(water_map, "MOST_CELLS", 10_000)
    with pytest.raises(
        ParameterError, match=r"map_cell_m: cells of 1 m would be \d+ x \d+, more than 0.01 million"
    ) as told:
        write_water_map(tmp_path / "a.tif", charts, PARAMETERS.replace(map_cell_m=1.0))
    enough = float(str(told.value).split("take cells of ")[1].split()[0])
    write_water_map(tmp_path / "a.tif", charts, PARAMETERS.replace(map_cell_m=1.05 * enough))


@pytest.mark.parametrize("name", ["water.png", "water"])
def test_another_ending_is_refused(tmp_path, charts, name):
    with pytest.raises(ParameterError, match=rf"{name}: a map's name must end with \.tif, \.tiff, \.nc"):
        write_water_map(tmp_path / name, charts, PARAMETERS)


@pytest.mark.parametrize("extent", [(2, 1, 1, 2), (1, 2, 2, 2), (0, -91, 1, 0)])
def test_an_extent_the_wrong_way_round_is_refused(extent):
    with pytest.raises(ParameterError, match="map_extent_deg: must be west, south, east, north"):
        ChartParameters(map_extent_deg=extent)


@pytest.mark.parametrize("turn", [0.0, -math.copysign(360.0, WEST)])
def test_an_extent_off_every_chart_is_refused_before_anything_is_written(tmp_path, charts, turn):
    inside = (WEST + 0.001 + turn, SOUTH + 0.001, WEST + 0.002 + turn, SOUTH + 0.002)
    outside = (EAST + 0.01 + turn, SOUTH, EAST + 0.02 + turn, NORTH)
    write_water_map(tmp_path / "a.tif", charts, PARAMETERS.replace(map_extent_deg=inside, map_cell_m=20.0))
    assert np.isfinite(geotiff(tmp_path / "a.tif")[0]).any()
    with pytest.raises(ParameterError, match="map_extent_deg: no chart reaches into"):
        write_water_map(tmp_path / "b.tif", charts, PARAMETERS.replace(map_extent_deg=outside))
    assert not (tmp_path / "b.tif").exists()


def test_a_map_cut_short_leaves_nothing(tmp_path, charts, monkeypatch):
    monkeypatch.setattr(water_map, "_padded", lambda values: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_water_map(tmp_path / "a.tif", charts, PARAMETERS)
    with pytest.raises(DataError, match="there is no folder"):
        write_water_map(tmp_path / "none" / "a.tif", charts, PARAMETERS)
    assert [path.name for path in tmp_path.iterdir()] == ["a.geojson"]


def test_an_island_across_the_antimeridian(tmp_path):
    parts = shapely.box(179.99, -17, 180, -16.99), shapely.box(-180, -17, -179.99, -16.99)
    charts = read_charts(write(tmp_path / "a.geojson", *parts, bbox=[179.98, -17.01, -179.98, -16.98]))
    write_water_map(tmp_path / "a.tif", charts, PARAMETERS)
    values, lon, _ = geotiff(tmp_path / "a.tif")
    assert len(lon) < 100
    assert np.isfinite(values[1:-1, 1:-1]).all()
    assert values[len(values) // 2, len(lon) // 2] < 0.01


def test_the_command(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    write(tmp_path / "a.geojson", LAND)
    target = tmp_path / "w.tif"
    given = ["chart", str(tmp_path / "a.geojson"), "--water-probability"]
    with pytest.raises(SystemExit) as ended:
        main([*given, str(target), "--map-cell-m", "100", "--coast-sigma-m", "9"])
    assert ended.value.code == 0
    assert f"Written to {target}" in capsys.readouterr().err
    assert geotiff(target)[0].size > 100
    with pytest.raises(SystemExit) as ended:
        main([*given, str(tmp_path / "w.gif")])
    assert ended.value.code == 2
    assert "a map's name must end with" in capsys.readouterr().err
