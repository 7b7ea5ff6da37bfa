"""Tests of what tracks say of each other."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import Array
from elusive.systems.radar.company import company_findings
from elusive.systems.radar.report import RadarPath

TIMES_S, AT_REST = 2.5 * np.arange(100), np.zeros((1, 3))


def path(track: int, first: int, last: int, place: Array, velocity: Array) -> RadarPath:
    """A track that is seen from one scan to another, at a place in the first."""
    times_s = TIMES_S[first:last]
    n = len(times_s)
    places = place + (times_s - times_s[0])[:, None] * velocity
    return RadarPath(
        track, times_s, places, np.tile(velocity, (n, 1)), np.full((n, 2), 10.0), np.ones(n, dtype=bool),
        np.zeros(n, dtype=bool),
    )  # fmt: skip


def ships(rng: np.random.Generator) -> list[RadarPath]:
    """Four that are there all the time, from 6 to 8 km away, and one that comes into view and leaves it."""
    east = rng.uniform(-3000, 3000, 4)
    found = [path(k, 0, 100, np.array([x, 6000.0]), rng.uniform(-6, 6, 2)) for k, x in enumerate(east, 1)]
    return [*found, path(5, 30, 80, np.array([-6500.0, 3500.0]), np.array([-2.0, 5.0]))]


def brief(paths: list[RadarPath], way: Array = AT_REST) -> bool:
    (found,) = (one for one in company_findings(paths, TIMES_S, way) if one.name == "radar.brief")
    return not found.holds


@pytest.mark.parametrize("seed", range(5))
def test_birds_that_come_and_go_near_the_radar_are_named_and_ships_are_not(seed: int) -> None:
    rng = np.random.default_rng(seed)
    there = ships(rng)
    first, places, velocities = rng.integers(12, 50, 3), rng.uniform(-2000, 2000, (3, 2)), rng.uniform(-12, 12, (3, 2))
    birds = [
        path(10 + k, begins, begins + 20, place, velocity)
        for k, (begins, place, velocity) in enumerate(zip(first.tolist(), places, velocities, strict=True))
    ]
    assert not brief(there)
    assert brief([*there, *birds])
    assert not brief([*there, *birds[:2]])  # boats do so, too
    assert not brief([*there, *birds], np.array([[0.0, 0.0, 9000.0]]))  # as far as ships are seen


def test_a_ship_that_is_lost_and_begun_anew_is_not_brief() -> None:
    rng = np.random.default_rng(9)
    velocity = np.array([6.0, 0.0])
    parts = [path(10 + k, 20 * k, 20 * k + 18, np.array([300.0 * k, 2000.0]), velocity) for k in range(5)]
    assert not brief([*ships(rng), *parts])
