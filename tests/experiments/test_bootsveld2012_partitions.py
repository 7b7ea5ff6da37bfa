"""Figures 7.1 to 7.3 and the ships' ways of Bootsveld (2012) against a straight coast, and shapely edge by edge."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.special import ndtr

from elusive.charts import Coast, CoastPart
from elusive.experiments.bootsveld2012.case import HALF_WIDTH_M, ShipCase, scenery
from elusive.experiments.bootsveld2012.partitions import CELL_M, CELLS, PIXELS, SIGMA_M, partition
from elusive.experiments.bootsveld2012.ways import off_coast

PIXEL_M = CELLS * CELL_M / PIXELS


def test_beside_a_straight_coast_simple_partitioning_is_wrong_by_the_probability_of_land() -> None:
    """The coast runs 4 m west of a cell that does not list it, and six deviations west of the next."""
    shore = CELL_M - 4.0
    land = shapely.box(-5000.0, -5000.0, shore, 5000.0)
    coast = Coast.of(CoastPart(land, SIGMA_M))
    middle = np.full(2, 0.5 * CELLS * CELL_M)
    simple, intelligent = partition(coast, middle, 0.0), partition(coast, middle, 3.0)
    x = PIXEL_M * (np.arange(PIXELS) + 0.5)
    true = ndtr((x - shore) / SIGMA_M)
    listed = x < CELL_M
    np.testing.assert_allclose(simple.water, np.tile(np.where(listed, true, 1.0), (PIXELS, 1)), atol=1e-12)
    assert [row.edges for row in simple.rows] == [1, 0, 0, 0, 0] * CELLS
    assert [row.edges for row in intelligent.rows] == [1, 1, 0, 0, 0] * CELLS
    np.testing.assert_allclose(intelligent.error, 0.0, atol=ndtr(-6.0))  # of the third cells, that list no coast
    worst = 1 - true[~listed][0]
    second = [row.greatest_error for row in simple.rows if row.column == 1]
    np.testing.assert_allclose(second, worst, atol=1e-12)
    whole = partition(coast, middle, None)
    np.testing.assert_allclose(whole.water, np.tile(true, (PIXELS, 1)), atol=1e-12)
    assert [(row.edges, row.greatest_error) for row in whole.rows] == [(4, 0.0)]


@pytest.mark.parametrize("boundary", [0.0, 3.0])
def test_a_cell_lists_every_edge_within_its_boundary(boundary: float) -> None:
    scene = scenery(ShipCase(way="port-imprecise"))
    coast = Coast.of(CoastPart(list(scene.land), SIGMA_M))
    made = partition(coast, scene.truth[55, [0, 2]], boundary)
    whole = partition(coast, scene.truth[55, [0, 2]], None)
    edges = shapely.linestrings(np.stack([coast.land.vertices[:-1], coast.land.vertices[1:]], axis=1))
    (every,) = whole.listed
    reach = boundary * SIGMA_M
    for number, listed in enumerate(made.listed):
        west, south = made.corner + CELL_M * np.array([number % CELLS, number // CELLS])
        away = shapely.distance(edges, shapely.box(west, south, west + CELL_M, south + CELL_M))
        assert {*every[away[every] < reach]} <= {*listed.tolist()}
        assert away[listed].max(initial=0.0) <= np.sqrt(2) * reach + 1e-6  # a boundary's corners are square
    if boundary:  # an edge farther than three deviations is worth this much at most
        assert np.abs(made.error).max() < ndtr(-boundary)
    else:
        assert np.abs(made.error).max() > 0.1


@pytest.mark.parametrize("way", ["canal-middle", "canal-coast", "canal-imprecise", "port-perfect", "port-imprecise"])
def test_the_distance_to_the_charted_coast(way: str) -> None:
    scene, away = scenery(ShipCase(way=way)), off_coast(ShipCase(way=way))
    if way.startswith("canal"):
        np.testing.assert_allclose(away, HALF_WIDTH_M - np.abs(scene.truth[:, 0]), atol=1e-9)
    land = shapely.union_all(list(scene.land))
    points = shapely.points(scene.truth[:, [0, 2]])
    signed = shapely.distance(land.boundary, points) * np.where(shapely.contains(land, points), -1.0, 1.0)
    np.testing.assert_allclose(away, signed, atol=1e-4)  # united polygons lie on a grid
