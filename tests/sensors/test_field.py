"""Sensors whose readings add up: against the definitions, with the whole covariance."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import AdditiveSensor
from elusive.errors import DataError
from elusive.sensors.field import FieldSensors
from tests.reference import field as reference

GRID = tuple((float(x), float(y)) for y in range(0, 40, 10) for x in range(0, 50, 10))
SENSOR = FieldSensors(positions_m=GRID, power=500.0, core_m=5.0, noise_sd=1.3)


def cloud(rng, centre, spread=1.5, n=60):
    """Particles ``(n, 4)`` about a place, with weights."""
    states = np.zeros((n, 4))
    states[:, [0, 2]] = centre + spread * rng.standard_normal((n, 2))
    weights = rng.random(n)
    return states, weights / weights.sum()


def effects(rng, *existences):
    for k, existence in enumerate(existences):
        states, weights = cloud(rng, (10.0 + 9 * k, 20.0))
        yield SENSOR.effect(SENSOR.expected(states), weights, existence)


def test_it_is_an_additive_sensor():
    assert isinstance(SENSOR, AdditiveSensor)


def test_power_equals_its_twin():
    states, _ = cloud(np.random.default_rng(0), (20.0, 10.0), 20.0)
    x, y = np.array(GRID).T
    expected = reference.power_at(states[:, [0, 2]], x, y, 500.0, 25.0)
    np.testing.assert_allclose(SENSOR.added(states), expected, rtol=1e-14)


@pytest.mark.parametrize("existence", [0.0, 0.3, 1.0])
def test_an_effect_has_the_moments_of_what_may_be_added(existence):
    states, weights = cloud(np.random.default_rng(1), (20.0, 20.0))
    effect = SENSOR.effect(SENSOR.expected(states), weights, existence)
    added = SENSOR.added(states)
    mean = existence * weights @ added
    variance = existence * weights @ added**2 - mean**2
    np.testing.assert_allclose(effect.mean, mean, atol=1e-12)
    np.testing.assert_allclose(np.diag(reference.covariance_of(effect)), variance, rtol=1e-6, atol=1e-9)


def test_the_covariance_is_whole_where_the_readings_are_linear_in_the_place():
    # within 10 cm of a place 500 / (d^2 + 25) is as good as straight
    states, weights = cloud(np.random.default_rng(2), (14.0, 23.0), 0.1, 4000)
    effect = SENSOR.effect(SENSOR.expected(states), weights, 0.8)
    added = SENSOR.added(states)
    mean = weights @ added
    whole = 0.8 * (added * weights[:, None]).T @ added - 0.64 * np.outer(mean, mean)
    found = reference.covariance_of(effect)
    np.testing.assert_allclose(found, whole, atol=0.01 * np.abs(whole).max())


@pytest.mark.parametrize("existences", [(), (0.9,), (1.0, 0.4, 0.05)])
def test_the_ratio_equals_that_of_whole_gaussians(existences):
    rng = np.random.default_rng(3)
    others = list(effects(rng, *existences))
    states, _ = cloud(rng, (25.0, 12.0), 8.0, 25)
    measurement = SENSOR.simulate(states[:2], rng)
    measurement[[3, 11]] = np.nan
    expected = reference.log_ratio(SENSOR.added(states), measurement, SENSOR.noise_variance, others)
    np.testing.assert_allclose(SENSOR.log_ratio(SENSOR.expected(states), measurement, others), expected, atol=1e-9)


def test_without_a_reading_nothing_is_said():
    states, _ = cloud(np.random.default_rng(4), (25.0, 12.0))
    silent = np.full(len(GRID), np.nan)
    np.testing.assert_array_equal(SENSOR.log_ratio(SENSOR.expected(states), silent, ()), np.zeros(len(states)))


def test_readings_are_simulated_with_their_noise():
    states = np.array([[10.0, 0, 10, 0], [30.0, 0, 20, 0]])
    rng = np.random.default_rng(5)
    drawn = np.array([SENSOR.simulate(states, rng) for _ in range(4000)])
    error = 1.3 / np.sqrt(4000)
    np.testing.assert_allclose(drawn.mean(axis=0), SENSOR.added(states).sum(axis=0), atol=4.5 * error)
    np.testing.assert_allclose(drawn.std(axis=0), 1.3, atol=4.5 * error)


@pytest.mark.parametrize("measurement", [np.zeros(3), np.full(len(GRID), np.inf)])
def test_what_is_no_measurement_is_refused(measurement):
    with pytest.raises(DataError, match="one number a sensor"):
        SENSOR.log_likelihood(np.zeros((1, 4)), measurement)
