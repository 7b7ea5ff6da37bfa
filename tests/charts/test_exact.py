"""Exact P(water) against Owen's T summed over every edge, published values and counted draws."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr

from elusive.charts import Coast, CoastPart, ExactWater
from elusive.charts._exact_kernels import _angle
from elusive.errors import DataError
from tests.charts.shapes import (
    CELLS,
    L_SHAPE,
    SQUARE,
    archipelago,
    cell,
    land,
    near,
    pair,
    port_fourchon,
    shapely_land,
    star,
)
from tests.longer import longer
from tests.reference.water import drawn, land_mass, water_probability


def test_the_square() -> None:
    found = 1 - ExactWater().bind(land(SQUARE)).probability([(0, 0), (1, 1), (3, 0)])
    np.testing.assert_allclose(found, [0.4660649, 0.2277674, 0.0155097], atol=1e-7)
    side = ndtr(1) - ndtr(-1)
    assert found[0] == pytest.approx(side**2, abs=1e-8)


def test_the_l_shape() -> None:
    found = 1 - ExactWater().bind(land(L_SHAPE, sigma=5.0)).probability([(5, 5), (12, 12), (20, 20)])
    np.testing.assert_allclose(found, [0.68269, 0.55409, 0.04492], atol=5e-6)


def test_a_straight_coast_is_the_normal_distribution() -> None:
    water = ExactWater().bind(land(shapely.box(-1e4, -1e4, 1e4, 0), sigma=7.0))
    north = np.linspace(-50, 50, 401)
    found = water.probability(np.column_stack([np.full(401, 12.3), north]))
    np.testing.assert_allclose(found, ndtr(north / 7), atol=1e-8)


def test_three_readings_of_a_canal() -> None:
    canal = [shapely.box(-1e4, -1e4, -25, 1e4), shapely.box(25, -1e4, 1e4, 1e4)]
    assert ExactWater().bind(land(*canal, sigma=20.0)).probability([(0, 0)])[0] == pytest.approx(0.7887, abs=5e-5)
    assert ExactWater().bind(land(*canal, sigma=50.0)).probability([(0, 0)])[0] == pytest.approx(0.3829, abs=5e-5)


@pytest.mark.parametrize("sigma", longer([0.5, 5.0, 40.0, 500.0], 0.5, 40.0))
def test_islands_holes_and_creeks(sigma) -> None:
    coast = archipelago(sigma=sigma)
    rng = np.random.default_rng(0)
    vertices, edges = coast.land.vertices, coast.land.edges
    points = np.concatenate(
        [
            near(coast, 150, rng),
            rng.uniform(-700, 900, (100, 2)),
            vertices[rng.integers(len(vertices), size=100)] + rng.normal(scale=1e-6, size=(100, 2)),
            rng.uniform([-500, 599], [500, 605], (50, 2)),
            (edges[:100, :2] + edges[:100, 2:]) / 2,
        ]
    )
    found = ExactWater().bind(coast).probability(points)
    moved = np.concatenate([points[:-100], points[-100:] + 1e-9])  # the sum is not defined on an edge
    np.testing.assert_allclose(found, water_probability(coast, moved), atol=3e-8)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), log_sigma=st.floats(-1, 3), x=st.floats(-5e6, 5e6), size=st.floats(0, 4))
def test_any_place_and_size(seed, log_sigma, x, size) -> None:
    rng = np.random.default_rng(seed)
    coast = land(star(rng, x, -x, radius=10**size, points=int(rng.integers(3, 50))), sigma=10**log_sigma)
    points = near(coast, 30, rng)
    found = ExactWater().bind(coast).probability(points)
    # so far out, 1e-9 m is a coordinate's last digit
    np.testing.assert_allclose(found, water_probability(coast, points), atol=3e-8 + 1e-9 / 10**log_sigma)


def test_on_vertices_and_edges_it_is_continuous() -> None:
    coast = archipelago()
    water = ExactWater().bind(coast)
    edges = coast.land.edges
    for points in (coast.land.vertices, (edges[:, :2] + edges[:, 2:]) / 2, 0.9 * edges[:, :2] + 0.1 * edges[:, 2:]):
        here = water.probability(points)
        for angle in np.arange(8) * np.pi / 4 + 0.1:
            step = 1e-7 * np.array([np.cos(angle), np.sin(angle)])
            np.testing.assert_allclose(water.probability(points + step), here, atol=3e-8)
            np.testing.assert_allclose(water.probability(points + 1e-4 * step), here, atol=3e-8)


def test_across_the_index_cells_it_is_continuous() -> None:
    coast = archipelago()
    water = ExactWater().bind(coast)
    index = water.indices[0][0]
    rng = np.random.default_rng(3)
    points = near(coast, 4000, rng)
    width = 1 / index.per_cell
    points[:, 0] = index.x0 + np.round((points[:, 0] - index.x0) / width) * width
    there = water.probability(points + np.array([1e-9 * width, 0.0]))
    np.testing.assert_allclose(water.probability(points - np.array([1e-9 * width, 0.0])), there, atol=3e-8)
    np.testing.assert_allclose(water.probability(points), there, atol=3e-8)


def test_vertices_on_a_lattice_and_the_positions_too() -> None:
    rng = np.random.default_rng(4)
    blocks = [shapely.box(x, y, x + 1, y + 1) for x, y in rng.integers(0, 12, (60, 2))]
    blocks += [shapely.Polygon([(x, y), (x + 2, y), (x, y + 2)]) for x, y in rng.integers(0, 12, (10, 2))]
    coast = land(*blocks, sigma=1.0)
    points = np.stack(np.meshgrid(np.arange(-2, 16, 0.5), np.arange(-2, 16, 0.5)), axis=-1).reshape(-1, 2)
    found = ExactWater().bind(coast).probability(points)
    np.testing.assert_allclose(found, water_probability(coast, points + np.array([1.1e-9, 0.7e-9])), atol=3e-8)


@pytest.mark.parametrize("place", [(5.0, 5.0), (12.0, 12.0), (0.0, 0.0), (-4.0, 20.0)])
def test_draws_fall_on_land_as_often(place) -> None:
    coast = land(L_SHAPE, sigma=5.0)
    polygon = shapely_land(coast)
    shapely.prepare(polygon)
    share, error = drawn(lambda x, y: shapely.contains_xy(polygon, x, y), place, 5.0, 200_000, np.random.default_rng(5))
    assert 1 - ExactWater().bind(coast).probability([place])[0] == pytest.approx(share, abs=4 * error)


def test_a_coast_that_meets_the_border_is_not_bent() -> None:
    whole = land(shapely.box(-1e3, -1e3, 1e3, 0), sigma=5.0)
    cut = land(shapely.box(-1e3, -1e3, 1e3, 0), sigma=5.0, coverage=shapely.box(0, -500, 500, 500))
    x, y = np.meshgrid([0.0, 1.0, 4.0, 20.0, 100.0], np.linspace(-20, 20, 21))
    points = np.column_stack([x.ravel(), y.ravel()])
    found = ExactWater().bind(cut).probability(points)
    np.testing.assert_allclose(found, ExactWater().bind(whole).probability(points), atol=5e-8)
    inland = ExactWater().bind(cut).probability([(0.0, -250.0), (250.0, -500.0), (0.0, -500.0)])
    np.testing.assert_allclose(inland, 0, atol=5e-8)


def test_near_a_ragged_border_only_what_is_covered_counts() -> None:
    coast = archipelago(coverage=star(np.random.default_rng(6), radius=300.0))
    water = ExactWater().bind(coast)
    rng = np.random.default_rng(7)
    points = np.concatenate([near(coast, 300, rng), rng.uniform(-300, 300, (200, 2))])
    known = water.known(points)
    assert 50 < known.sum() < 450
    found = water.probability(points)
    np.testing.assert_allclose(found[known], water_probability(coast, points[known]), atol=2e-7)
    assert (found[~known] == 1).all()


def test_where_two_charts_meet_each_position_has_its_own_imprecision() -> None:
    shore = shapely.box(-1e3, -1e3, 1e3, 0)
    fine = CoastPart(shore, 2.0, shapely.box(0, -500, 500, 500))
    coarse = CoastPart(shore, 20.0, shapely.box(-500, -500, 500, 500))
    water = ExactWater(unknown=0.5).bind(Coast.of(fine, coarse))
    y = np.linspace(-30, 30, 31)
    for x, sigma in ((1.0, 2.0), (250.0, 2.0), (-1.0, 20.0), (-300.0, 20.0)):
        found = water.probability(np.column_stack([np.full(31, x), y]))
        np.testing.assert_allclose(found, ndtr(y / sigma), atol=5e-8)
    assert water.probability([(600.0, -600.0)]).tolist() == [0.5]
    assert water.log_probability(np.array([[600.0, 0, -600.0, 0]]))[0] == pytest.approx(np.log(0.5), abs=1e-5)


def test_log_probability_is_of_columns_x_and_y_and_has_a_floor() -> None:
    coast = archipelago()
    water = ExactWater(floor=1e-4).bind(coast)
    points = near(coast, 200, np.random.default_rng(8))
    states = np.column_stack([points[:, 0], np.full(200, 9.0), points[:, 1], np.full(200, -9.0), np.zeros(200)])
    expected = np.log(1e-4 + (1 - 1e-4) * water.probability(points))
    np.testing.assert_allclose(water.log_probability(states), expected, atol=1e-12)
    deep = ExactWater(floor=1e-4).bind(land(shapely.box(-500, -500, 500, 500), sigma=5.0))
    assert deep.log_probability(np.zeros((3, 4))).tolist() == pytest.approx([np.log(1e-4)] * 3)


def test_without_land_all_is_water() -> None:
    for coverage in (None, shapely.box(-10, -10, 10, 10)):
        water = ExactWater(unknown=0.2).bind(Coast.of(CoastPart([], 5.0, coverage)))
        assert water.probability([(0, 0), (9, 9), (90, 9)]).tolist() == [1, 1, 1 if coverage is None else 0.2]


@pytest.mark.parametrize(
    ("points", "message"), [(np.zeros(3), "must be"), (np.zeros((2, 4)), "must be"), ([[0, 0], [np.nan, 1]], "row 1")]
)
def test_points_that_are_refused(points, message) -> None:
    with pytest.raises(DataError, match=message):
        ExactWater().bind(land(SQUARE)).probability(points)


def test_the_angle() -> None:
    rng = np.random.default_rng(9)
    y, x = np.abs(rng.normal(size=2000)) * 10 ** rng.uniform(-9, 3, 2000), rng.normal(size=2000)
    found = [_angle(*pair) for pair in zip(y, x, strict=True)]
    np.testing.assert_allclose(found, np.arctan2(y, x), atol=1e-12)
    assert [_angle(0.0, 1.0), _angle(0.0, 0.0), _angle(0.0, -1.0)] == [0, 0, np.pi]


@pytest.mark.parametrize("name", longer(CELLS, "US4MD81M", marks=pytest.mark.validate))
def test_real_cells(name) -> None:
    check(cell(name), 40)


@pytest.mark.validate
def test_where_two_real_cells_overlap() -> None:
    (fine, covered), (coarse, around) = pair()
    coast = Coast.of(CoastPart(fine, 8.2, covered), CoastPart(coarse, 20.4, around))
    water = ExactWater().bind(coast)
    inner = covered.buffer(-50)
    ring = shapely.get_coordinates(shapely.intersection(shapely.union_all(fine).boundary, inner))
    rng = np.random.default_rng(12)
    points = ring[rng.integers(len(ring), size=2000)] + rng.normal(scale=8.2, size=(2000, 2))
    points = points[water.area(points) == 0]
    alone = ExactWater().bind(land(*fine, sigma=8.2, coverage=covered)).probability(points)
    np.testing.assert_allclose(water.probability(points), alone, atol=3e-8)
    # what laying one over the other would do
    heap = ExactWater().bind(land(*fine, *coarse, sigma=8.2, coverage=around)).probability(points)
    assert 0.1 < (np.abs(heap - alone) > 0.1).mean() < 0.3
    edge = shapely.get_coordinates(shapely.segmentize(covered.boundary, 50.0))
    edge = edge[rng.integers(len(edge), size=60)] + rng.normal(scale=20.0, size=(60, 2))
    for area in (0, 1):
        here = edge[water.area(edge) == area]
        np.testing.assert_allclose(water.probability(here), water_probability(coast, here, area), atol=1e-7)


@pytest.mark.validate
def test_port_fourchon() -> None:
    check(port_fourchon(), 60)


@pytest.mark.validate
@pytest.mark.parametrize("name", CELLS)
def test_real_cells_at_ten_thousand_points(name) -> None:
    check(cell(name), 10_000)


@pytest.mark.validate
def test_draws_near_real_coasts() -> None:
    coast = cell(CELLS[0])
    water, polygon = ExactWater().bind(coast), shapely_land(coast)
    shapely.prepare(polygon)
    rng = np.random.default_rng(11)
    points = near(coast, 40, rng)
    inland = np.abs(points).max(axis=1) < 3000  # away from the border
    for point, found in zip(points[inland], water.probability(points)[inland], strict=True):
        share, error = drawn(lambda x, y: shapely.contains_xy(polygon, x, y), point, 8.2, 2_000_000, rng)
        assert 1 - found == pytest.approx(share, abs=4.5 * error)


def check(coast, n) -> None:
    """The exact probability is the sum over every edge, and light."""
    water = ExactWater().bind(coast)
    points = near(coast, n, np.random.default_rng(10))
    known = water.known(points)
    found = water.probability(points)[known]
    np.testing.assert_allclose(found, water_probability(coast, points[known]), atol=1e-7)
    assert 0.2 < found.mean() < 0.8
    assert water.nbytes / len(coast.land.vertices) < 300


def test_the_twin_itself() -> None:
    coast = land(shapely.box(-1e5, -1e5, 1e5, 0), sigma=3.0)
    points = np.array([[1.0, 2.0], [0.0, -4.0]])
    np.testing.assert_allclose(land_mass(coast.land.edges, points, 3.0), ndtr(-points[:, 1] / 3), atol=1e-14)
