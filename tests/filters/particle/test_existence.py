"""The paper's filter, in which each particle carries existence."""

from __future__ import annotations

import numpy as np
import pytest

from elusive import run
from elusive.filters.particle import existence as module
from elusive.filters.particle.bernoulli import BernoulliFilter
from elusive.filters.particle.births import MeasurementBirth
from elusive.filters.particle.existence import ExistenceParticleFilter
from elusive.sensors.image import ImageSensor
from tests.reference.filters import existence_update, transition


def test_the_markov_chain_equals_its_twin_and_its_closed_form():
    present = np.random.default_rng(0).random(50_000) < 0.3
    later = module._regime_transition(present, 0.1, 0.25, np.random.default_rng(1))
    np.testing.assert_array_equal(later, transition(present, 0.1, 0.25, np.random.default_rng(1)))
    n = present.sum()
    assert abs(later[present].mean() - 0.75) < 5 * np.sqrt(0.75 * 0.25 / n)
    assert abs(later[~present].mean() - 0.1) < 5 * np.sqrt(0.1 * 0.9 / (50_000 - n))


def test_the_update_equals_its_twin():
    rng = np.random.default_rng(2)
    present, particles = rng.random(300) < 0.4, rng.normal(size=(300, 5))
    log_weight = np.where(present, rng.normal(scale=2, size=300), 0.0)
    state = ExistenceParticleFilter._posterior(0.0, present, particles, log_weight)
    existence, mean, covariance = existence_update(present, particles, np.exp(log_weight))
    assert state.existence == pytest.approx(existence, rel=1e-12)
    np.testing.assert_allclose(state.mean, mean, atol=1e-12)
    np.testing.assert_allclose(state.covariance, covariance, atol=1e-12)
    assert state.weights.sum() == pytest.approx(1)


def test_it_agrees_with_the_bernoulli_filter():
    sensor = ImageSensor(rows=8, columns=8)
    rng = np.random.default_rng(3)
    target = np.array([[3.5, 0.0, 4.2, 0.0, sensor.intensity_of(9.0)]])
    frames = [sensor.simulate(target if k >= 2 else target[:0], rng) for k in range(5)]
    runs, common = 10, {"sensor": sensor, "initial_existence": 0.2}
    ours = ExistenceParticleFilter(particles=8000, birth=MeasurementBirth(), **common)
    other = BernoulliFilter(particles=4000, newborns=1000, **common)
    curves = [
        np.array(
            [
                [s.existence for s in run(model, frames, np.random.default_rng(seed), start_s=-1.0)]
                for seed in range(runs)
            ]
        )
        for model in (ours, other)
    ]
    error = np.sqrt(sum(curve.var(axis=0, ddof=1) for curve in curves) / runs)
    np.testing.assert_array_less(abs(curves[0].mean(axis=0) - curves[1].mean(axis=0)), 5 * error + 0.01)
    assert error.max() < 0.03
    assert np.ptp(curves[0].mean(axis=0)) > 0.3


def test_a_missing_frame_is_a_prediction():
    model = ExistenceParticleFilter(
        particles=40_000, initial_existence=0.3, birth_probability=0.1, death_probability=0.2
    )
    state = model.init(np.random.default_rng(4), 0.0)
    present = state.existence
    assert abs(present - 0.3) < 5 * np.sqrt(0.21 / 40_000)
    after = model.step(state, state.time_s + 1, None, np.random.default_rng(5))
    stays = np.exp(model.sensor.log_in_view(state.particles[state.present]))
    assert stays.all()
    expected = 0.8 * present + 0.1 * (1 - present)
    assert abs(after.existence - expected) < 5 * np.sqrt(expected / 40_000)


@pytest.mark.parametrize(("initial", "expected"), [(0.0, 0.0), (1.0, 1.0)])
def test_without_births_and_deaths_existence_stays(initial, expected):
    model = ExistenceParticleFilter(
        particles=500, initial_existence=initial, birth_probability=0.0, death_probability=0.0
    )
    frame = model.sensor.simulate(np.array([[9.0, 0, 9.0, 0, 30.0]]), np.random.default_rng(6))
    states = list(run(model, [frame, None, frame], np.random.default_rng(7), start_s=-1.0))
    assert [state.existence for state in states] == [expected] * 3
    assert all(np.isfinite(state.mean).all() for state in states)
