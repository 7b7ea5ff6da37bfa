"""The particle MAP against every particle and parent by SciPy, and against the modes of known posteriors."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.optimize import minimize_scalar
from scipy.stats import norm

from elusive.charts import HardWater, IntervalWater
from elusive.errors import DataError, ParameterError
from elusive.filters.particle.estimates import marginal_map
from elusive.filters.particle.particle_map import map_estimate, marginal_mode
from elusive.filters.particle.sir import ParticleFilter, ParticleState
from elusive.filters.priors import GaussianPrior
from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, ConstantVelocity, CoordinatedTurn
from elusive.sensors.radar import RadarSensor
from tests.charts.shapes import land
from tests.longer import longer
from tests.reference.particle import map_index

SENSOR = RadarSensor()
SHIP = np.array([[-26.0, 0.0, 5_000.0, 7.0]])
EVERY = 10**9


class Line:
    """A position alone, that goes on from where it is with Gaussian noise."""

    state_names = ("x",)

    def F(self, interval_s):
        return np.eye(1)

    def Q(self, interval_s):
        return 50.0 * interval_s * np.eye(1)

    def propagate(self, states, interval_s, rng):
        return states + np.sqrt(50.0 * interval_s) * rng.standard_normal(states.shape)


class Far:
    """A position measured with a variance of 50."""

    def log_likelihood(self, states, measurement):
        return -0.01 * (states[:, 0] - measurement) ** 2


def two_steps(motion, knowledge, n, rng):
    """Beliefs before and after a plot, their weights uneven."""
    d = len(motion.state_names)
    prior = GaussianPrior(
        mean=(*SHIP[0], *(0.0,) * (d - 4)), covariance=np.diag([40.0, 4, 60, 4, 0.01, 0.01][:d]).tolist()
    )
    model = ParticleFilter(
        motion=motion,
        sensor=SENSOR,
        prior=prior,
        knowledge=() if knowledge is None else (knowledge,),
        particles=n,
        resample_below=0.1,
    )
    before = model.update(model.init(rng, 0.0), SENSOR.simulate(SHIP, rng))
    seen = SENSOR.simulate(SHIP + np.array([0, 0, 7.0, 0]), rng)
    return model, before, model.step(before, before.time_s + 1, seen, rng), seen


@pytest.mark.parametrize("knowledge", [None, IntervalWater()], ids=["no map", "map"])
@pytest.mark.parametrize(
    "motion",
    longer(
        [ConstantVelocity(q=2.0), CoordinatedTurn(q=2.0, turn_rate_deg=20), ConstantAcceleration(q=0.5)],
        CoordinatedTurn(q=2.0, turn_rate_deg=20),
    ),
)
def test_it_is_the_particle_that_the_whole_double_sum_chooses(motion, knowledge):
    rng = np.random.default_rng(1)
    for _ in range(4):
        model, before, after, seen = two_steps(motion, knowledge, 250, rng)
        assert np.ptp(before.weights) > 1e-4
        score = SENSOR.log_likelihood(after.particles, seen)
        if knowledge is not None:
            score += knowledge.log_probability(after.particles)
        best = map_index(after.particles, score, before.particles, before.weights, motion)
        found = map_estimate(model, before, after, seen, rng, EVERY, EVERY)
        np.testing.assert_array_equal(found, after.particles[best])
        # the best by a Gaussian prediction are enough; the parents drawn cost some probability
        np.testing.assert_array_equal(map_estimate(model, before, after, seen, rng, 100, EVERY), found)


def test_what_the_restriction_costs():
    """Loss of log posterior density against the best of all, for the default 200 candidates and 600 parents."""
    rng, losses = np.random.default_rng(2), []
    for _ in range(20):
        model, before, after, seen = two_steps(ConstantVelocity(q=2.0), IntervalWater(), 1500, rng)
        found = [map_estimate(model, before, after, seen, rng, *few) for few in ((EVERY, EVERY), (200, EVERY), ())]
        score = SENSOR.log_likelihood(np.array(found), seen) + IntervalWater().log_probability(np.array(found))
        off = np.array(found)[:, None] - before.particles @ model.motion.F(1.0).T
        exponents = np.einsum("cji,ik,cjk->cj", off, np.linalg.inv(model.motion.Q(1.0)), off)
        density = score + np.log(np.exp(-0.5 * exponents) @ before.weights)
        losses.append(density[0] - density[1:])
    losses = np.array(losses)
    assert losses.min() >= -1e-9
    assert losses[:, 0].max() < 0.05
    assert losses[:, 1].mean() < 0.3
    assert losses[:, 1].max() < 2


@pytest.mark.parametrize(
    ("mean", "sigma", "mode"),
    [
        (-26, 0.0, -25.0),
        (-26, 20.0, -25.02),
        (-26, 7.04, -23.60),
        (-26, 7.0, -23.592),
        (-35, 7.0, -30.25),
        (-35, 20.0, -33.64),
    ],
)
def test_modes_of_the_canal(mean, sigma, mode):
    """Bootsveld (2012), section 5.3: N(x; mean, 5^2) under the canal's banks; prediction and fix share the Gaussian."""
    canal = IntervalWater(sigma_m=sigma)
    model = ParticleFilter(
        motion=Line(),
        sensor=Far(),
        prior=GaussianPrior(mean=(mean,), covariance=((0.0,),)),
        knowledge=(canal,),
        particles=20_000,
        recover_below=0.0,
    )
    rng = np.random.default_rng(3)
    before = model.update(model.init(rng, 0.0)._replace(weights=np.full(20_000, 1 / 20_000)), None)
    after = model.step(before, before.time_s + 1, mean, rng)
    found = map_estimate(model, before, after, mean, rng)

    def cost(x):
        log_map = float(canal.log_probability(np.array([[x]]))[0])
        return -norm.logpdf(x, mean, 5) - log_map

    if sigma:
        assert minimize_scalar(cost, bounds=(-40, -10), method="bounded").x == pytest.approx(mode, abs=0.006)
    # twenty thousand particles lie some thousandths apart there, on a top flat to a few hundredths
    assert found == pytest.approx([mode], abs=0.03)
    if sigma:
        # the kernel estimate of a density this flat at its top wanders by a tenth of its deviation
        assert marginal_mode(after, 0) == pytest.approx(mode, abs=0.5)


