"""Nearest edge, grid, outline and interval against what they are by definition, and their errors as known."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.special import ndtr
from scipy.stats import norm

from elusive.charts import (
    Coast,
    CoastPart,
    ExactWater,
    FieldWater,
    GridWater,
    HardWater,
    IntervalWater,
    NearestWater,
)
from elusive.contracts import Knowledge
from elusive.errors import DataError, ParameterError
from tests.charts.shapes import CELLS, L_SHAPE, SQUARE, archipelago, cell, land, near
from tests.longer import longer
from tests.reference.water import distances, windings


@pytest.mark.parametrize("boundary", [3.0, None])
@pytest.mark.parametrize("sigma", [2.0, 15.0])
def test_nearest_is_phi_of_the_signed_distance(sigma, boundary) -> None:
    coast = archipelago(sigma=sigma)
    rng = np.random.default_rng(0)
    points = np.concatenate([near(coast, 300, rng), rng.uniform(-900, 1000, (200, 2))])
    away = distances(coast.land.edges, points) / sigma
    inland = windings(coast.land, points) == 1
    expected = ndtr(np.where(inland, -away, away))
    found = NearestWater(boundary=boundary).bind(coast).probability(points)
    certain = np.abs(away) < 3
    np.testing.assert_allclose(found[certain], expected[certain], atol=1e-12)
    np.testing.assert_allclose(found, expected, atol=1e-12 if boundary is None else ndtr(-3))


def test_nearest_meets_fewer_edges_with_the_partition() -> None:
    coast = archipelago()
    cells, whole = (NearestWater(boundary=boundary).bind(coast)._indices[0] for boundary in (3.0, None))
    assert np.diff(whole.runs, axis=1).sum(axis=0) / (len(whole.first) - 1) > 0.1 * len(coast.land.edges)
    assert np.diff(cells.runs, axis=1).sum() / (len(cells.first) - 1) < 10


def test_nearest_errs_at_the_corners_of_the_l() -> None:
    coast = land(L_SHAPE, sigma=5.0)
    points = [(12, 12), (-2, -2)]
    np.testing.assert_allclose(NearestWater().bind(coast).probability(points), [0.655, 0.714], atol=2e-3)
    np.testing.assert_allclose(ExactWater().bind(coast).probability(points), [0.446, 0.881], atol=5e-4)


def test_nearest_passes_by_the_border() -> None:
    coast = land(shapely.box(-1e3, -1e3, 1e3, 0), sigma=5.0, coverage=shapely.box(0, -500, 500, 500))
    found = NearestWater().bind(coast).probability([(0.1, -400), (0.1, -2), (0.1, 2), (0.1, 400)])
    np.testing.assert_allclose(found, [0, ndtr(-0.4), ndtr(0.4), 1], atol=1e-12)


@pytest.mark.parametrize(
    ("width", "product", "exact", "nearest"), [(50, 0.7999, 0.7887, 0.8944), (20, 0.478, 0.383, 0.691)]
)
def test_three_readings_of_a_canal(width, product, exact, nearest) -> None:
    coast = land(shapely.box(-1e4, -1e4, -width / 2, 1e4), shapely.box(width / 2, -1e4, 1e4, 1e4), sigma=20.0)
    middle = [(0.0, 0.0)]
    readings = [
        IntervalWater(lower_m=-width / 2, upper_m=width / 2, sigma_m=20.0).probability(middle)[0],
        ExactWater().bind(coast).probability(middle)[0],
        NearestWater().bind(coast).probability(middle)[0],
    ]
    np.testing.assert_allclose(readings, [product, exact, nearest], atol=5e-4)


@pytest.mark.parametrize(("look_up", "expected"), [("nearest", 0.2 / (2 * np.sqrt(2 * np.pi))), ("bilinear", 0.0008)])
def test_the_grid_errs_by_as_much_as_known(look_up, expected) -> None:
    # a shore on the boundary between cells, as in one dimension
    coast = land(shapely.box(-100, -100, 100, 0), sigma=1.0, coverage=shapely.box(-50, -50, 50, 50))
    grid = GridWater(look_up=look_up).bind(coast)
    low = grid._rasters[0].y0 - 0.1
    shifted = land(shapely.box(-100, -100, 100, low % 0.2), sigma=1.0, coverage=shapely.box(-50, -50, 50, 50))
    grid = GridWater(look_up=look_up).bind(shifted)
    y = np.linspace(-6, 6, 12_001)
    error = grid.probability(np.column_stack([np.zeros(12_001), y])) - ndtr(y - low % 0.2)
    assert np.abs(error).max() == pytest.approx(expected, rel=0.05 if look_up == "nearest" else 0.15)


@pytest.mark.parametrize("cover", longer([None, shapely.box(-250, -250, 250, 250)], None))
def test_the_grid_nears_exact(cover) -> None:
    coast = archipelago(coverage=cover)
    rng = np.random.default_rng(1)
    points = near(coast, 3000, rng)
    exact = ExactWater().bind(coast).probability(points)
    worst = [np.abs(GridWater(cell=width).bind(coast).probability(points) - exact).max() for width in (0.8, 0.4, 0.1)]
    assert worst[0] > worst[1] > worst[2]
    assert worst[2] < 0.025  # half a cell of .1 deviations, in creeks more


def test_a_grid_too_large_is_refused() -> None:
    with pytest.raises(DataError, match=r"5\d\d\d\d x 5\d\d\d\d cells of 0.2 m"):
        GridWater().bind(land(shapely.box(-5e3, -5e3, 5e3, 5e3)))


@pytest.mark.validate
def test_a_real_cell_takes_far_more_as_a_grid() -> None:
    coast = cell(CELLS[0])
    grid, field = GridWater().bind(coast), FieldWater().bind(coast)
    assert grid.nbytes > 20 * field.nbytes
    points = near(coast, 2000, np.random.default_rng(2))
    known = grid.known(points)
    assert np.abs(grid.probability(points) - ExactWater().bind(coast).probability(points))[known].max() < 0.045


def test_hard_is_inside_or_outside() -> None:
    coast = archipelago()
    points = near(coast, 1000, np.random.default_rng(3))
    np.testing.assert_array_equal(HardWater().bind(coast).probability(points), windings(coast.land, points) != 1)
    assert HardWater().bind(coast).probability([(0, 415), (0, 500)]).tolist() == [0, 1]


@pytest.mark.parametrize("model", [HardWater(), NearestWater(), GridWater(), ExactWater(), FieldWater()])
def test_every_method_keeps_the_contract(model) -> None:
    coast = archipelago(coverage=shapely.box(-250, -250, 250, 800))
    water = model.bind(coast)
    assert isinstance(water, Knowledge)
    points = np.concatenate([near(coast, 500, np.random.default_rng(4)), [[900, 900]]])
    before = points.copy()
    found = water.probability(points)
    assert ((found >= 0) & (found <= 1)).all()
    assert not water.known(points)[-1]
    assert found[-1] == 1
    states = np.insert(points, 1, 7.0, axis=1)
    np.testing.assert_allclose(water.log_probability(states), np.log(1e-6 + (1 - 1e-6) * found), atol=1e-12)
    assert water.log_probability(np.empty((0, 4))).shape == (0,)
    np.testing.assert_array_equal(points, before)
    assert water.nbytes > 0
    assert type(model).from_yaml.__self__ is type(model)
    assert type(model)(**model.model_dump()) == model


@pytest.mark.parametrize("model", [HardWater, NearestWater, GridWater, ExactWater, FieldWater])
def test_a_position_takes_the_imprecision_of_its_area(model) -> None:
    shore = shapely.box(-1e3, -1e3, 1e3, 0)
    coast = Coast.of(
        CoastPart(shore, 2.0, shapely.box(0, -100, 100, 100)),
        CoastPart(shore, 20.0, shapely.box(-200, -200, 200, 200)),
    )
    water = model().bind(coast)
    found = water.probability([(50, 3), (-50, 3), (50, -3), (-50, -3)])
    expected = [1, 1, 0, 0] if model is HardWater else ndtr([1.5, 0.15, -1.5, -0.15])
    np.testing.assert_allclose(found, expected, atol=0.0405 if model is GridWater else 1e-3)


@pytest.mark.parametrize(
    ("mu", "sigma", "expected", "digits"),
    [
        (-26, 20, -25.02, 0.01),
        (-26, 7, -23.592, 5e-4),
        (-26, 7.04, -23.6, 5e-3),
        (-35, 7, -30.25, 0.01),
        (-35, 20, -33.64, 0.01),
    ],
)
def test_the_canal_s_map_estimates(mu, sigma, expected, digits) -> None:
    x = np.arange(-60, 0, 1e-4)
    states = np.column_stack([x, np.zeros((len(x), 3))])
    posterior = norm.logpdf(x, mu, 5) + IntervalWater(sigma_m=sigma).log_probability(states)
    assert x[posterior.argmax()] == pytest.approx(expected, abs=digits)


def test_a_hard_canal() -> None:
    x = np.arange(-60, 0, 1e-3)
    states = np.column_stack([x, np.zeros((len(x), 3))])
    posterior = norm.logpdf(x, -26, 5) + IntervalWater(sigma_m=0).log_probability(states)
    assert x[posterior.argmax()] == pytest.approx(-25, abs=2e-3)
    assert IntervalWater(sigma_m=0).probability([(-25, 0), (-25.1, 0), (25, 9)]).tolist() == [1, 0, 1]


def test_a_canal_with_a_bank_of_another_deviation_along_y() -> None:
    canal = IntervalWater(lower_m=-10, upper_m=30, sigma_m=5, upper_sigma_m=50, component="y")
    points = np.array([[500.0, -12.0], [0.0, 10.0], [-9.0, 35.0]])
    expected = ndtr((points[:, 1] + 10) / 5) * ndtr((30 - points[:, 1]) / 50)
    np.testing.assert_allclose(canal.probability(points), expected, rtol=1e-12)
    states = np.array([[0.0, 0.0, 1e4, 0.0]])
    assert np.isfinite(canal.log_probability(states)).all()


def test_bounds_in_the_wrong_order_are_refused() -> None:
    with pytest.raises(ParameterError, match="lower_m: must lie below upper_m"):
        IntervalWater(lower_m=5, upper_m=5)


def test_two_polygons_on_top_of_each_other_are_no_double_land() -> None:
    coast = land(SQUARE, SQUARE, SQUARE)
    for model in (GridWater(cell=0.1), ExactWater(), FieldWater()):
        assert model.bind(coast).probability([(0, 0)])[0] == pytest.approx(1 - 0.4660649, abs=2e-3)
