"""Exact and field where it is hardest: vertices, edges, holes, creeks and islets, and where charts meet or end."""

from __future__ import annotations

import functools
from itertools import pairwise

import numpy as np
import pytest
import shapely

from elusive.charts import Coast, CoastPart, ExactWater, FieldWater
from tests.charts.shapes import CELLS, cell, pair, port_fourchon, star
from tests.reference.water import drawn, land_mass, water_probability

SIGMAS = (8.2, 20.4)
NUDGE = np.array([1.1e-7, 0.7e-7])  # the twin's sum is not defined on an edge
PARTS = 3  # places of each kind


@functools.cache
def both():
    """The fine cell over the coarse one, each with its own imprecision."""
    (fine, covered), (coarse, around) = pair()
    return Coast.of(CoastPart(fine, SIGMAS[0], covered), CoastPart(coarse, SIGMAS[1], around))


def two_charts():
    """Ragged islands on two charts that differ, the finer one within."""
    rng = np.random.default_rng(0)
    islands = [star(rng, x, y) for x in range(-300, 301, 150) for y in range(-300, 301, 150)]
    coarse = [shapely.simplify(island, 15.0) for island in islands]
    return Coast.of(
        CoastPart(islands, 3.0, star(rng, radius=300.0, points=9)),
        CoastPart([part for part in coarse if part.geom_type == "Polygon"], 9.0, shapely.box(-350, -350, 350, 350)),
    )


def whole(rings):
    """What rings enclose, as shapely has it: islands in holes too."""
    return shapely.build_area(shapely.MultiLineString([rings.vertices[a:b] for a, b in pairwise(rings.starts)]))


def on_coast(coast, n, rng):
    """Vertices, middles of edges and other places on them, ``n`` of each."""
    first, last = coast.land.edges[rng.integers(len(coast.land.edges), size=3 * n)].reshape(-1, 2, 2).swapaxes(0, 1)
    share = np.repeat([0.0, 0.5, 0.137], n)[:, None]
    return first + share * (last - first)


def at_borders(coast, n, rng, area=0):
    """Places on the border of an area and about it, those nearest the land first."""
    ring = shapely.get_coordinates(shapely.segmentize(whole(coast.areas[area]).boundary, 5.0))
    near = ring[np.argsort(shapely.distance(whole(coast.land).boundary, shapely.points(ring)))[: 4 * n]]
    on, about = near[rng.integers(len(near), size=(2, n))]
    return np.concatenate([on, about + rng.normal(scale=2 * coast.sigma_m[area], size=(n, 2))])


def check(coast, points) -> None:
    """The exact probability is the twin's, area by area."""
    water = ExactWater().bind(coast)
    found, areas = water.probability(points), water.area(points)
    for area in range(len(coast.sigma_m)):
        here = (areas == area) & (water.area(points + NUDGE) == area)
        # land and border are snapped apart by 1e-5 m: where all is land, the twin's share of it may be above one
        expected = np.clip(water_probability(coast, points[here] + NUDGE, area), 0, 1)
        np.testing.assert_allclose(found[here], expected, atol=1e-7)
    assert (found[areas < 0] == 1).all()


def test_on_edges_and_vertices_of_a_real_cell() -> None:
    check(cell(CELLS[0]), on_coast(cell(CELLS[0]), 25, np.random.default_rng(1)))


def test_where_two_charts_of_different_imprecision_meet() -> None:
    coast, rng = two_charts(), np.random.default_rng(2)
    points = np.concatenate([on_coast(coast, 100, rng), at_borders(coast, 200, rng), rng.uniform(-380, 380, (300, 2))])
    assert set(ExactWater().bind(coast).area(points)) == {-1, 0, 1}
    check(coast, points)


def test_draws_where_two_charts_meet() -> None:
    coast, rng = two_charts(), np.random.default_rng(3)
    check_draws(coast, at_borders(coast, 6, rng), 200_000, rng)


@pytest.mark.validate
@pytest.mark.parametrize("name", CELLS)
def test_on_edges_and_vertices_of_real_cells(name) -> None:
    check(cell(name), on_coast(cell(name), 300, np.random.default_rng(4)))


@pytest.mark.validate
@pytest.mark.parametrize("name", CELLS)
def test_at_the_borders_of_real_cells(name) -> None:
    check(cell(name), at_borders(cell(name), 300, np.random.default_rng(5)))


