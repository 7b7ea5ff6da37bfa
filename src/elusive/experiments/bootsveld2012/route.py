"""A ship's way along a shoreline, drawn by rule in place of the hand-drawn routes of Bootsveld (2012), appendix B.

The shore is smoothed, a stretch of it moved seaward by a distance that changes with time as the thesis tells it: broad
water, the coast, charted land, open water. Of all stretches that lead south and keep the distance, the most winding.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d
from scipy.special import ndtri

from elusive.charts import Coast, CoastPart, NearestWater
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.places import along_path

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

STEPS = 111  # the prior's scan and 110 more
BEYOND = 12  # seconds at either end that are cut off after smoothing
SECONDS, INSIDE = np.arange(-BEYOND, STEPS + BEYOND), slice(BEYOND, -BEYOND)
SPEED_MPS = 10.0
STEP_M = 2.0  # between places of the smoothed shore
SMOOTHING_M = 40.0  # deviation of the kernel that smooths the shore
SMOOTHING_S = 2.0  # of the one that smooths the route
TURN_RAD = 0.25  # within a second at most
CORRECTIONS = 6  # of the route towards the wanted distances
BETWEEN_M = 50.0  # from one stretch's beginning to the next's
SOUTHWARD = 0.6  # of a route's length leads south at least
MARGIN_M = 500.0  # kept from the map's edge
REACH_M = 100.0  # deviation that distances are read with, up to three of it
UNIT_M = 5.0  # the thesis's deviation: its cells of 1 m are .2 of it
# seconds, and distance to the charted coast in these units; negative: charted land
PERFECT = ((0, 15, 45, 60, 80, 102, 110), (12.0, 9.0, 3.0, 1.5, 0.5, 0.5, 0.5))
IMPRECISE = ((0, 15, 36, 45, 55, 64, 73, 84, 96, 110), (12.0, 9.0, 1.0, 0.0, -1.5, -1.0, -3.0, 0.0, 8.0, 12.0))


class Route(NamedTuple):
    """A ship's way along a shoreline."""

    states: Array  # (STEPS, 4) x, vx, y, vy, one a second [m, m/s]
    distance_m: Array  # (STEPS,) to the charted coast, negative on charted land; infinite beyond 300 m


def find_route(land: Sequence[BaseGeometry], *, perfect: bool) -> Route:
    """Find the most winding stretch of shore along which a ship can keep the wanted distance.

    ``perfect``: it stays in charted water (the thesis's trial B); else it crosses charted land (its trials A and C).

    Raises
    ------
    DataError
        If the shoreline has no such stretch.
    """
    wanted = UNIT_M * PchipInterpolator(*(PERFECT if perfect else IMPRECISE))(np.clip(SECONDS, 0, STEPS - 1))
    coast = Coast.of(CoastPart(list(land), REACH_M))
    routes, seaward = _stretches(coast)
    if len(routes):
        water = NearestWater(floor=1e-12).bind(coast)
        distance = np.zeros(routes.shape[:2])
        for _ in range(CORRECTIONS):
            routes = gaussian_filter1d(routes + (wanted - distance)[:, :, None] * seaward, SMOOTHING_S, axis=1)
            distance = REACH_M * ndtri(water.probability(routes.reshape(-1, 2))).reshape(distance.shape)
        routes, distance, wanted = routes[:, INSIDE], distance[:, INSIDE], wanted[INSIDE]
        near = wanted < 3 * UNIT_M
        vx, vy = np.diff(routes, axis=1).transpose(2, 0, 1)
        turns = np.abs(np.diff(np.unwrap(np.arctan2(vx, vy))))
        kept = (np.abs(distance - wanted)[:, near] < UNIT_M).all(axis=1) & (turns < TURN_RAD).all(axis=1)
        kept &= (distance[:, ~near] > 2 * UNIT_M).all(axis=1)
        best = int(np.argmax(np.where(kept, turns.sum(axis=1), -1.0)))
        if kept[best]:
            x, y = routes[best].T
            return Route(np.column_stack([x, np.gradient(x), y, np.gradient(y)]), distance[best])
    raise DataError("shoreline: has no stretch of a kilometre that leads south and can be sailed along; give another.")


def _stretches(coast: Coast) -> tuple[Array, Array]:
    """Return all stretches of the smoothed shore that lead south, either way along it, ``(R, SECONDS, 2)`` [m].

    With them the directions of the sea, likewise.
    """
    import shapely

    low, high = np.reshape(coast.bounds, (2, 2)) + np.array([[MARGIN_M], [-MARGIN_M]])
    ahead = np.round(SECONDS * SPEED_MPS / STEP_M).astype(int)
    shores, seawards = [np.zeros((0, len(SECONDS), 2))], [np.zeros((0, len(SECONDS), 2))]
    for ring in map(shapely.LineString, coast.land.each):
        count = int(ring.length / STEP_M)
        if count < 1.5 * ahead[-1]:
            continue
        even = along_path(shapely.get_coordinates(ring), STEP_M)[:count]
        smooth = gaussian_filter1d(even, SMOOTHING_M / STEP_M, axis=0, mode="wrap")
        course = gaussian_filter1d(even, SMOOTHING_M / STEP_M, axis=0, mode="wrap", order=1)
        seaward = np.column_stack([course[:, 1], -course[:, 0]]) / np.hypot(*course.T)[:, None]
        first = np.arange(0, count, round(BETWEEN_M / STEP_M))[:, None]
        at = np.concatenate([(first + ahead) % count, (first - ahead) % count])
        inside = ((low < smooth) & (smooth < high)).all(axis=1)[at].all(axis=1)
        south = smooth[at[:, 0], 1] - smooth[at[:, -1], 1] > SOUTHWARD * STEPS * SPEED_MPS
        shores.append(smooth[at[inside & south]])
        seawards.append(seaward[at[inside & south]])
    return np.concatenate(shores), np.concatenate(seawards)
