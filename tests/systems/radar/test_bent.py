"""Bearings in radians of a radar that looks into a sector: ranges bend as no ship's of those bearings do."""

from __future__ import annotations

import numpy as np

from elusive.contracts import Array
from elusive.systems.radar.bent import bent_finding

TIMES_S, RANGE_SD_M, BEARING_SD, DETECTED = 2.5 * np.arange(80), 10.0, 2e-3, 0.9


def sector(seed: int, scale: float) -> dict[int, Array]:
    """Sightings of eight ships that sail nearly straight; bearings are so many times what they should be."""
    rng = np.random.default_rng([seed, 5])
    rows = dict[int, Array]()
    for number in range(8):
        far, angle, heading, speed = rng.uniform([1000, 0.5, 0, 3], [5000, 1.1, 2 * np.pi, 9])
        velocity = speed * np.array([np.sin(heading), np.cos(heading)])
        velocity = velocity + np.cumsum(rng.normal(0, 0.01 * 2.5**0.5, (len(TIMES_S), 2)), axis=0)
        places = far * np.array([np.sin(angle), np.cos(angle)]) + np.cumsum(2.5 * velocity, axis=0)
        r = np.hypot(*places.T) + rng.normal(0, RANGE_SD_M, len(TIMES_S))
        b = scale * (np.arctan2(*places.T) + rng.normal(0, BEARING_SD, len(TIMES_S)))
        rows[number] = np.column_stack([TIMES_S, r * np.sin(b), r * np.cos(b)])[rng.random(len(TIMES_S)) < DETECTED]
    return rows


def test_radians_are_named_and_degrees_are_not() -> None:
    """Of 40 recordings other than these 39 were named in radians, and none in degrees."""
    named = [not bent_finding(sector(seed, np.pi / 180), RANGE_SD_M).holds for seed in range(100, 120)]
    assert sum(named) >= 17  # with .975 fewer than one of a thousand such sets has less
    assert all(bent_finding(sector(seed, 1.0), RANGE_SD_M).holds for seed in range(100, 120))


def test_short_tracks_say_nothing() -> None:
    rows = {number: one[:25] for number, one in sector(0, np.pi / 180).items()}
    assert bent_finding(rows, RANGE_SD_M).holds
    assert bent_finding({}, RANGE_SD_M).holds
