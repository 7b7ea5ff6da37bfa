"""A coast whose error persists, and a chart's bias: a ship at rest near land, a ship in a channel."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.optimize import minimize_scalar
from scipy.special import log_ndtr, ndtr
from scipy.stats import chi2, norm

from elusive.charts import BiasedWater, DisplacedWater, ExactWater, FieldWater, HardWater
from elusive.errors import ParameterError
from elusive.filters.particle.coast_error import CoastError, coast_bias, learn_bias, with_coast
from elusive.filters.particle.sir import ParticleFilter
from elusive.motion import ConstantVelocity, WithCoastError, complete, kinematic_names
from tests.charts.shapes import land
from tests.longer import longer

SIGMA = 10.0
STEPS = 100
SHORE = land(shapely.box(-5000, -5000, 0, 5000), sigma=SIGMA)  # land west of a straight coast
SHARE = 0.9
CORRELATION_M = 500.0


class Drifting:
    """A ship at rest: its place walks by a metre a step."""

    state_names = ("x", "vx", "y", "vy")
    step_m = 1.0

    def propagate(self, states, interval_s, rng):
        moved = np.array(states)
        moved[:, 0] += self.step_m * rng.standard_normal(len(states))
        return moved


class Place:
    """Position east with a Gaussian error."""

    deviation = 10.0

    def log_likelihood(self, states, measurement):
        return -0.5 * ((states[:, 0] - measurement) / self.deviation) ** 2


class Start:
    """Before anything is measured."""

    def __init__(self, motion):
        self.motion = motion

    def sample(self, n, rng):
        names = kinematic_names(self.motion)
        states = np.zeros((n, len(names)))
        states[:, 0] = -15.0 + 20.0 * rng.standard_normal(n)
        return complete(self.motion, states, rng)


def followed(parameters, measurements, seed, particles=4000):
    motion, knowledge = with_coast(Drifting(), ExactWater(), SHORE, parameters)
    filter_ = ParticleFilter(
        motion=motion, sensor=Place(), prior=Start(motion), knowledge=(knowledge,), particles=particles
    )
    rng = np.random.default_rng(seed)
    state = filter_.init(rng, 0.0)
    found = []
    for z in measurements:
        state = filter_.step(state, state.time_s + 1, z, rng)
        found.append((state.mean[0], np.sqrt(state.covariance[0, 0])))
    return np.array(found)


def on_a_grid(measurements, correlation_m, share):
    """The same recursion over place and coast's error, each on a fine grid; without a share, over place alone."""
    x, h = np.linspace(-65, 35, 201, retstep=True)
    u, w = np.linspace(-5, 5, 61, retstep=True) if share else (np.zeros(1), 1.0)
    jumps = np.arange(10)  # to either side alike, so that the errors of both are mixed at once
    chance = norm.pdf(jumps * h, scale=Drifting.step_m)
    chance /= chance[0] + 2 * chance[1:].sum()
    mixes = []
    for jump in jumps:
        kept = np.exp(-abs(jump * h) / correlation_m)
        # where the error's step is finer than the grid it stays
        mix = norm.pdf(u[:, None], kept * u, max(np.sqrt(1 - kept**2), 0.4 * w))
        mixes.append(mix / mix.sum(axis=0))
    log_water = np.log(1e-6 + (1 - 1e-6) * ndtr((x[:, None] / SIGMA + share**0.5 * u) / (1 - share) ** 0.5))
    density = np.outer(norm.pdf(x, -15, 20), norm.pdf(u)) * np.exp(log_water)
    found = []
    for z in measurements:
        moved = np.zeros_like(density)
        for jump, part, mix in zip(jumps, chance, mixes, strict=True):
            shifted = np.zeros_like(density)
            shifted[jump:] = density[: len(x) - jump]
            if jump:
                shifted[: len(x) - jump] += density[jump:]
            moved += part * shifted @ mix.T
        density = moved * np.exp(log_water + norm.logpdf(z, x, Place.deviation)[:, None])
        density /= density.sum()
        marginal = density.sum(axis=1)
        mean = marginal @ x
        found.append((mean, np.sqrt(marginal @ (x - mean) ** 2)))
    return np.array(found)


