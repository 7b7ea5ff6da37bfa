"""A chart's bias, learnt: against Bayes' rule in closed form beside a straight coast."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.special import ndtr, ndtri
from scipy.stats import norm

from elusive.charts import BiasedWater, ExactWater, HardWater
from elusive.errors import ParameterError

from .shapes import land

SHORE = land(shapely.box(-3000, -3000, 3000, 0), sigma=10.0)  # land south of a straight coast
BIAS_SD = 30.0


def at(*north):
    """States on the y axis, evenly weighted."""
    states = np.zeros((len(north), 4))
    states[:, 2] = north
    return states, np.full(len(north), 1 / len(north))


def truncated(mean, scale):
    """Mean and variance of a bias ~ N(0, BIAS_SD^2) once it is known that N(bias + mean, scale^2) is above zero."""
    total = np.hypot(BIAS_SD, scale)
    ratio = norm.pdf(mean / total) / ndtr(mean / total)
    first = BIAS_SD**2 / total * ratio
    return first, BIAS_SD**2 - BIAS_SD**4 / total**2 * ratio * (ratio + mean / total)


def test_before_anything_is_learnt_the_bias_adds_to_the_imprecision():
    water = BiasedWater(ExactWater(), SHORE, BIAS_SD)
    north = np.linspace(-70, 70, 29)
    found = np.exp(water.log_probability(at(*north)[0]))
    assert found == pytest.approx(ndtr(north / np.hypot(10.0, BIAS_SD)), abs=0.01)
    assert water.bias.mean_m == pytest.approx(0, abs=1e-9)
    assert water.nbytes > ExactWater().bind(SHORE).nbytes
    assert water.bias.covariance_m2 == pytest.approx(BIAS_SD**2 * np.eye(2), rel=0.01, abs=1e-9)


@pytest.mark.parametrize("north", [-40.0, -10.0, 0.0, 25.0, 200.0])
def test_one_place_at_sea_is_bayes_rule(north):
    learnt = BiasedWater(ExactWater(), SHORE, BIAS_SD).learn(*at(north))
    mean, variance = truncated(north, 10.0)
    assert learnt.bias.mean_m == pytest.approx([0, mean], abs=0.15)
    assert np.diag(learnt.bias.covariance_m2) == pytest.approx([BIAS_SD**2, variance], rel=0.02)


def test_what_the_map_did_to_the_particles_is_not_counted_twice():
    """A ship measured at -15 m, to 20 m, its particles then weighted by the map: as one place, less precise."""
    water = BiasedWater(ExactWater(), SHORE, BIAS_SD)
    states, _ = at(*(-15 + 20 * ndtri((np.arange(20_000) + 0.5) / 20_000)))
    weights = np.exp(water.log_probability(states))
    learnt = water.learn(states, weights / weights.sum())
    mean, variance = truncated(-15.0, np.hypot(10.0, 20.0))
    assert learnt.bias.mean_m == pytest.approx([0, mean], abs=0.6)
    assert learnt.bias.covariance_m2[1, 1] == pytest.approx(variance, rel=0.04)


def test_a_ship_at_rest_says_its_piece_once():
    water = BiasedWater(HardWater(), SHORE, BIAS_SD)
    once = water.learn(*at(-10.0))
    assert once.learn(*at(-10.0), kept=1.0).density == pytest.approx(once.density, rel=1e-12)
    soft = BiasedWater(ExactWater(), SHORE, BIAS_SD)
    first = soft.learn(*at(-10.0))
    squared = first.density**2 / soft.density
    kept = soft.learn(*at(-10.0)).learn(*at(-10.0), kept=0.4)
    for found, expected in (
        (first.learn(*at(-10.0)).density, squared),
        (kept.density, first.density * (first.density / soft.density) ** 0.6),
    ):
        assert found == pytest.approx(expected / expected.sum(), abs=1e-12)
    assert first.learn(*at(60.0), kept=1.0).density == pytest.approx(first.density, abs=1e-5)  # farther out says less


def test_learning_changes_nothing_that_was_there():
    water = BiasedWater(HardWater(), SHORE, BIAS_SD)
    before, states = water.density.copy(), at(-5.0, 5.0)[0]
    probability = water.log_probability(states)
    water.learn(*at(-30.0))
    assert np.array_equal(water.density, before)
    assert np.array_equal(water.log_probability(states), probability)


@pytest.mark.parametrize("deviation", [0.0, -1.0, np.inf, np.nan])
def test_a_deviation_that_is_none_is_refused(deviation):
    with pytest.raises(ParameterError, match="bias_sd_m: must be positive and finite"):
        BiasedWater(HardWater(), SHORE, deviation)


@pytest.mark.parametrize("kept", [-0.1, 1.1, np.nan])
def test_a_correlation_that_is_none_is_refused(kept):
    with pytest.raises(ParameterError, match="kept: must lie between 0 and 1"):
        BiasedWater(HardWater(), SHORE, BIAS_SD).learn(*at(0.0), kept=kept)
