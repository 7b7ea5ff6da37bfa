"""Imprecision from CATZOC and QUAPOS, and the areas where it holds."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from elusive.charts import FieldWater
from elusive.charts.charted_area import lay_charts
from elusive.charts.quality import FALL_M, Imprecision, QualityArea, coast_sigma, graded, quality_areas
from elusive.errors import ParameterError
from elusive.geometry.local_frame import LocalFrame

from .scenes import FRAME, drawn, real_cell

SEA = shapely.box(-5000, -5000, 5000, 5000)


def test_limits_of_95_percent_in_two_dimensions():
    stated = np.array([5.0, 20.0, 50.0, 500.0])  # S-57, CATZOC A1 to C
    one_axis = stated / np.sqrt(-2 * np.log(0.05))
    sigma = Imprecision().of(np.arange(1, 5), np.zeros(4, np.int64))
    np.testing.assert_allclose(sigma, one_axis, rtol=5e-3)


def test_what_has_no_limit_takes_that_of_c():
    sigma = Imprecision().of(np.array([4, 5, 6, 0, 99]), np.zeros(5, np.int64))
    assert sigma.tolist() == [204.0] * 5


def test_low_accuracy_of_the_coast_itself():
    sigma = Imprecision(low_accuracy_factor=3).of(np.full(5, 1), np.array([0, 1, 4, 10, 11]))
    np.testing.assert_allclose(sigma, [2.04, 2.04, 6.12, 2.04, 2.04])


def test_a_coast_is_no_better_than_it_is_drawn():
    grades, good = np.arange(1, 7), np.zeros(6, np.int64)
    assert Imprecision().of(grades, good, 80_000).tolist() == [24, 24, 24, 204, 204, 204]
    assert Imprecision().of(np.array([1, 1, 3]), np.array([0, 4, 4]), 12_000).tolist() == [3.6, 4.08, 40.8]
    assert Imprecision(drawn_mm=0.5).of(grades[:1], good[:1], 80_000) == 40
    assert Imprecision(coast_sigma_m=7).of(grades, good, 80_000).tolist() == [7] * 6
    for told, scale in [({"drawn_mm": 0}, 80_000), ({}, None)]:
        assert Imprecision(**told).of(grades[:3], good[:3], scale).tolist() == [2.04, 8.2, 20.4]


def test_what_the_caller_knows_goes_before():
    assert Imprecision(coast_sigma_m=7).of(np.array([1, 4, 6]), np.array([0, 4, 0])).tolist() == [7, 7, 7]
    with pytest.raises(ParameterError, match="coast_sigma_m"):
        Imprecision(coast_sigma_m=0)
    with pytest.raises(ParameterError, match="low_accuracy_factor"):
        Imprecision(low_accuracy_factor=0.5)


def test_a_position_has_the_imprecision_of_the_nearest_coast():
    rng = np.random.default_rng(3)
    islands = [shapely.Point(x, y).buffer(400) for x in range(-4000, 4001, 2000) for y in range(-4000, 4001, 2000)]
    grade = rng.integers(1, 7, len(islands))
    quapos = rng.choice([0, 4], len(islands))
    zones = [island.buffer(100) for island in islands]
    chart = drawn("sea", islands, SEA, zones=zones, catzoc=grade, edge_quality=quapos)
    areas = quality_areas(chart, FRAME, Imprecision())
    expected = Imprecision().of(grade, quapos)
    values = [area.sigma_m for area in areas]
    assert values == sorted(values)

    places = rng.uniform(-4900, 4900, (2000, 2))
    distance = shapely.distance(shapely.points(places)[:, None], np.array([s.boundary for s in islands])[None])
    first, second = np.sort(distance, axis=1)[:, :2].T
    clear = second - first > 300  # the split is drawn by places 200 m apart
    inside = np.column_stack([shapely.contains_xy(area.area, *places.T) for area in areas])
    np.testing.assert_array_equal(inside.sum(axis=1), 1)
    assert clear.mean() > 0.6
    found = np.array(values)[inside.argmax(axis=1)]
    # as sure as the nearest coast, or less where a worse one is near
    nearest = expected[distance.argmin(axis=1)]
    assert (found[clear] >= nearest[clear] / 1.25).all()
    far = second - first > 300 + 2 * FALL_M * np.log(expected.max() / expected.min())
    assert far.sum() > 20
    assert (found[far] == nearest[far]).mean() > 0.97  # borders are drawn roughly


@pytest.mark.thorough
@pytest.mark.parametrize("cell", ["US5AK5SI", pytest.param("US5MD1MC", marks=pytest.mark.validate)])
def test_nothing_steps_where_zones_of_a_real_chart_meet(cell):
    chart = real_cell(cell)
    frame = LocalFrame.about([chart])
    coast = lay_charts([chart], None, frame).coast
    water, rng = FieldWater().bind(coast), np.random.default_rng(0)
    shore = coast.land.vertices
    here = shore[rng.integers(len(shore), size=100_000)] + rng.normal(0.0, 150.0, (100_000, 2))
    there = here + np.array([1.0, 0.0])
    first, second = water.area(here), water.area(there)
    across = (first != second) & (first >= 0) & (second >= 0)
    assert across.sum() > 200
    ratio = coast.sigma_m[first[across]] / coast.sigma_m[second[across]]
    assert np.abs(np.log(ratio)).max() < np.log(1.25)  # 20 without grades
    # a factor of 1.25 changes P(water) by .242 ln 1.25 at one coast, by twice that at two; a metre by some .02
    step = np.abs(water.probability(here) - water.probability(there))[across]
    assert step.max() < 2 * 0.242 * np.log(1.25) + 0.02


def test_a_deviation_falls_off_from_the_less_certain_area():
    left, right = shapely.box(0, 0, 5000, 1000), shapely.box(5000, 0, 10_000, 1000)
    areas = graded([QualityArea(2.0, left), QualityArea(200.0, right)])
    x = np.linspace(1, 9999, 500)
    inside = np.column_stack([shapely.contains_xy(area.area, x, np.full_like(x, 500.0)) for area in areas])
    np.testing.assert_array_equal(inside.sum(axis=1), 1)
    found = np.array([area.sigma_m for area in areas])[inside.argmax(axis=1)]
    expected = np.where(x > 5000, 200.0, np.maximum(2.0, 200 * np.exp(-(5000 - x) / FALL_M)))
    np.testing.assert_allclose(np.log(found), np.log(expected), atol=np.log(1.25))
    assert found[0] == 2.0
    assert found[-1] == 200.0
    assert graded([areas[0]]) == [areas[0]]


def test_areas_fill_the_coverage():
    chart = real_cell("US5MD1MC")
    frame = LocalFrame.about([chart])
    areas = quality_areas(chart, frame, Imprecision())
    covered = shapely.union_all(frame.project(chart.coverage)).area
    assert sum(area.area.area for area in areas) == pytest.approx(covered, rel=1e-9)
    assert shapely.union_all([area.area for area in areas]).area == pytest.approx(covered, rel=1e-9)
    values = {area.sigma_m for area in areas}
    assert {20.4, 40.8, 204.0, 408.0} < values  # that of 3.6 m is within reach of worse ones
    assert min(values) < 20.4 / 1.25


def test_a_coast_without_zones_is_unassessed_and_a_sea_without_coast_too():
    chart = drawn("sea", [shapely.box(0, 0, 100, 100)], SEA)
    assert coast_sigma(chart, FRAME, Imprecision())[1].tolist() == [204.0]
    open_sea = drawn("sea", [], SEA)
    (area,) = quality_areas(open_sea, FRAME, Imprecision(sigma_u_m=50))
    assert area.sigma_m == 50
    assert area.area.area == pytest.approx(1e8, rel=1e-5)
