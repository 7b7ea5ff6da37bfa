"""A single sensor that moves: the distance comes from its turns, never from a path on the sensor."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.motion import ConstantVelocity
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearings import BearingSensors

SIGMA_DEG, RANGE_M, SPEED_MPS, OWN_MPS = 0.5, 6000.0, 4.0, 5.0
HEADINGS_DEG = (20, 110, 40, 130, 60, 150, 30)  # of the receiver, 150 s each


def past(seed):
    """Times, places of the receiver, path of the emitter, bearings."""
    rng, times = np.random.default_rng([seed, 3]), np.arange(0.0, 901.0, 5.0)
    heading = np.deg2rad(np.array(HEADINGS_DEG)[(times // 150).astype(int)])
    places = np.zeros((len(times), 3))
    places[1:, :2] = np.cumsum(OWN_MPS * 5.0 * np.column_stack([np.sin(heading), np.cos(heading)])[:-1], axis=0)
    bearing, course = rng.uniform(0, 2 * np.pi, 2)
    start, course_ = RANGE_M * np.array([np.sin(bearing), np.cos(bearing)]), np.array([np.sin(course), np.cos(course)])
    path = start + SPEED_MPS * times[:, None] * course_
    azimuth = np.arctan2(*(path - places[:, :2]).T) + np.deg2rad(SIGMA_DEG) * rng.standard_normal(len(times))
    one, none = np.zeros(1, np.intp), np.full(1, np.nan)
    sets = [BearingSet(t, one, azimuth[k : k + 1], none, places[k : k + 1]) for k, t in enumerate(times.tolist())]
    return times, places, path, sets


def _median_range(path, places):
    return np.median(np.hypot(*(path - places[:, :2]).T))


def coverage(seeds, q):
    """Share of the times within the 95 % ellipse, median error, and least share of the true median distance."""
    inside, errors, away = [], [], []
    for seed in seeds:
        _, places, path, sets = past(seed)
        sensor = BearingSensors(positions_m=[tuple(places.mean(axis=0))], sigma_deg=SIGMA_DEG)
        found = MapSmoother(sensor=sensor, motion=ConstantVelocity(q=q)).smooth(sets)
        off, spread = found.states[:, [0, 2]] - path, found.covariances[:, [0, 2]][:, :, [0, 2]]
        inside.append(np.einsum("ki,kij,kj->k", off, np.linalg.inv(spread), off) < 5.991)
        errors.append(np.median(np.hypot(*off.T)))
        away.append(_median_range(found.states[:, [0, 2]], places) / _median_range(path, places))
    return float(np.mean(inside)), float(np.median(errors)), float(np.min(away))


@pytest.mark.parametrize("q", [1.0, 1e-3])
def test_a_receiver_that_turns_tells_the_distance(q):
    inside, error, nearest = coverage(range(6), q)
    assert inside > 0.85
    assert error < 0.15 * RANGE_M
    assert nearest > 0.5


@pytest.mark.thorough
@pytest.mark.parametrize("q", [1.0, 1e-3])
def test_ellipses_hold_over_fifty_seeds(q):
    inside, error, nearest = coverage(range(50), q)
    assert inside >= 0.90
    assert error < 0.05 * RANGE_M
    assert nearest > 0.5
