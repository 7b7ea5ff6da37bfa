"""P(water) given the coast's error: against the whole imprecision, of which it is a part."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.special import ndtr

from elusive.charts import Coast, CoastPart, DisplacedWater, ExactWater, FieldWater, HardWater, NearestWater
from elusive.errors import ParameterError

from .shapes import archipelago, land, near

COAST_SOUTH = shapely.box(-2000, -2000, 2000, 0)  # land south of a straight coast


def quadrature(nodes=40):
    """Places and weights of two independent standard normal errors."""
    at, weight = np.polynomial.hermite_e.hermegauss(nodes)
    weight = weight / weight.sum()
    u, v = np.meshgrid(at, at)
    return np.column_stack([u.ravel(), v.ravel()]), np.outer(weight, weight).ravel()


def averaged(water, points, errors, weight):
    """Average over the errors at each point."""
    repeated = np.repeat(points, len(errors), axis=0)
    found = water.probability(repeated, np.tile(errors, (len(points), 1)))
    return found.reshape(len(points), -1) @ weight


def test_the_average_over_the_errors_is_the_whole_imprecision():
    coast = archipelago(sigma=8.0)
    points = near(coast, 200, np.random.default_rng(1))
    displaced = DisplacedWater.persistent(ExactWater(), coast, 0.5)
    expected = ExactWater().bind(coast).probability(points)
    # the quadrature's nodes reach 12 deviations, where errors are cut; what is beyond 5 weighs 6e-7
    assert averaged(displaced, points, *quadrature()) == pytest.approx(expected, abs=5e-6)


@pytest.mark.parametrize("model", [FieldWater(), HardWater(), NearestWater(boundary=None)])
def test_other_methods_average_to_it_within_their_own_error(model):
    coast = land(COAST_SOUTH, sigma=10.0)
    points = np.column_stack([np.zeros(7), np.linspace(-30, 30, 7)])
    draws = np.random.default_rng(2).standard_normal((40_000, 2))
    found = averaged(DisplacedWater.persistent(model, coast, 0.9), points, draws, np.full(len(draws), 1 / len(draws)))
    assert found == pytest.approx(ndtr(points[:, 1] / 10.0), abs=4 * 0.5 / np.sqrt(len(draws)) + 1e-3)


def test_two_charts_of_different_imprecision():
    """On both sides of the line where they meet, each position with the deviation of its own chart."""
    fine, coarse = shapely.box(-1000, -1000, 0, 1000), shapely.box(0, -1000, 1000, 1000)
    shore = shapely.box(-1000, -1000, 1000, 0)
    coast = Coast.of(CoastPart([shore], 4.0, [fine]), CoastPart([shore], 20.0, [coarse]))
    points = np.array([[x, y] for x in (-300.0, -5.0, -0.5, 0.5, 5.0, 300.0) for y in (-8.0, 0.0, 12.0)])
    displaced = DisplacedWater.persistent(ExactWater(), coast, 0.9)
    sigma = np.where(points[:, 0] < 0, 4.0, 20.0)
    found = averaged(displaced, points, *quadrature(80))
    assert found == pytest.approx(ndtr(points[:, 1] / sigma), abs=1e-3)
    assert found == pytest.approx(ExactWater().bind(coast).probability(points), abs=1e-3)
    one = displaced.probability(points, np.tile([0.0, 1.5], (len(points), 1)))
    assert one == pytest.approx(ndtr((points[:, 1] / sigma + 1.5 * 0.9**0.5) / 0.1**0.5), abs=1e-6)


def test_a_finer_chart_within_one_without_bounds():
    within = shapely.box(-100, -100, 100, 100)
    coast = Coast.of(CoastPart([COAST_SOUTH], 2.0, [within]), CoastPart([COAST_SOUTH], 10.0))
    points = np.array([[0.0, 3.0], [99.5, -1.0], [101.0, 3.0], [500.0, -4.0]])
    found = DisplacedWater(ExactWater(), coast, 5.0, [2.0, 10.0]).probability(points, np.tile([1.0, -1.0], (4, 1)))
    assert found == pytest.approx(ndtr((points[:, 1] - 5.0) / [2.0, 2.0, 10.0, 10.0]), abs=1e-6)


def test_the_sign_is_chart_less_truth():
    """A chart that stands 30 m north of the truth has its coast moved 30 m south."""
    water = DisplacedWater(HardWater(), land(COAST_SOUTH, sigma=5.0), 30.0, 5.0)
    assert water.probability(np.array([[0.0, -29.0], [0.0, -31.0]]), np.array([[0.0, 1.0]] * 2)).tolist() == [1.0, 0.0]
    states = np.array([[0.0, 0, -29.0, 0, 0.0, 1.0], [0.0, 0, -31.0, 0, 0.0, 1.0]])
    assert np.exp(water.log_probability(states)) == pytest.approx([1.0, 1e-6])


def test_what_no_chart_covers_is_unknown():
    coast = land(shapely.box(-100, -100, 100, 0), sigma=5.0, coverage=shapely.box(-100, -100, 100, 100))
    water = DisplacedWater.persistent(ExactWater(unknown=0.7), coast, 0.9)
    points, errors = np.array([[0.0, 99.0], [0.0, 101.0], [0.0, 50.0]]), np.array([[0.0, 1.0], [0.0, -1.0], [0.0, 0.0]])
    assert water.probability(points, errors) == pytest.approx([0.7, 0.7, 1.0])
    assert water.nbytes > ExactWater().bind(coast).nbytes


@pytest.mark.parametrize(
    ("displacement", "remaining", "said"),
    [
        (-1.0, 5.0, "displacement_m: must be finite and not negative"),
        (np.nan, 5.0, "displacement_m: must be finite"),
        (5.0, 0.0, "remaining_m: must be finite and positive"),
    ],
)
def test_bad_deviations_are_refused(displacement, remaining, said):
    with pytest.raises(ParameterError, match=said):
        DisplacedWater(ExactWater(), land(COAST_SOUTH), displacement, remaining)


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_share_that_leaves_nothing_is_refused(share):
    with pytest.raises(ParameterError, match="share: must lie between 0 and 1"):
        DisplacedWater.persistent(ExactWater(), land(COAST_SOUTH), share)
