"""Knowledge in filters that detect: what a map forbids speaks against a target, what leaves the view is absent."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.charts import IntervalWater
from elusive.errors import DataError
from elusive.filters.particle.bernoulli import BernoulliFilter
from elusive.filters.particle.births import MeasurementBirth, UniformBirth
from elusive.filters.particle.existence import ExistenceParticleFilter
from elusive.filters.particle.parts import switching
from elusive.filters.particle.sir import ParticleFilter
from elusive.filters.priors import GaussianPrior
from elusive.motion import ConstantVelocity, WithIntensity
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.image import ImageSensor

STILL = WithIntensity(motion=ConstantVelocity(q=0.0), q_intensity=0.0)
SENSOR = ImageSensor(rows=8, columns=8)


class West:
    """Half as probable east of a line."""

    def __init__(self, x, share=0.5):
        self.x, self.log_share = x, math.log(share) if share else -math.inf

    def log_probability(self, states):
        return np.where(states[:, 0] > self.x, self.log_share, 0.0)


def filters(**parameters):
    shared = {"motion": STILL, "sensor": SENSOR, "birth": UniformBirth(max_speed=0.0)}
    shared |= {"birth_probability": 0.0, "death_probability": 0.0, "initial_existence": 0.5} | parameters
    return [
        BernoulliFilter(particles=4000, newborns=50, **shared),
        ExistenceParticleFilter(particles=40_000, **shared),
    ]


@pytest.mark.parametrize("which", [0, 1], ids=["bernoulli", "existence"])
def test_what_a_map_says_is_evidence_of_existence(which):
    """Half of the targets that could be there are half as probable: odds of 1 become those of 3/4, a step later."""
    model = filters(knowledge=(FieldOfView(), West(3.5)))[which]
    state = model.init(np.random.default_rng(0), 0.0)
    assert state.existence == pytest.approx(0.5, abs=0.01)  # what is said before is said knowing the map
    east = state.particles[:, 0] > 3.5
    given = state.weights * getattr(state, "present", 1.0)
    assert given[east].sum() / given.sum() == pytest.approx(1 / 3, abs=0.03)
    plain = filters()[which].init(np.random.default_rng(0), 0.0)
    after = model.step(plain, 1.0, None, np.random.default_rng(1))
    assert after.existence == pytest.approx(0.75 / 1.75, abs=0.015)
    again = model.step(after, 1.0, None, np.random.default_rng(2))
    assert again.existence == pytest.approx(after.existence, abs=1e-12)  # the map is asked once at a time


@pytest.mark.parametrize("which", [0, 1], ids=["bernoulli", "existence"])
def test_a_target_where_a_map_allows_nothing_is_none(which):
    model = filters(knowledge=(West(-100.0, 0.0),))[which]
    state = filters()[which].init(np.random.default_rng(3), 0.0)
    assert model.step(state, 1.0, None, np.random.default_rng(4)).existence == 0.0


@pytest.mark.parametrize("which", [0, 1], ids=["bernoulli", "existence"])
def test_without_the_view_a_target_out_of_it_is_still_there(which):
    moving = {"motion": WithIntensity(motion=ConstantVelocity(q=0.0)), "initial_existence": 1.0}
    for knowledge, expected in (((FieldOfView(),), 0.0), ((), 1.0)):
        model = filters(knowledge=knowledge, **moving)[which]
        state = model.init(np.random.default_rng(5), 0.0)
        away = state.particles.copy()
        away[:, 1] = 50.0
        assert model.step(state._replace(particles=away), 1.0, None, np.random.default_rng(6)).existence == expected


def test_a_particle_filter_takes_any_number_of_pieces():
    banks = IntervalWater(lower_m=-5, upper_m=5, sigma_m=2.0), IntervalWater(lower_m=-1, upper_m=9, component="y")
    prior = GaussianPrior(mean=(0.0, 0, 0, 0), covariance=np.diag([9.0, 0, 9.0, 0]).tolist())
    model = ParticleFilter(motion=ConstantVelocity(), sensor=Place(), prior=prior, knowledge=banks, particles=5000)
    state = model.init(np.random.default_rng(7))
    allowed = [bank.probability(model.prior.sample(5000, np.random.default_rng(7))[:, [0, 2]]) for bank in banks]
    assert state.allowed == pytest.approx((allowed[0] * allowed[1]).mean(), rel=1e-9)


class Place:
    """A position with unit noise."""

    def log_likelihood(self, states, measurement):
        return -0.5 * ((states[:, [0, 2]] - measurement) ** 2).sum(axis=1)


class Cells:
    """A user's own sensor of frames: what CONTRIBUTING asks for, and no more."""

    rows, columns = 6, 9

    def log_likelihood(self, states, measurement):
        inside = (np.abs(states[:, 0] - 4) < 4.5) & (np.abs(states[:, 2] - 2.5) < 3)
        r, c = (np.clip(np.rint(states[:, k]).astype(int), 0, top) for k, top in ((2, 5), (0, 8)))
        return np.where(inside, 3.0 * measurement[r, c] - 4.5, 0.0)

    def birth_map(self, measurement, intensity):
        return 3.0 * measurement - 4.5


