"""The field against the exact probability that it stands for: everywhere within its tolerance, and light."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import shapely

from elusive.charts import Coast, CoastPart, ExactWater, FieldWater
from elusive.charts import _field_kernels as kernels
from elusive.errors import DataError, ParameterError
from tests.charts.shapes import CELLS, archipelago, cell, land, near, port_fourchon, star
from tests.longer import longer


def errors(coast, points, **parameters):
    """Errors of P and of its logarithm at the points that a chart covers."""
    exact = ExactWater().bind(coast)
    field = FieldWater(**parameters).bind(coast)
    points = points[exact.known(points)]
    states = np.column_stack([points[:, 0], points[:, 0], points[:, 1]])
    logs = field.log_probability(states) - exact.log_probability(states)
    return np.abs(field.probability(points) - exact.probability(points)), np.abs(logs)


@pytest.mark.parametrize("sigma", longer([1.0, 5.0, 40.0], 1.0, 40.0, marks=pytest.mark.validate))
def test_within_its_tolerance_of_exact(sigma) -> None:
    rng = np.random.default_rng(0)
    coast = archipelago(sigma=sigma)
    points = np.concatenate([near(coast, 20_000, rng, 3.0), rng.uniform(-900, 1000, (20_000, 2))])
    error, log_error = errors(coast, points)
    assert error.max() <= 1e-3
    # deep in the land too: a position there still knows the way out
    assert log_error.max() < 0.2


@pytest.mark.parametrize("tolerance", [5e-4, 1e-3, 1e-2, 5e-2])
def test_the_tolerance_that_is_asked_for(tolerance) -> None:
    coast = archipelago(1)
    error, _ = errors(coast, near(coast, 20_000, np.random.default_rng(1)), tolerance=tolerance)
    assert 0.1 * tolerance < error.max() <= tolerance


@pytest.mark.parametrize("floor", [1e-12, 0.05])
def test_the_floor_does_not_touch_the_tolerance(floor) -> None:
    coast = archipelago(1)
    error, _ = errors(coast, near(coast, 20_000, np.random.default_rng(1), 4.0), floor=floor)
    assert error.max() <= 1e-3


def test_coarser_is_lighter() -> None:
    coast = archipelago()
    fine, coarse = (FieldWater(tolerance=tolerance).bind(coast).nbytes for tolerance in (1e-3, 1e-2))
    assert coarse < 0.6 * fine


def test_between_tiles_it_is_continuous() -> None:
    coast = archipelago()
    field = FieldWater().bind(coast)
    spline = field.splines[0]
    points = near(coast, 5000, np.random.default_rng(2), 4.0)
    step = 1 / spline.per_step
    points[:, 0] = spline.x0 + np.round((points[:, 0] - spline.x0) / (8 * step)) * 8 * step
    gap = field.probability(points + np.array([1e-6, 0.0])) - field.probability(points - np.array([1e-6, 0.0]))
    # coefficients are rounded alike in both tiles; a tile left out is all water or all land to within a fraction
    assert np.abs(gap).max() < 0.7e-3


def test_near_the_border_and_where_charts_meet() -> None:
    rng = np.random.default_rng(3)
    coast = archipelago(coverage=star(rng, radius=350.0, points=12))
    error, _ = errors(coast, rng.uniform(-350, 350, (40_000, 2)))
    assert error.max() <= 1e-3
    shore = [star(rng, x, y) for x in range(-300, 301, 150) for y in range(-300, 301, 150)]
    charts = Coast.of(
        CoastPart(shore, 2.0, shapely.box(-100, -100, 100, 100)),
        CoastPart(shore, 6.0, shapely.Point(150, 0).buffer(200)),
        CoastPart(shore, 25.0),
    )
    points = rng.uniform(-600, 600, (40_000, 2))
    error, _ = errors(charts, points)
    assert error.max() <= 1e-3
    assert set(FieldWater().bind(charts).area(points)) == {0, 1, 2}


def test_what_no_chart_covers_is_unknown() -> None:
    coast = land(shapely.box(-50, -50, 50, 50), sigma=5.0, coverage=shapely.box(-60, -60, 60, 60))
    field = FieldWater(unknown=0.25).bind(coast)
    assert field.known([(0, 0), (61, 0)]).tolist() == [True, False]
    assert field.probability([(0, 0), (61, 0)]).tolist() == [0, 0.25]


def test_open_water_costs_nothing() -> None:
    island = shapely.box(-50, -50, 50, 50)
    small, wide = (
        FieldWater().bind(land(island, sigma=5.0, coverage=shapely.box(-side, -side, side, side)))
        for side in (500.0, 50_000.0)
    )
    assert len(wide.splines[0].coefficients) == len(small.splines[0].coefficients)
    assert FieldWater().bind(Coast.of(CoastPart([], 5.0))).probability([(0, 0)]).tolist() == [1]


def test_a_map_too_wide_for_its_deviation_is_refused() -> None:
    far = shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(1e6, 1e6, 1e6 + 1, 1e6 + 1)])
    with pytest.raises(DataError, match="take the exact method"):
        FieldWater().bind(land(far, sigma=1.0))


@pytest.mark.parametrize("parameters", [{"tolerance": 1e-5}, {"tolerance": 0.5}, {"floor": 0.0}, {"unknown": 0.0}])
def test_parameters_that_are_refused(parameters) -> None:
    with pytest.raises(ParameterError):
        FieldWater(**parameters)


def test_it_travels_between_processes() -> None:
    coast = archipelago()
    field = FieldWater().bind(coast)
    points = near(coast, 100, np.random.default_rng(4))
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(field)).probability(points), field.probability(points))


def test_the_kernel_is_the_spline_of_its_coefficients() -> None:
    field = FieldWater().bind(archipelago())
    spline = field.splines[0]
    points = near(field.coast, 300, np.random.default_rng(5))
    cells = (points - (spline.x0, spline.y0)) * spline.per_step
    found = np.empty(300)
    kernels.read(spline, points[:, 0], points[:, 1], np.zeros(300, np.int8), 0, found)
    for (u, v), value in zip(cells, found, strict=True):
        column, row = int(u), int(v)
        block = spline.blocks[row // 64, column // 64]
        code = spline.codes[block * 64 + row // 8 % 8 * 8 + column // 8 % 8] if block >= 0 else block
        if code < 0:
            assert value == (code == -1)
            continue
        tile = spline.coefficients.reshape(-1, kernels.SIDE, kernels.SIDE)[code]
        patch = 0.5 + kernels.QUANTUM * tile[row % 8 : row % 8 + 4, column % 8 : column % 8 + 4]
        root = basis(v - row) @ patch @ basis(u - column)
        assert value == pytest.approx(min(root**2, 1), abs=1e-12)


def basis(t):
    """Cubic B-spline at a fraction of a step past the second of four knots."""
    return np.array([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, 1 + 3 * t + 3 * t**2 - 3 * t**3, t**3]) / 6


@pytest.mark.validate
def test_a_real_cell_at_100_000_points() -> None:
    check(cell(CELLS[0]))


@pytest.mark.validate
@pytest.mark.parametrize("coast", [lambda: cell(CELLS[1]), port_fourchon], ids=[CELLS[1], "port_fourchon"])
def test_large_maps_at_100_000_points(coast) -> None:
    check(coast())


def check(coast) -> None:
    """The field is within its tolerance and light."""
    error, log_error = errors(coast, near(coast, 100_000, np.random.default_rng(6)))
    assert error.max() <= 1e-3
    assert log_error.max() < 0.2
    assert FieldWater().bind(coast).nbytes <= 200 * coast.length_m / coast.sigma_m[0]
