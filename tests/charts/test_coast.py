"""Land united from charts: orientation, areas, borders; winding numbers against counted crossings."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from elusive.charts import Coast, CoastPart, HardWater
from elusive.charts._index_kernels import cells_at, inside
from elusive.charts.coast import edge_lengths, rings_of
from elusive.charts.index import index_edges
from elusive.errors import DataError, ParameterError
from tests.charts.shapes import SQUARE, archipelago, land, near, star
from tests.reference.water import windings


def test_land_lies_on_the_left() -> None:
    coast = land(shapely.box(0, 0, 10, 10) - shapely.box(2, 2, 4, 4), shapely.box(20, 0, 21, 1))
    assert coast.area_m2 == pytest.approx(100 - 4 + 1)
    assert coast.length_m == pytest.approx(40 + 8 + 4)
    assert coast.bounds == (0, 0, 21, 10)
    assert len(coast.land.edges) == 12
    assert len(coast.land.starts) == 4
    assert edge_lengths(coast.land).sum() == pytest.approx(52)
    x0, y0, x1, y1 = coast.land.edges.T
    left = np.column_stack([(x0 + x1) / 2 - 1e-3 * np.sign(y1 - y0), (y0 + y1) / 2 + 1e-3 * np.sign(x1 - x0)])
    assert (windings(coast.land, left) == 1).all()


def test_charts_on_top_of_each_other_count_once() -> None:
    one = land(SQUARE)
    two = Coast.of(CoastPart([SQUARE, SQUARE], 1.0, None))
    both = Coast.of(CoastPart(SQUARE, 1.0, SQUARE.buffer(3)), CoastPart(SQUARE, 1.0, SQUARE.buffer(3)))
    assert one.area_m2 == two.area_m2 == pytest.approx(4)
    assert both.area_m2 == pytest.approx(4)
    assert len(both.sigma_m) == 1


def test_the_finer_chart_wins() -> None:
    fine = CoastPart(shapely.box(0, 0, 4, 10), 1.0, shapely.box(0, 0, 10, 10))
    coarse = CoastPart(shapely.box(0, 0, 30, 2), 9.0, shapely.box(0, 0, 30, 10))
    coast = Coast.of(fine, coarse)
    assert coast.area_m2 == pytest.approx(40 + 20 * 2)
    water = HardWater(unknown=0.3).bind(coast)
    points = [(2, 5), (6, 1), (12, 1), (12, 5), (40, 1)]
    assert water.probability(points).tolist() == [0, 1, 0, 1, 0.3]
    assert water.area(points).tolist() == [0, 0, 1, 1, -1]
    assert water.known(points).tolist() == [True, True, True, True, False]
    assert water.area([(10, 5), (10, 7.3)]).tolist() == [0, 0]  # on the border of both
    everywhere = HardWater().bind(Coast.of(fine, CoastPart(shapely.box(0, 0, 30, 2), 9.0)))
    assert everywhere.area(points).tolist() == [0, 0, 1, 1, 1]
    assert everywhere.probability(points).tolist() == [0, 1, 0, 1, 1]


def test_land_that_ends_with_the_chart_is_no_coast() -> None:
    coast = land(shapely.box(-5, -5, 5, 5), coverage=shapely.box(0, -20, 20, 20))
    assert coast.area_m2 == pytest.approx(50)
    assert coast.length_m == pytest.approx(20)
    assert coast.land.vertices[:-1][coast.on_border[:-1]].tolist() == [[0, 5]]


@pytest.mark.parametrize("off_m", [0.0, 0.03])
def test_a_seam_of_tiles_is_no_coast(off_m: float) -> None:
    """A straight coast over two tiles, whose land ends some centimetres off their borders."""
    rng = np.random.default_rng(1)

    def tile(west: float) -> CoastPart:
        x = np.linspace(west, west + 1000, 21)
        ring = np.vstack([[(west, 0.0), (west + 1000, 0.0)], np.column_stack([x, np.full(21, 500.0)])[::-1]])
        inland = ring[:, 1] > 0
        ring[inland] += rng.uniform(-off_m, off_m, (21, 2))
        return CoastPart(shapely.Polygon(ring), 5.0, shapely.box(west, -500, west + 1000, 500))

    coast = Coast.of(tile(0.0), tile(1000.0))
    assert coast.length_m == pytest.approx(2000, abs=1)
    assert coast.area_m2 == pytest.approx(1e6, rel=1e-4)


def test_where_a_finer_chart_ends_is_no_coast() -> None:
    """The finer chart has water where the coarser one has land."""
    coast = Coast.of(CoastPart([], 2.0, shapely.box(0, 0, 10, 10)), CoastPart(shapely.box(5, -5, 20, 5), 5.0))
    assert coast.length_m == pytest.approx(2 * 10 + 2 * 15 - 10)


def test_a_coast_without_land() -> None:
    coast = Coast.of(CoastPart([], 5.0, shapely.box(0, 0, 10, 10)))
    assert coast.length_m == coast.area_m2 == 0
    assert Coast.of(CoastPart([], 5.0)).bounds == (0, 0, 0, 0)


@pytest.mark.parametrize(
    ("charts", "message"),
    [
        ([], "none was given"),
        ([CoastPart(shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), 1.0)], "Self-intersection"),
        ([CoastPart(shapely.LineString([(0, 0), (1, 1)]), 1.0)], "LineString"),
        ([CoastPart(shapely.Polygon([(0, 0), (1, np.inf), (1, 0)]), 1.0)], "not finite"),
        ([CoastPart(SQUARE, 1.0), CoastPart(SQUARE, 2.0)], "put it last"),
        ([CoastPart(SQUARE, 1.0, shapely.Polygon())], "nothing is known"),
    ],
)
def test_shapes_that_are_refused(charts, message) -> None:
    with pytest.raises(DataError, match=message):
        Coast.of(*charts)


def test_without_shapely_it_says_what_to_install(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "shapely", None)
    with pytest.raises(DataError, match=r"install elusive\[charts\]"):
        Coast.of(CoastPart([], 1.0))


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.nan, np.inf])
def test_an_imprecision_that_is_refused(sigma) -> None:
    with pytest.raises(ParameterError, match="chart 1: sigma_m"):
        land(SQUARE, sigma=sigma)


def test_after_construction_shapely_is_not_needed() -> None:
    code = (
        "import pickle, sys; water = pickle.load(sys.stdin.buffer); "
        "print(water.probability([(0.0, 0.0)]), 'shapely' in sys.modules)"
    )
    import pickle

    found = subprocess.run(
        [sys.executable, "-c", code],
        input=pickle.dumps(HardWater().bind(land(SQUARE))),
        capture_output=True,
        check=True,
    )
    assert found.stdout.decode().split() == ["[0.]", "False"]


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6), reach=st.sampled_from([0.0, 3.0, 60.0, 2000.0]), size=st.sampled_from([1e-3, 1.0, 1e4])
)
def test_windings_of_ragged_islands(seed, reach, size) -> None:
    rng = np.random.default_rng(seed)
    rings = rings_of(shapely.affinity.scale(star(rng, points=int(rng.integers(3, 60))), size, size, origin=(0, 0)))
    points = np.concatenate(
        [rng.uniform(-120, 120, (200, 2)) * size, rings.vertices * (1 + 1e-9), rings.vertices * 0.99]
    )
    index = index_edges(rings, reach * size)
    found = inside(index, cells_at(index, points[:, 0], points[:, 1]), points[:, 0], points[:, 1])
    np.testing.assert_array_equal(found, windings(rings, points) == 1)


@pytest.mark.parametrize("reach", [0.0, 4.0, 30.0])
def test_a_cell_lists_every_edge_within_reach(reach) -> None:
    coast = archipelago()
    rng = np.random.default_rng(1)
    index = index_edges(coast.land, reach)
    points = np.concatenate([near(coast, 200, rng), rng.uniform(-700, 900, (200, 2))])
    cells = cells_at(index, points[:, 0], points[:, 1])
    begins = np.delete(np.arange(len(coast.land.vertices) - 1), coast.land.starts[1:-1] - 1)
    for point, cell in zip(points, cells, strict=True):
        a, along = coast.land.edges[:, :2] - point, coast.land.edges[:, 2:] - coast.land.edges[:, :2]
        share = np.clip(-(a * along).sum(1) / (along**2).sum(1), 0, 1)
        wanted = begins[np.hypot(*(a + share[:, None] * along).T) <= reach]
        runs = index.runs[index.first[cell] : index.first[cell + 1]] if cell >= 0 else []
        listed = [i for first, last in runs for i in range(first, last)]
        assert len(listed) == len(set(listed))
        assert set(wanted) <= set(listed)


def test_a_part_of_the_map_knows_what_lies_beyond_it() -> None:
    rings = rings_of(shapely.box(-1000, -1000, 1000, 1000) - shapely.box(-5, -5, 5, 5))
    rng = np.random.default_rng(2)
    window = np.array([[-100.0, -100.0], [900.0, 100.0]])
    index = index_edges(rings, 20.0, within=window)
    points = rng.uniform(*window, (2000, 2))
    found = inside(index, cells_at(index, points[:, 0], points[:, 1]), points[:, 0], points[:, 1])
    np.testing.assert_array_equal(found, windings(rings, points) == 1)


def test_a_long_slanting_edge_costs_no_more_than_its_length() -> None:
    rings = rings_of(shapely.Polygon([(0, 0), (4e5, 3.9e5), (-1e3, 1e3)]))
    index = index_edges(rings, 10.0, 20.0)
    assert len(index.runs) < 40 * edge_lengths(rings).sum() / 20.0


def test_a_wide_empty_map_is_not_indexed_cell_by_cell() -> None:
    rings = rings_of(shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(1e6, 1e6, 1e6 + 1, 1e6 + 1)]))
    index = index_edges(rings, 1.0)
    assert index.tiles.size < 2**25
    x = np.array([0.5, 1e6 + 0.5, 5e5])
    assert inside(index, cells_at(index, x, x), x, x).tolist() == [True, True, False]