def test_a_parent_anywhere_counts_by_its_weight():
    """Two parents, far apart: the lighter one's child is as likely by its plot, and loses."""
    model = ParticleFilter(
        motion=Line(), sensor=Far(), prior=GaussianPrior(mean=(0.0,), covariance=((1.0,),)), particles=2
    )
    states = np.array([[0.0], [100.0]])
    for weights, kept in (((0.6, 0.4), 0.0), ((0.4, 0.6), 100.0)):
        state = ParticleState(0.0, states, np.array(weights), states[0], np.eye(1), 0.0)
        assert map_estimate(model, state, state._replace(time_s=1.0), 50.0, np.random.default_rng(0)) == [kept]


def test_the_map_left_out_of_a_step_is_left_out_of_the_estimate():
    island = HardWater(floor=1e-300).bind(land(shapely.box(-500, 4000, 500, 6000)))
    rng = np.random.default_rng(4)
    model, before, after, seen = two_steps(ConstantVelocity(q=2.0), island, 500, rng)
    assert after.forbidden
    free = model.replace(knowledge=())
    found, expected = (map_estimate(one, before, after, seen, rng, EVERY, EVERY) for one in (model, free))
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    "motion", [ConstantVelocity(q=0.0), ConstantTurnRateVelocity(q_speed=0.5)], ids=["without noise", "not linear"]
)
def test_motions_without_a_density_take_a_kernel_estimate(motion):
    """The posterior is nearly Gaussian: its mode lies near the mean."""
    rng, off = np.random.default_rng(5), []
    for _ in range(10):
        model, before, after, seen = two_steps(motion, None, 1500, rng)
        found = map_estimate(model, before, after, seen, rng)
        assert (after.particles == found).all(axis=1).any()
        deviation = np.sqrt(np.diag(after.covariance))
        off.append(((found - after.mean) / deviation)[:4])
    assert np.abs(np.mean(off, axis=0)).max() < 0.5
    assert np.sqrt(np.mean(np.square(off))) < 0.8


def test_without_a_measurement_or_one_that_fits_it_is_the_predictions_mode():
    model, before, _, _ = two_steps(ConstantVelocity(q=2.0), None, 2000, np.random.default_rng(6))
    after = model.step(before, before.time_s + 1, None, np.random.default_rng(7))
    found = map_estimate(model, before, after, None, np.random.default_rng(8))
    assert (np.abs(found - after.mean) < 1.2 * np.sqrt(np.diag(after.covariance))).all()
    nothing = model.replace(sensor=SENSOR.replace(detection_probability=0.0))
    seen = SENSOR.simulate(SHIP, np.random.default_rng(9))
    assert nothing.step(before, before.time_s + 1, seen, np.random.default_rng(7)).log_evidence == -np.inf
    again = map_estimate(nothing, before, after, seen, np.random.default_rng(8))
    np.testing.assert_array_equal(again, found)


def test_the_same_seed_gives_the_same_particle_and_changes_nothing():
    model, before, after, seen = two_steps(ConstantVelocity(q=2.0), IntervalWater(), 1500, np.random.default_rng(10))
    kept = [part.copy() for part in (before.particles, before.weights, after.particles, after.weights)]
    one, two = (map_estimate(model, before, after, seen, np.random.default_rng(11)) for _ in range(2))
    np.testing.assert_array_equal(one, two)
    one[:] = 0.0
    for part, was in zip((before.particles, before.weights, after.particles, after.weights), kept, strict=True):
        np.testing.assert_array_equal(part, was)


def test_the_marginal_mode_is_that_of_the_components_density():
    *_, after, _ = two_steps(ConstantVelocity(q=2.0), IntervalWater(), 1500, np.random.default_rng(12))
    modes = marginal_map(after.particles, after.weights)
    assert [marginal_mode(after, k) for k in range(4)] == pytest.approx(modes, rel=1e-9)


def test_what_does_not_fit_is_refused():
    model, before, after, seen = two_steps(ConstantVelocity(q=2.0), None, 50, np.random.default_rng(13))
    rng = np.random.default_rng(14)
    with pytest.raises(ParameterError, match=r"candidates: must be at least 1 \(got 0\)"):
        map_estimate(model, before, after, seen, rng, candidates=0)
    with pytest.raises(ParameterError, match="parents: must be at least 1"):
        map_estimate(model, before, after, seen, rng, parents=-3)
    with pytest.raises(DataError, match="have 4 and 3 components, the motion 4"):
        map_estimate(model, before, after._replace(particles=after.particles[:, :3]), seen, rng)
    with pytest.raises(ParameterError, match="component: 4 is none of a state's 4"):
        marginal_mode(after, 4)
