"""Several charts over each other, and what a draught leaves."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
import shapely

from elusive.charts import HardWater
from elusive.charts.charted_area import ChartedAreaParameters, barred, lay_charts, read_charts, too_shallow
from elusive.errors import DataError, ParameterError
from elusive.geometry.local_frame import LocalFrame

from .scenes import FRAME, cell_path, drawn, real_cell
from .test_outlines import LAND, write

SEA = shapely.box(-5000, -5000, 5000, 5000)
INSET = shapely.box(0, 0, 2000, 2000)


def test_the_finer_chart_wins_where_two_overlap():
    coarse = drawn("coarse", [shapely.box(-3000, -3000, 1000, 1000)], SEA, 80_000)
    fine = drawn("fine", [shapely.box(0, 0, 1500, 500)], INSET, 12_000)
    scene = lay_charts([coarse, fine], ChartedAreaParameters(imprecision={"coast_sigma_m": 5}), FRAME)
    assert [chart.name for chart in scene.charts] == ["fine", "coarse"]
    assert scene.coast.area_m2 == pytest.approx(16e6 - 1e6 + 0.75e6, rel=1e-5)
    water = HardWater().bind(scene.coast)
    places = np.array([[500, 750], [1200, 250], [-500, -500], [4000, 4000], [9000, 0]])
    assert water.area(places).tolist() == [0, 0, 1, 1, -1]
    assert water.known(places).tolist() == [True, True, True, True, False]
    np.testing.assert_allclose(water.probability(places)[:4], [1, 0, 0, 1])


def test_each_chart_has_its_own_imprecision():
    island = shapely.Point(0, 0).buffer(300)
    fine = drawn("fine", [island], INSET.buffer(500), 12_000, zones=[SEA], catzoc=np.array([1]))
    coarse = drawn(
        "coarse", [island, shapely.box(3000, -300, 3300, 300)], SEA, 80_000, zones=[SEA], catzoc=np.array([3])
    )
    scene = lay_charts([coarse, fine], frame=FRAME)
    assert scene.coast.sigma_m.tolist() == [3.6, 24]  # .3 mm on paper
    scene = lay_charts([coarse, fine], ChartedAreaParameters(imprecision={"coast_sigma_m": 9}), FRAME)
    assert scene.coast.sigma_m.tolist() == [9, 9]


def test_a_known_bias_is_taken_off_the_chart():
    """A chart that stands 30 m east and 40 m south of the truth."""
    chart = drawn("off", [shapely.box(30, -40, 530, 460)], shapely.box(-970, -1040, 1030, 960), 12_000)
    parameters = ChartedAreaParameters(imprecision={"coast_sigma_m": 5}, bias_east_m=30, bias_north_m=-40)
    coast = lay_charts([chart], parameters, FRAME).coast
    assert coast.land.vertices.min(axis=0) == pytest.approx([0, 0], abs=1e-3)
    assert coast.land.vertices.max(axis=0) == pytest.approx([500, 500], abs=1e-3)
    assert coast.bounds == pytest.approx((-1000, -1000, 1000, 1000), abs=0.2)  # a parallel is no straight line
    with pytest.raises(ParameterError, match="bias_east_m: must be a finite number"):
        ChartedAreaParameters(bias_east_m=np.inf)


DEPTHS = {
    "depths": [shapely.box(1000 * n, 0, 1000 * (n + 1), 1000) for n in range(4)],
    "depth_range_m": np.array([[-0.5, 0.0], [2.0, 5.0], [5.0, 10.0], [np.nan, np.nan]]),
}


@pytest.mark.parametrize(
    ("draught", "level", "shoals", "ruled_out"),
    [
        (0.0, 0.0, "certain", []),
        (0.0, 0.0, "possible", []),
        (3.0, 0.0, "certain", [0]),
        (3.0, 0.0, "possible", [0, 1, 3]),
        (5.0, 0.0, "certain", [0]),
        (5.0, 0.0, "possible", [0, 1, 3]),
        (5.1, 0.0, "certain", [0, 1]),
        (5.1, 0.0, "possible", [0, 1, 2, 3]),
        (5.1, 3.2, "possible", [0, 3]),
        (11.0, 0.0, "certain", [0, 1, 2]),
        (0.5, 1.0, "certain", []),
    ],
)
def test_a_draught_rules_out_depths(draught, level, shoals, ruled_out):
    chart = drawn("sea", [shapely.box(-1000, 0, 0, 1000)], SEA, **DEPTHS)
    parameters = ChartedAreaParameters(draught_m=draught, water_level_m=level, shoals=shoals)
    found = too_shallow(chart, parameters)
    assert [number for number, shape in enumerate(chart.depths) if shape in found] == ruled_out
    coast = lay_charts([chart], parameters, FRAME).coast
    assert coast.area_m2 == pytest.approx(1e6 * (1 + len(ruled_out)), rel=1e-5)


def test_land_drawn_as_points_and_lines_has_a_width():
    islets = [shapely.Point(0, 0), shapely.LineString([(1000, 0), (2000, 0)])]
    chart = drawn("sea", [], SEA, 80_000, islets=islets)
    land = shapely.union_all(barred(chart, FRAME, ChartedAreaParameters()))
    radius = 0.15e-3 * 80_000
    circle = shapely.Point(0, 0).buffer(radius, quad_segs=4).area
    assert land.area == pytest.approx(2 * circle + 1000 * 2 * radius, rel=1e-4)
    assert not barred(chart, FRAME, ChartedAreaParameters(islet_mm=0))


@pytest.mark.validate
def test_real_cells_together():
    fine, coarse = real_cell("US5MD1MC"), real_cell("US4MD81M")
    parameters = ChartedAreaParameters(imprecision={"coast_sigma_m": 8.2})
    scene = lay_charts([coarse, fine], parameters)
    frame = scene.frame
    coverage = shapely.union_all(frame.project(fine.coverage))
    places = np.random.default_rng(6).uniform(*np.reshape(coverage.bounds, (2, 2)), (20_000, 2))
    places = places[shapely.contains_xy(coverage.buffer(-1), *places.T)]
    land = shapely.union_all(barred(fine, frame, parameters))
    water = HardWater().bind(scene.coast).probability(places) > 0.5
    np.testing.assert_array_equal(water, ~shapely.contains_xy(land, *places.T))
    elsewhere = shapely.difference(shapely.union_all(barred(coarse, frame, parameters)), coverage)
    elsewhere = shapely.intersection(elsewhere, shapely.union_all(frame.project(coarse.coverage)))
    expected = elsewhere.area + shapely.intersection(land, coverage).area
    assert scene.coast.area_m2 == pytest.approx(expected, rel=1e-7)
    assert scene.coast.length_m == pytest.approx(2119e3, rel=2e-3)


@pytest.mark.validate
def test_the_coast_of_a_real_cell_is_its_edges():
    chart = real_cell("US5MD1MC")
    scene = lay_charts([chart], ChartedAreaParameters(islet_mm=0))
    edges = shapely.length(scene.frame.project(chart.edges)).sum()
    assert scene.coast.length_m == pytest.approx(edges, rel=2e-3)
    assert {20.4, 40.8, 204.0, 408.0} < set(scene.coast.sigma_m.tolist())


@pytest.mark.thorough
def test_a_real_draught():
    chart = real_cell("US5MD1MC")
    frame = LocalFrame.about([chart])
    areas = [
        shapely.union_all(barred(chart, frame, ChartedAreaParameters(draught_m=draught, shoals=shoals))).area
        for draught, shoals in [(0, "certain"), (2, "certain"), (2, "possible"), (6, "certain"), (6, "possible")]
    ]
    assert areas == sorted(areas)
    assert areas[-1] > 1.5 * areas[0]


def test_charts_are_read_finest_first(tmp_path):
    outline = write(tmp_path / "a.geojson", LAND)
    charts = read_charts(outline, cell_path("US4MD81M"), cell_path("US5MD1MC"))
    assert [chart.scale for chart in charts] == [12_000, 80_000, None]


def test_what_cannot_be_laid_together_is_refused(tmp_path):
    outline = write(tmp_path / "a.geojson", LAND)
    with pytest.raises(DataError, match="none was given"):
        read_charts()
    with pytest.raises(DataError, match="given twice"):
        read_charts(outline, tmp_path / "." / "a.geojson")
    with pytest.raises(ParameterError, match="draught_m"):
        ChartedAreaParameters(draught_m=-1)
    with pytest.raises(DataError, match="from their middle"):
        lay_charts([drawn("a", [], SEA), drawn("b", [], shapely.box(1.1e6, 0, 1.2e6, 1000))])


def test_a_folder_is_its_cells(tmp_path):
    root = tmp_path / "ENC_ROOT"
    shutil.copytree(cell_path("US5AK5SI").parent, root / "US5AK5SI")
    (chart,) = read_charts(root)
    assert chart.name == "US5AK5SI"
    (tmp_path / "empty").mkdir()
    with pytest.raises(DataError, match="holds no S-57 base cell"):
        read_charts(tmp_path / "empty")
