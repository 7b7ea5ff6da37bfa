"""Coasts from GeoJSON and shapefiles."""

from __future__ import annotations

import json

import numpy as np
import pyogrio
import pytest
import shapely
from pyproj import Transformer

from elusive.charts.outlines import read_outline
from elusive.errors import DataError

from .shapes import DATA

LAND = shapely.box(5.0, 53.0, 5.4, 53.3)
LAKE = shapely.box(5.1, 53.1, 5.3, 53.2)
ISLAND = shapely.box(5.15, 53.12, 5.2, 53.18)
POND = shapely.box(5.16, 53.13, 5.17, 53.14)


def write(path, *shapes, levels=None, **more):
    """Write geometries as GeoJSON, with or without levels."""
    features = [
        {
            "type": "Feature",
            "properties": {} if levels is None else {"level": levels[number]},
            "geometry": json.loads(shapely.to_geojson(shape)),
        }
        for number, shape in enumerate(shapes)
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features, **more}))
    return path


def area(chart):
    return shapely.area(chart.land).sum()


def test_lakes_islands_in_them_and_ponds(tmp_path):
    chart = read_outline(write(tmp_path / "a.geojson", POND, ISLAND, LAND, LAKE, levels=[4, 3, 1, 2]))
    assert area(chart) == pytest.approx(LAND.area - LAKE.area + ISLAND.area - POND.area)
    places = [(5.05, 53.05), (5.12, 53.11), (5.19, 53.15), (5.165, 53.135)]  # on land, lake, island, pond
    found = shapely.intersects(shapely.union_all(chart.land), shapely.points(places))
    assert found.tolist() == [True, False, True, False]
    assert chart.counts == {"level 1": 1, "level 2": 1, "level 3": 1, "level 4": 1}
    assert chart.scale is None
    assert "states no quality" in chart.remarks[0]


def test_without_levels_all_is_land_and_overlaps_count_once(tmp_path):
    assert area(read_outline(write(tmp_path / "a.json", LAND, LAKE))) == pytest.approx(LAND.area)


def test_what_lies_outside_the_rectangle_is_unknown(tmp_path):
    chart = read_outline(write(tmp_path / "a.geojson", ISLAND, shapely.box(5.3, 53, 5.4, 53.1), levels=[1, 2]))
    assert chart.extent_deg == pytest.approx((5.15, 53.0, 5.4, 53.18))
    chart = read_outline(write(tmp_path / "b.geojson", ISLAND, bbox=[4, 52, 6, 54]))
    assert chart.extent_deg == (4, 52, 6, 54)
    chart = read_outline(write(tmp_path / "c.geojson", shapely.box(179.9, -17, 180, -16.9), bbox=[179, -18, -179, -16]))
    assert chart.extent_deg == (179, -18, -179, -16)


def test_an_island_across_the_antimeridian(tmp_path):
    parts = shapely.box(179.9, -17, 180, -16.9), shapely.box(-180, -17, -179.95, -16.9)
    chart = read_outline(write(tmp_path / "a.geojson", *parts))
    assert len(chart.land) == 1
    assert area(chart) == pytest.approx(0.015)
    assert chart.extent_deg == pytest.approx((179.9, -17, -179.95, -16.9))


@pytest.mark.parametrize("system", ["EPSG:4326", "EPSG:32631"])
def test_shapefiles_in_their_own_system(tmp_path, system):
    turn = Transformer.from_crs("EPSG:4326", system, always_xy=True)
    fine = shapely.segmentize(LAND, 0.01)
    turned = shapely.transform(fine, lambda places: np.column_stack(turn.transform(*places.T)))
    path = tmp_path / "coast.shp"
    pyogrio.raw.write(
        path, shapely.to_wkb(np.array([turned])), [np.array([1])], ["level"], geometry_type="Polygon", crs=system
    )
    chart = read_outline(path)
    assert area(chart) == pytest.approx(LAND.area, rel=1e-6)
    np.testing.assert_allclose(chart.land[0].bounds, LAND.bounds, atol=1e-8)


@pytest.mark.parametrize(
    ("shapes", "more", "message"),
    [
        (
            [shapely.Polygon([(5, 53), (6, 54), (6, 53), (5, 54)])],
            {},
            "level 1, object 1: is no valid polygon .Self-inter",
        ),
        ([shapely.LineString([(5, 53), (6, 54)])], {}, "object 1: is a LineString, not a polygon"),
        ([LAND, shapely.box(5, 89, 6, 95)], {}, "object 2: has a coordinate that is no longitude or latitude"),
        ([LAND], {"levels": [7]}, "'level' is not 1 to 4"),
        ([LAND], {"levels": ["sea"]}, "'level' is not 1 to 4"),
        ([LAKE], {"levels": [2]}, "holds no land"),
        ([], {}, "holds no polygon"),
        ([LAND], {"bbox": [1, 2]}, "'bbox' must be"),
        ([LAND], {"bbox": [5, 54, 6, 53]}, "'bbox' must be"),
    ],
)
def test_what_is_no_coast_is_refused(tmp_path, shapes, more, message):
    with pytest.raises(DataError, match=message):
        read_outline(write(tmp_path / "a.geojson", *shapes, **more))


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.geojson", b"", "is neither GeoJSON"),
        ("a.geojson", b"<OGRVRTDataSource></OGRVRTDataSource>", "is neither GeoJSON"),
        ("a.geojson", b"{not json", "cannot be read"),
        ("a.geojson", b'{"a": 1}', "cannot be read|holds no polygon"),
        ("a.shp", b"{}", "is neither GeoJSON"),
        ("a.shp", b"\x00\x00\x27\x0a" + bytes(100), "cannot be read|holds no polygon"),
        ("a.kml", b"{}", "is neither GeoJSON"),
    ],
)
def test_what_is_neither_kind_is_refused(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(DataError, match=message):
        read_outline(tmp_path / name)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(DataError, match=r"none\.geojson: cannot be read \(No such file"):
        read_outline(tmp_path / "none.geojson")


@pytest.mark.parametrize(("letter", "lands"), [("f", 603), ("h", 585)])
def test_the_real_shoreline(letter, lands):
    path = DATA / "coast" / f"gshhg_{letter}_port_fourchon_LA.geojson"
    if not path.is_file():
        pytest.skip(f"no shoreline: {path} is missing; point ELUSIVE_DATA at the data")
    chart = read_outline(path)
    assert chart.counts == {"level 1": lands, "level 2": 4}
    assert chart.extent_deg == pytest.approx((-91.3, 28.919556, -88.816444, 30.0))