@pytest.mark.validate
def test_two_real_cells_of_different_imprecision() -> None:
    coast, rng = both(), np.random.default_rng(6)
    check(coast, np.concatenate([on_coast(coast, 100, rng), at_borders(coast, 300, rng)]))


@pytest.mark.validate
def test_the_field_of_two_real_cells_at_100_000_points() -> None:
    coast, rng = both(), np.random.default_rng(7)
    vertices = coast.land.vertices
    spread = np.where(ExactWater().bind(coast).area(vertices) == 0, *SIGMAS)
    of = rng.integers(len(vertices), size=80_000)
    points = vertices[of] + 2 * spread[of, None] * rng.normal(size=(80_000, 2))
    points = np.concatenate([points, at_borders(coast, 20_000, rng)])
    exact = ExactWater().bind(coast)
    points = points[exact.known(points)]
    assert np.abs(FieldWater().bind(coast).probability(points) - exact.probability(points)).max() <= 1e-3


@pytest.mark.validate
def test_draws_of_every_kind_of_place() -> None:
    coast, rng = both(), np.random.default_rng(8)
    check_draws(coast, np.concatenate(list(hard_places(coast, rng).values())), 2_000_000, rng)


@pytest.mark.validate
def test_every_kind_of_place() -> None:
    coast, rng = both(), np.random.default_rng(8)
    for kind, points in hard_places(coast, rng).items():
        assert len(points) >= PARTS, kind
        check(coast, points)


@pytest.mark.thorough
def test_the_lakes_of_a_real_shore() -> None:
    coast = port_fourchon()
    parts = shapely.get_parts(whole(coast.land))
    shores = [shapely.get_coordinates(shapely.segmentize(hole, 7.0)) for part in parts for hole in part.interiors]
    assert len(shores) == 2
    rng = np.random.default_rng(9)
    points = np.concatenate([shore[rng.integers(len(shore), size=8)] for shore in shores])
    check(coast, np.concatenate([points, points + rng.normal(scale=7.0, size=points.shape)]))


def hard_places(coast, rng):
    """Places of every kind in the fine cell, where the coarse one is near too; neither has lakes."""
    inner = whole(coast.areas[0]).buffer(-60)
    land = shapely.intersection(whole(coast.land), inner)
    islets = sorted(shapely.get_parts(land), key=lambda part: part.area)
    narrow = shapely.difference(shapely.buffer(shapely.buffer(land, SIGMAS[0]), -SIGMAS[0]), land)
    creeks = sorted(shapely.get_parts(shapely.intersection(narrow, inner.buffer(-30))), key=lambda part: -part.area)

    def middles(parts):
        return shapely.get_coordinates([part.representative_point() for part in parts[:PARTS]])

    return {
        "islets": middles(islets),
        "creeks": middles(creeks),
        "edges and vertices": on_coast(coast, 2, rng),
        "borders": at_borders(coast, 4, rng),
    }


def check_draws(coast, points, draws, rng) -> None:
    """Of the draws about a place that fall on what is charted, as many fall on land."""
    water = ExactWater().bind(coast)
    land, covered = whole(coast.land), whole(coast.border)
    for shape in (land, covered):
        shapely.prepare(shape)
    for point, found, area in zip(points, water.probability(points), water.area(points), strict=True):
        if area < 0:
            continue
        sigma = coast.sigma_m[area]
        seed = rng.integers(2**63)  # the same draws for both
        (ashore, _), (known, _) = (
            drawn(functools.partial(shapely.contains_xy, shape), point, sigma, draws, np.random.default_rng(seed))
            for shape in (land, covered)
        )
        share = ashore / known
        error = np.sqrt(max(share * (1 - share), 1 / draws) / (draws * known))
        assert 1 - found == pytest.approx(share, abs=4.5 * error)


def test_the_twin_of_a_covered_half_plane() -> None:
    coast = Coast.of(CoastPart([shapely.box(-500, -500, 500, 0)], 5.0, shapely.box(-500, -500, 0, 500)))
    point = np.array([[-1e-9, 0.0]])
    assert land_mass(coast.border.edges, point, 5.0)[0] == pytest.approx(0.5, abs=1e-6)
    assert water_probability(coast, point)[0] == pytest.approx(0.5, abs=1e-6)
