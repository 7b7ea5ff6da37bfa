"""Constraints with imprecise bounds: what they allow is the share of drawn bounds that hold the state."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from elusive.charts.constraints import CourseBounds, Lane, SpeedBounds, log_between
from elusive.errors import ParameterError

DRAWS = 40_000
RNG = np.random.default_rng(7)
STATES = np.column_stack(
    [RNG.uniform(-100, 600, 40), RNG.normal(0, 4, 40), RNG.uniform(-100, 500, 40), RNG.normal(0, 4, 40)]
)


def share(allowed):
    """Share of draws, and three of its standard errors."""
    return allowed.mean(axis=0), 3 * np.sqrt(allowed.mean(axis=0) * (1 - allowed.mean(axis=0)) / DRAWS) + 3e-4


def test_any_quantity_lies_between_bounds_as_often_as_they_are_drawn_round_it():
    """Eqs. 4.2 to 4.5: deviations that depend on the state, and differ at either end."""
    values, sigma = STATES[:, 1], 0.5 + 0.1 * np.abs(STATES[:, 3])
    errors = RNG.standard_normal((2, DRAWS, 1))
    allowed = (-3.0 + sigma * errors[0] <= values) & (values <= 4.0 + 2.0 * errors[1])
    expected, room = share(allowed)
    assert (np.abs(np.exp(log_between(values, (-3.0, 4.0), sigma, 2.0)) - expected) < room).all()
    np.testing.assert_array_equal(np.exp(log_between(values, (-3.0, 4.0), 0.0, 0.0)), (values >= -3) & (values <= 4))


def test_speeds():
    speed = np.hypot(STATES[:, 1], STATES[:, 3])
    low, high = 2.0 + 0.7 * RNG.standard_normal((DRAWS, 1)), 6.0 + 0.7 * RNG.standard_normal((DRAWS, 1))
    expected, room = share((low <= speed) & (speed <= high))
    found = np.exp(SpeedBounds(lower_mps=2.0, upper_mps=6.0, sigma_mps=0.7).log_probability(STATES))
    assert (np.abs(found - expected) < room).all()
    rest = np.zeros((1, 4))
    assert SpeedBounds(upper_mps=6.0).log_probability(rest) == pytest.approx(0.0, abs=1e-9)


def test_courses_run_clockwise_through_north():
    bounds = CourseBounds(from_deg=330.0, to_deg=60.0, sigma_deg=0.0)
    courses = np.radians([331.0, 0.0, 59.0, 61.0, 180.0, 329.0])
    states = np.column_stack([np.zeros(6), np.sin(courses), np.zeros(6), np.cos(courses)])
    np.testing.assert_array_equal(np.exp(bounds.log_probability(states)), [1, 1, 1, 0, 0, 0])
    edge = np.array([[0.0, math.sin(math.radians(60.0)), 0.0, 0.5]])
    assert np.exp(bounds.replace(sigma_deg=5.0).log_probability(edge)) == pytest.approx(0.5)
    assert bounds.log_probability(np.zeros((1, 4))) == 0  # at rest


def test_a_lane_is_what_lies_within_half_its_width_of_its_line():
    path = ((0.0, 0.0), (300.0, 0.0), (500.0, 300.0))
    lane = Lane(path_m=path, width_m=120.0, sigma_m=0.0, one_way=False)
    inside = shapely.LineString(path).distance(shapely.points(STATES[:, [0, 2]])) <= 60.0
    assert 3 < inside.sum() < 37
    np.testing.assert_array_equal(lane.log_probability(STATES) == 0, inside)
    soft = np.exp(lane.replace(sigma_m=30.0).log_probability(np.array([[100.0, 1.0, 60.0, 0.0]])))
    assert soft == pytest.approx(0.5, abs=1e-4)


def test_a_lane_of_one_way_is_not_sailed_against():
    lane = Lane(path_m=((0.0, 0.0), (300.0, 0.0), (300.0, 300.0)), width_m=100.0)
    sailed = np.array(
        [[100.0, 5.0, 0.0, 1.0], [100.0, -5.0, 0.0, 1.0], [300.0, 1.0, 200.0, 5.0], [300.0, 1.0, 200.0, -5.0]]
    )
    np.testing.assert_array_equal(np.isfinite(lane.log_probability(sailed)), [True, False, True, False])


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: SpeedBounds(lower_mps=5.0, upper_mps=4.0), "less than upper_mps"),
        (lambda: CourseBounds(from_deg=10.0, to_deg=10.0), "clockwise"),
        (lambda: Lane(path_m=((0.0, 0.0), (0.0, 0.0)), width_m=5.0), "each once"),
    ],
)
def test_bounds_that_hold_nothing_are_refused(make, said):
    with pytest.raises(ParameterError, match=said):
        make()
