"""Areas: inside or outside, distance to the border, files of corners."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from elusive.errors import DataError, ParameterError
from elusive.geometry.areas import Area
from elusive.io.placed_files import read_area

L_SHAPE = ((0, 0), (40, 0), (40, 10), (10, 10), (10, 40), (0, 40))


def star(seed):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.random(12)) * 2 * np.pi
    reach = rng.uniform(2, 10, 12)
    return tuple(zip(reach * np.cos(angle), reach * np.sin(angle), strict=True))


@pytest.mark.parametrize("corners", [L_SHAPE, L_SHAPE[::-1], star(0), star(1)[::-1]])
def test_depth_equals_shapelys(corners):
    area, polygon = Area(corners_m=corners), shapely.Polygon(corners)
    points = np.random.default_rng(2).uniform(-12, 45, (500, 2))
    distance = shapely.distance(polygon.exterior, shapely.points(points))
    expected = np.where(shapely.contains_xy(polygon, *points.T), distance, -distance)
    np.testing.assert_allclose(area.depth_m(points), expected, atol=1e-12)
    np.testing.assert_array_equal(area.contains(points), expected > 0)
    assert area.perimeter_m == pytest.approx(polygon.length)
    assert area.bounds_m == (polygon.bounds[0], polygon.bounds[2], polygon.bounds[1], polygon.bounds[3])


@pytest.mark.parametrize("corners", [L_SHAPE, L_SHAPE[::-1], star(3)])
def test_a_step_inwards_from_the_border_is_inside(corners):
    area = Area(corners_m=corners)
    for way in np.linspace(0.003, 1.99, 97) * area.perimeter_m:
        point, inwards = area.on_border(way)
        assert area.contains(point[None])[0]
        assert np.hypot(*inwards) == pytest.approx(1)
        assert area.depth_m(point + 1e-3 * inwards)[0] > 0 > area.depth_m(point - 1e-3 * inwards)[0]


def test_nowhere_is_not_inside():
    assert not Area(corners_m=L_SHAPE).contains([[np.nan, 1.0]])[0]


@pytest.mark.parametrize(
    ("corners", "sentence"),
    [
        (((0, 0), (1, 1), (1, 0), (0, 1)), "crosses or touches itself"),
        (((0, 0), (4, 0), (4, 4), (2, 0), (0, 4)), "crosses or touches itself"),
        (((0, 0), (2, 0), (1, 0), (1, 1)), "crosses or touches itself"),
        (((0, 0), (1, 0), (2, 0)), "crosses or touches itself"),
        (((0, 0), (1, 0), (1, 0), (0, 1)), "stand in one place"),
        (((0, 0), (1, 0)), "at least 3"),
        (((0, 0), (1, 0), (1, float("nan"))), "finite number"),
    ],
)
def test_no_polygon_is_refused(corners, sentence):
    with pytest.raises(ParameterError, match=sentence):
        Area(corners_m=corners)


def test_no_rectangle_is_refused():
    with pytest.raises(ParameterError, match="give the lower bound first"):
        Area.rectangle(1, 1, 0, 2)
    assert Area.rectangle(0, 2, 0, 1).corners_m == ((0, 0), (2, 0), (2, 1), (0, 1))


def test_corners_are_read(tmp_path):
    path = tmp_path / "area.csv"
    path.write_text("x_m,y_m\n# the hall\n0,0\n40,0\n40,10\n\n10,10\n10,40\n0,40\n0,0\n")
    assert read_area(path).corners_m == L_SHAPE
    path.write_text("0 0\n4 0\n4 4\n")
    assert read_area(path).corners_m == ((0, 0), (4, 0), (4, 4))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("0,0\n1,here\n", "line 2, column y_m: 'here' is no number"),
        ("0,0\n1,2,3\n", "line 2: has 3 cells, not 2"),
        ("0,0\n1,nan\n", "line 2, column y_m: 'nan' is no number"),
        ("0,0\n1,0\n", "at least 3"),
        ("0,0\n1,1\n1,0\n0,1\n", "crosses or touches itself"),
        ("", "at least 3"),
    ],
)
def test_bad_files_are_refused(tmp_path, text, sentence):
    path = tmp_path / "area.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=sentence):
        read_area(path)
    with pytest.raises(DataError, match="missing"):
        read_area(tmp_path / "missing.csv")