@pytest.mark.parametrize("kind", [BernoulliFilter, ExistenceParticleFilter])
def test_measurement_births_ask_a_users_sensor_for_no_more_than_it_must_have(kind):
    rng = np.random.default_rng(8)
    model = kind(motion=ConstantVelocity(q=1e-4), sensor=Cells(), birth=MeasurementBirth(snr_db=9.5), particles=4000)
    state = model.init(rng, 0.0)
    for k in range(8):
        frame = rng.standard_normal((6, 9))
        frame[2, 3] += 3.0
        state = model.step(state, k + 1.0, frame, rng)
    assert state.existence > 0.95
    np.testing.assert_allclose(state.mean[[0, 2]], [3, 2], atol=0.6)


@pytest.mark.parametrize("rates", [(0.05, 0.05), (0.3, 0.0), (0.0, 0.2), (0.0, 0.0), (0.6, 0.1)])
def test_births_and_deaths_are_one_chain_over_any_intervals(rates):
    assert switching(*rates, 1.0) == rates
    existence, once = 0.3, 0.3
    for interval_s in (0.25, 0.1, 1.65, 3.0):
        appears, disappears = switching(*rates, interval_s)
        assert 0 <= appears <= 1
        assert 0 <= disappears <= 1
        existence = (1 - disappears) * existence + appears * (1 - existence)
    for _ in range(5):
        once = (1 - rates[1]) * once + rates[0] * (1 - once)
    assert existence == pytest.approx(once, rel=1e-12)


@pytest.mark.parametrize("kind", [BernoulliFilter, ExistenceParticleFilter])
def test_a_second_frame_at_the_same_time_only_updates(kind):
    rng = np.random.default_rng(9)
    frames = [SENSOR.simulate(np.array([[4.0, 0, 4, 0, 25.0]]), rng) for _ in range(2)]
    model = kind(sensor=SENSOR, particles=500)
    state = model.step(model.init(rng, 0.0), 1.0, frames[0], rng)
    after = model.step(state, 1.0, frames[1], rng)
    np.testing.assert_array_equal(after.particles, state.particles)
    there = getattr(state, "present", np.ones(len(state.particles), bool))
    ratio = np.exp(SENSOR.log_likelihood(state.particles, frames[1]))
    given = state.weights[there] / state.weights[there].sum()
    seen = state.existence * float(given @ ratio[there])
    assert after.existence == pytest.approx(seen / (seen + 1 - state.existence), rel=1e-9)
    with pytest.raises(DataError, match=r"measurement at 0.5 s: comes after 1 s; sort the measurements by time"):
        model.step(after, 0.5, None, rng)