@pytest.mark.parametrize("truth", longer([-10.0, -20.0], -20.0))
@pytest.mark.parametrize(("kind", "share"), [("fresh", 0.0), ("persistent", SHARE)])
def test_a_ship_at_rest_near_land_as_the_recursion_on_a_grid_has_it(truth, kind, share):
    measurements = truth + Place.deviation * np.random.default_rng(1).standard_normal(STEPS)
    parameters = CoastError(coast_error=kind, coast_share=SHARE, coast_correlation_m=CORRELATION_M)
    runs = np.array([followed(parameters, measurements, seed) for seed in range(3)])
    expected = on_a_grid(measurements, CORRELATION_M, share)
    error = runs.mean(axis=0)[9:] - expected[9:]
    noise = runs.std(axis=0, ddof=1)[9:] / np.sqrt(3)
    assert np.sqrt((error**2).mean(axis=0)) == pytest.approx(0, abs=3 * np.sqrt((noise**2).mean(axis=0)).max() + 0.02)
    off = expected[50:, 0].mean() - truth
    # drawn anew each second, the error pushes the ship out to sea by more than its own deviations
    assert off > 3 * expected[50:, 1].mean() if kind == "fresh" else abs(off) < expected[50:, 1].mean()


def test_independent_errors_push_a_ship_at_rest_without_limit():
    """The error over the deviation grows as the root of the number of measurements; with a persistent one it does not.

    The ship lies a deviation inland, and what is measured is where it is. Drawn anew, the errors' most likely place is
    where ``(x - z) / r^2 = phi(x / s) / (s Phi(x / s))``, however long it is looked at.
    """
    x = np.linspace(-60, 40, 2001)
    u = np.linspace(-6, 6, 241)
    places, errors = (part.ravel() for part in np.meshgrid(x, u, indexing="ij"))
    states = np.column_stack([places, *np.zeros((3, len(places))), errors, np.zeros(len(places))])
    log_water = {}
    for kind in ("fresh", "persistent"):
        _, knowledge = with_coast(Drifting(), ExactWater(floor=1e-300), SHORE, CoastError(coast_error=kind))
        log_water[kind] = knowledge.log_probability(states).reshape(len(x), len(u))
    log_prior = np.broadcast_to(norm.logpdf(u), (len(x), len(u)))
    ratios = {"fresh": [], "persistent": []}
    looks = (100, 1000, 10_000)
    for kind, found in ratios.items():
        for k in looks:
            log_density = k * (norm.logpdf(-SIGMA, x, Place.deviation)[:, None] + log_water[kind]) + log_prior
            marginal = np.exp(log_density - log_density.max()).sum(axis=1)
            marginal /= marginal.sum()
            mean = marginal @ x
            found.append((mean + SIGMA) / np.sqrt(marginal @ (x - mean) ** 2))
            if kind == "fresh":
                best = x[marginal.argmax()]
    assert np.divide(ratios["fresh"], np.sqrt(looks)) == pytest.approx(ratios["fresh"][-1] / 100, rel=0.02)
    log_likelihood = minimize_scalar(
        lambda at: 0.5 * ((at + SIGMA) / Place.deviation) ** 2 - log_ndtr(at / SIGMA),
        bounds=(-20, 20),
        method="bounded",
    )
    assert best == pytest.approx(log_likelihood.x, abs=0.05)
    assert ratios["fresh"][0] > 8
    assert np.abs(ratios["persistent"]).max() < 1


WIDTH_M, SPEED_MPS, SEEDS = 50.0, 7.0, 6


class Fix:
    """Position with an error of 5 m on each axis."""

    deviation = 5.0

    def log_likelihood(self, states, measurement):
        return -0.5 * (((states[:, [0, 2]] - measurement) / self.deviation) ** 2).sum(axis=1)


class Departure:
    """About the origin, eastwards."""

    def sample(self, n, rng):
        return rng.normal([0.0, SPEED_MPS, 0.0, 0.0], [10.0, 1.0, 10.0, 1.0], (n, 4))


