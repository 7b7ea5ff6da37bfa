"""Fixed echoes inland of a charted coast: buildings, rocks, jetties, for a simulated radar to see."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from elusive.charts import Coast
from elusive.contracts import Array
from elusive.errors import DataError

ROUNDS = 200  # of draws, before a coast is given up
NEARLY = 0.95  # of its distance inland, that an echo is from any shore


def draw_coast_echoes(coast: Coast, n: int, deepest_m: float, reach_m: float, rng: Generator) -> Array:
    """Draw places on land along a coast, each at a distance from the shore uniform up to the deepest.

    Parameters
    ----------
    coast
        Of the charts.
    n
        How many.
    deepest_m
        Greatest distance from the shore.
    reach_m
        Greatest distance from the origin.
    rng
        Source of the draws.

    Returns
    -------
    ndarray
        ``(n, 4)`` states at rest.

    Raises
    ------
    DataError
        If there is no shore, or no land so deep.
    """
    import shapely

    disc = shapely.Point(0.0, 0.0).buffer(reach_m)
    land = shapely.intersection(
        shapely.build_area(shapely.MultiLineString(coast.land.each)), disc.buffer(2 * deepest_m)
    )
    shapely.prepare(land)
    shore = shapely.intersection(shapely.boundary(land), disc)
    found = np.zeros((0, 2))
    for _ in range(ROUNDS if shapely.length(shore) else 0):
        inland, angle = rng.uniform(0.0, deepest_m, n), rng.uniform(0.0, 2 * math.pi, n)
        at = shapely.get_coordinates(shapely.line_interpolate_point(shore, rng.uniform(0, shapely.length(shore), n)))
        at += inland[:, None] * np.column_stack([np.sin(angle), np.cos(angle)])
        points = shapely.points(at)
        deep = shapely.contains(land, points) & (shapely.distance(shapely.boundary(land), points) > NEARLY * inland)
        found = np.concatenate([found, at[deep]])[:n]
        if len(found) == n:
            return np.column_stack([found[:, 0], np.zeros(n), found[:, 1], np.zeros(n)])
    raise DataError(
        f"coast_echoes: the charts have no {n} places up to {deepest_m:g} m inland within {reach_m:.0f} m of the "
        "radar; give a chart with a coast there."
    )
