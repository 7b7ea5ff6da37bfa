"""Coasts to test on: drawn by hand, by chance, and real ones where the recordings' folder is there."""

from __future__ import annotations

import functools
import json
from itertools import pairwise

import numpy as np
import pytest
import shapely

from elusive.charts import Coast, CoastPart
from tests.recordings import DATA

CELLS = ("US5MD1MC", "US4MD81M")
SQUARE = shapely.box(-1, -1, 1, 1)
L_SHAPE = shapely.Polygon([(0, 0), (40, 0), (40, 10), (10, 10), (10, 40), (0, 40)])


def land(*polygons, sigma=1.0, coverage=None):
    """Coast of one chart."""
    return Coast.of(CoastPart(list(polygons), sigma, coverage))


def star(rng, x=0.0, y=0.0, radius=100.0, points=40):
    """Ragged island round a place."""
    angle = np.sort(rng.random(points)) * 2 * np.pi
    reach = radius * rng.uniform(0.3, 1.0, points)
    return shapely.Polygon(np.column_stack([x + reach * np.cos(angle), y + reach * np.sin(angle)])).buffer(0)


def archipelago(seed=0, sigma=5.0, coverage=None):
    """Ragged islands with a lake, narrow creeks between them, one island in the lake."""
    rng = np.random.default_rng(seed)
    islands = [star(rng, x, y) for x in range(-300, 301, 150) for y in range(-300, 301, 150)]
    islands.append(shapely.box(-500, 400, 500, 600) - shapely.box(-300, 450, 100, 550))
    islands.append(shapely.box(-200, 480, -150, 520))
    islands += [shapely.box(-500, 604, 500, 700), shapely.box(-500, 701, 500, 760)]
    return land(*islands, sigma=sigma, coverage=coverage)


def near(coast, n, rng, spread=2.0):
    """Random positions round random vertices, ``spread`` deviations wide."""
    vertices = coast.land.vertices
    return vertices[rng.integers(len(vertices), size=n)] + rng.normal(scale=spread * coast.sigma_m[0], size=(n, 2))


def shapely_land(coast):
    """The land of a coast of one polygon a ring, as shapely has it."""
    rings = [shapely.LinearRing(coast.land.vertices[a:b]) for a, b in pairwise(coast.land.starts)]
    outer = [shapely.Polygon(ring) for ring in rings if ring.is_ccw]
    holes = [shapely.Polygon(ring) for ring in rings if not ring.is_ccw]
    return shapely.difference(shapely.union_all(outer), shapely.union_all(holes)) if holes else shapely.union_all(outer)


@functools.cache
def cell_shapes(name, about=None):
    """Land and coverage of a real cell in metres about its own or another's middle; skips where it is not there."""
    path = DATA / "enc" / name / f"{name}.000"
    if not path.exists():
        pytest.skip(f"needs {path}: set ELUSIVE_DATA")
    from pyogrio.raw import read
    from pyproj import Transformer

    shapes = shapely.from_wkb(read(path, layer="LNDARE", columns=[])[2])
    polygons = shapes[shapely.get_type_id(shapes) == shapely.GeometryType.POLYGON]
    _, _, cover, (category,) = read(path, layer="M_COVR", columns=["CATCOV"])
    coverage = shapely.union_all(shapely.from_wkb(cover[category == 1]))
    frame = _frame(coverage.centroid if about is None else shapely.Point(about))
    to_metres = Transformer.from_crs("EPSG:4326", frame, always_xy=True)

    def project(points):
        return np.column_stack(to_metres.transform(points[:, 0], points[:, 1]))

    return [*shapely.transform(polygons, project)], shapely.transform(coverage, project)


@functools.cache
def cell(name, sigma=8.2):
    """Coast of a real cell."""
    polygons, coverage = cell_shapes(name)
    return land(*polygons, sigma=sigma, coverage=coverage)


def pair():
    """The fine cell's and the coarse cell's land and coverage in one frame."""
    return [cell_shapes(name, (-76.4625, 38.9625)) for name in CELLS]


@functools.cache
def port_fourchon(sigma=7.0):
    """Full-resolution shoreline round Port Fourchon, lakes cut out."""
    path = DATA / "coast" / "gshhg_f_port_fourchon_LA.geojson"
    if not path.exists():
        pytest.skip(f"needs {path}: set ELUSIVE_DATA")
    from pyproj import Transformer

    features = json.loads(path.read_text())["features"]
    by_level = {
        level: shapely.union_all(
            [
                shapely.geometry.shape(feature["geometry"]).buffer(0)
                for feature in features
                if feature["properties"]["level"] == level
            ]
        )
        for level in (1, 2)
    }
    shore = by_level[1] - by_level[2]
    to_metres = Transformer.from_crs("EPSG:4326", _frame(shore.centroid), always_xy=True)
    shore = shapely.transform(shore, lambda points: np.column_stack(to_metres.transform(points[:, 0], points[:, 1])))
    return land(*shapely.get_parts(shore), sigma=sigma)


def _frame(middle):
    from pyproj import CRS

    return CRS.from_proj4(f"+proj=aeqd +lat_0={middle.y} +lon_0={middle.x} +units=m")