def in_a_channel(seed, steps=200):
    """A ship's winding way, and a chart of the channel it sails in, 30 m off in some direction."""
    rng = np.random.default_rng(seed)
    direction = 2 * np.pi * seed / SEEDS
    bias = 30.0 * np.array([np.cos(direction), np.sin(direction)])
    motion = ConstantVelocity(q=0.2)
    state, way = np.array([[0.0, SPEED_MPS, 0.0, 0.0]]), []
    for _ in range(steps):
        state = motion.propagate(state, 1.0, rng)
        way.append(state[0, [0, 2]])
    way = np.array(way)
    middle = shapely.LineString([way[0] - [60, 0], *way[::10], way[-1], way[-1] + [60, 0]])
    # anywhere in the channel alike, as the filter believes beforehand
    aside, towards = 0.92 * WIDTH_M / 2 * np.sqrt(rng.random()), 2 * np.pi * rng.random()
    channel = shapely.affinity.translate(middle.buffer(WIDTH_M / 2), aside * np.cos(towards), aside * np.sin(towards))
    shore = shapely.box(*middle.buffer(400).bounds) - channel
    coast = land(*shapely.get_parts(shapely.affinity.translate(shore, *bias)), sigma=5.0)
    return way, coast, bias, motion, rng


@pytest.mark.thorough
def test_a_chart_30_m_off_is_found_out():
    """The error of the bias, in its own deviations, is as large as it should be; and the ship is not misled."""
    nees, deviation, ways = [], [], []
    for seed in range(SEEDS):
        way, coast, bias, motion, rng = in_a_channel(seed)
        parameters = CoastError(coast_error="bias", bias_sd_m=30.0)
        motion, knowledge = with_coast(motion, HardWater() if seed % 2 else FieldWater(), coast, parameters)
        filter_ = ParticleFilter(motion=motion, sensor=Fix(), prior=Departure(), particles=500, knowledge=(knowledge,))
        state = filter_.init(rng, 0.0)
        for place in way:
            before, state = (
                state,
                filter_.step(state, state.time_s + 1, place + Fix.deviation * rng.standard_normal(2), rng),
            )
            filter_ = filter_.replace(knowledge=learn_bias(filter_.knowledge, [(before, state)], parameters))
        found = coast_bias(filter_.knowledge)
        error = found.mean_m - bias
        nees.append(error @ np.linalg.solve(found.covariance_m2, error))
        deviation.append(np.sqrt(np.trace(found.covariance_m2) / 2))
        ways.append(np.hypot(*(state.mean[[0, 2]] - way[-1])))
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 2 * SEEDS)
    assert low < sum(nees) < high
    # 13 m on the mean of sixty seeds, each run's 3 m off it
    assert np.mean(deviation) < 18.0
    assert np.sqrt(np.mean(np.square(ways))) < 1.5 * np.sqrt(2) * Fix.deviation


def test_each_kind_joins_what_belongs_together():
    motion = ConstantVelocity()
    for kind, carrying, knowing in (
        ("fresh", ConstantVelocity, type(ExactWater().bind(SHORE))),
        ("persistent", WithCoastError, DisplacedWater),
        ("bias", ConstantVelocity, BiasedWater),
    ):
        parameters = CoastError(coast_error=kind, coast_correlation_m=70.0)
        moving, knowledge = with_coast(motion, ExactWater(), SHORE, parameters)
        assert (type(moving), type(knowledge)) == (carrying, knowing)
        assert (coast_bias((knowledge,)) is None) == (kind != "bias")
        if kind != "bias":
            assert learn_bias((knowledge,), [], parameters) == (knowledge,)
        states = complete(moving, np.zeros((5, 4)), np.random.default_rng(0))
        assert np.isfinite(knowledge.log_probability(states)).all()
    assert with_coast(motion, ExactWater(), SHORE, CoastError(coast_error="persistent"))[0].correlation_m == 200.0


@pytest.mark.parametrize(("field", "value"), [("coast_share", 1.0), ("coast_correlation_m", 0.0), ("bias_sd_m", -1.0)])
def test_values_out_of_bounds_are_refused(field, value):
    with pytest.raises(ParameterError, match=rf"CoastError\.{field}: must be"):
        CoastError(**{field: value})
