"""The Bernoulli filter against its NumPy twin, an exact Bayes filter and closed forms."""

from __future__ import annotations

import gc
import tracemalloc

import numpy as np
import pytest

from elusive import collect, run
from elusive.contracts import Births
from elusive.errors import DataError
from elusive.filters.particle.bernoulli import BernoulliFilter
from elusive.filters.particle.births import MeasurementBirth, UniformBirth
from elusive.motion import (
    ConstantAcceleration,
    ConstantTurnRateVelocity,
    ConstantVelocity,
    CoordinatedTurn,
    WithIntensity,
    square_root,
)
from elusive.sensors.image import ImageSensor
from tests.reference.filters import bernoulli_step

P_BIRTH, P_DEATH = 0.1, 0.15


def film(sensor, n, seed, intensity=25.0):
    rng = np.random.default_rng(seed)
    path = [np.array([[4.0 + 0.3 * k, 0.3, 6.0, 0.0, intensity]]) for k in range(n)]
    return [sensor.simulate(state if k >= 2 else state[:0], rng) for k, state in enumerate(path)]


@pytest.mark.parametrize(
    "motion",
    [WithIntensity(), WithIntensity(motion=CoordinatedTurn()), WithIntensity(motion=ConstantAcceleration(q=0.0))],
    ids=lambda motion: motion.motion.kind,
)
@pytest.mark.parametrize("masked", [False, True], ids=["whole", "masked"])
def test_a_step_equals_its_twin(motion, masked):
    sensor = ImageSensor(rows=11, columns=14, dy=1.2)
    birth = {"acceleration_sd": 0.0} if motion.motion.kind == "ca" else {}
    model = BernoulliFilter(motion=motion, sensor=sensor, particles=600, newborns=200)
    model = model.replace(birth=model.birth.replace(**birth))
    root = square_root(motion.Q(1.0))
    state = model.init(np.random.default_rng(0), 0.0)
    for k, frame in enumerate(film(sensor, 6, seed=1)):
        if masked:
            frame[5:7, 4] = np.nan, np.inf
        twin = bernoulli_step(model, root, state, frame, np.random.default_rng(k))
        state = model.step(state, state.time_s + 1, frame, np.random.default_rng(k))
        for name, found, expected in zip(state._fields, state, twin, strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10, err_msg=name)
    assert state.existence > 0.5


class OwnSensor(ImageSensor):
    """A user's own sensor: the filter does not know that it is the built-in one."""


@pytest.mark.parametrize("birth", [MeasurementBirth(), UniformBirth()], ids=lambda birth: birth.kind)
@pytest.mark.parametrize("spread_within", [None, 0.0])
def test_the_compiled_step_equals_the_steps_parts(birth, spread_within):
    built_in = BernoulliFilter(birth=birth, spread_within=spread_within, particles=600, newborns=200)
    own = built_in.replace(sensor=OwnSensor())
    state = other = built_in.init(np.random.default_rng(0), -1.0)
    for k, frame in enumerate(film(built_in.sensor, 8, seed=2)):
        measurement = None if k == 5 else frame
        state = built_in.step(state, k, measurement, np.random.default_rng(k))
        other = own.step(other, k, measurement, np.random.default_rng(k))
        for name, found, expected in zip(state._fields, state, other, strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9, err_msg=name)


def test_a_motion_that_is_not_linear_is_smoothed_as_well():
    motion = WithIntensity(motion=ConstantTurnRateVelocity(), q_intensity=0.0)
    model = BernoulliFilter(motion=motion, particles=600, newborns=200)
    distinct = []
    for spread_within in (None, 0.0):
        *_, state = run(
            model.replace(spread_within=spread_within), film(model.sensor, 12, seed=3), np.random.default_rng(4)
        )
        assert state.existence > 0.9
        distinct.append(len(np.unique(state.particles[:600, -1])))
    assert distinct[0] > 2 * distinct[1]


class Grid:
    """A user's own target that stands still on one of ``n`` places, drawn uniformly when it appears."""

    state_names = ("place",)

    def __init__(self, n, pictures):
        self.n, self.pictures = n, pictures

    def propagate(self, states, interval_s, rng):
        # with a chance of a fifth it hops to the next place
        return (states + (rng.random(states.shape) < 0.2)) % self.n

    def log_likelihood(self, states, measurement):
        expected = self.pictures[states[:, 0].astype(int)]
        return (expected * (measurement - expected / 2)).sum(axis=1)

    def draw(self, n, measurement, sensor, state_names, rng):
        return Births(rng.integers(self.n, size=(n, 1)).astype(float), np.zeros(n))


def exact_existence(grid, frames, initial):
    """The same model by sums over (absent, places): existence and place probabilities after each frame."""
    hop = 0.8 * np.eye(grid.n) + 0.2 * np.roll(np.eye(grid.n), 1, axis=0)
    absent, places, found = 1 - initial, np.full(grid.n, initial / grid.n), []
    for frame in frames:
        places, absent = (
            (1 - P_DEATH) * hop @ places + P_BIRTH * absent / grid.n,
            P_DEATH * places.sum() + (1 - P_BIRTH) * absent,
        )
        if frame is not None:
            places = places * np.exp((grid.pictures * (frame - grid.pictures / 2)).sum(axis=1))
        total = absent + places.sum()
        absent, places = absent / total, places / total
        found.append((places.sum(), places / places.sum()))
    return found


def test_existence_and_place_agree_with_the_exact_filter():
    rng = np.random.default_rng(2)
    grid = Grid(9, 1.3 * np.eye(9))
    truth = [None, None, 3, 4, 4, 4, 5, None, None, None]
    frames = [(0 if at is None else grid.pictures[at]) + rng.standard_normal(9) for at in truth]
    frames[5] = None
    model = BernoulliFilter(
        motion=grid, sensor=grid, birth=grid, birth_probability=P_BIRTH, death_probability=P_DEATH,
        initial_existence=0.3, particles=1500, newborns=500,
    )  # fmt: skip
    runs = 40
    every = [list(run(model, frames, np.random.default_rng(seed), start_s=-1.0)) for seed in range(runs)]
    for k, (existence, places) in enumerate(exact_existence(grid, frames, 0.3)):
        found = np.array([states[k].existence for states in every])
        shares = np.array([np.bincount(s[k].particles[:, 0].astype(int), s[k].weights, minlength=9) for s in every])
        # five standard errors, and a bias of the order of one over the number of particles
        error = found.std(ddof=1) / np.sqrt(runs)
        assert abs(found.mean() - existence) < 5 * error + 0.002
        assert error < 0.01
        error = shares.std(axis=0, ddof=1) / np.sqrt(runs)
        np.testing.assert_array_less(abs(shares.mean(axis=0) - places), 5 * error + 0.002)


def test_a_missing_frame_is_a_prediction_in_closed_form():
    grid = Grid(5, np.eye(5))
    model = BernoulliFilter(
        motion=grid, sensor=grid, birth=grid, birth_probability=P_BIRTH, death_probability=P_DEATH,
        initial_existence=0.6, particles=300, newborns=100,
    )  # fmt: skip
    existence = 0.6
    for state in run(model, [None] * 8, np.random.default_rng(3), start_s=-1.0):
        existence = (1 - P_DEATH) * existence + P_BIRTH * (1 - existence)
        assert state.existence == pytest.approx(existence, rel=1e-12)
        # survivors and newborns hold the mass that is theirs
        assert state.weights.sum() == pytest.approx(1)
    born = P_BIRTH * (1 - previous(existence)) / existence
    assert state.weights[300:].sum() == pytest.approx(born, rel=1e-12)


def previous(existence):
    """Existence one prediction earlier."""
    return (existence - P_BIRTH) / (1 - P_DEATH - P_BIRTH)


@pytest.mark.parametrize(("initial", "expected"), [(0.0, 0.0), (1.0, 1.0)])
def test_without_births_and_deaths_existence_stays(initial, expected):
    grid = Grid(5, 2 * np.eye(5))
    model = BernoulliFilter(
        motion=grid, sensor=grid, birth=grid, birth_probability=0.0, death_probability=0.0, initial_existence=initial,
        particles=300, newborns=100,
    )  # fmt: skip
    states = list(run(model, [np.ones(5), -np.ones(5), np.eye(5)[2], None], np.random.default_rng(5), start_s=-1.0))
    assert [state.existence for state in states] == [expected] * 4
    assert all(np.isfinite(state.mean).all() for state in states)


def test_certain_birth_and_death():
    model = BernoulliFilter(initial_existence=0.3, birth_probability=1.0, death_probability=1.0, particles=50)
    state = next(run(model, [None], np.random.default_rng(6), start_s=-1.0))
    assert state.existence == pytest.approx(0.7, rel=1e-12)
    assert state.weights[:50].sum() == 0.0


def test_a_likelihood_beyond_all_numbers_is_weighed():
    class Overwhelming(Grid):
        def log_likelihood(self, states, measurement):
            return np.where(states[:, 0] == 2, measurement, -np.inf)

    grid = Overwhelming(5, np.eye(5))
    model = BernoulliFilter(motion=grid, sensor=grid, birth=grid, particles=300, newborns=100)
    for log_ratio, existence in [(5000.0, 1.0), (-5000.0, 0.0), (-np.inf, 0.0)]:
        state = next(run(model, [log_ratio], np.random.default_rng(7), start_s=-1.0))
        assert state.existence == pytest.approx(existence, abs=1e-12)
        assert np.isfinite(state.weights).all()
    strong = next(run(model, [5000.0], np.random.default_rng(7), start_s=-1.0))
    assert (strong.particles[strong.weights > 0] == 2).all()


def test_a_target_that_leaves_the_frame_is_absent():
    # it runs east at one cell a frame; its patch reaches two cells beyond the border
    sensor = ImageSensor(rows=8, columns=8)
    quiet = WithIntensity(motion=ConstantVelocity(q=0.0), q_intensity=0.0)
    model = BernoulliFilter(
        motion=quiet, sensor=sensor, birth=UniformBirth(max_speed=0.0), birth_probability=0.0, death_probability=0.0,
        initial_existence=1.0, particles=200, newborns=50,
    )  # fmt: skip
    state = model.init(np.random.default_rng(8), 0.0)
    eastward = np.tile([6.5, 1.0, 4.0, 0.0, 20.0], (200, 1))
    state = state._replace(particles=eastward, weights=np.full(200, 1 / 200))
    existence = []
    for _ in range(4):
        state = model.step(state, state.time_s + 1, None, np.random.default_rng(9))
        existence.append(state.existence)
    # 7.5, 8.5 are within 7 + 2; 9.5 is not
    assert existence == [1.0, 1.0, 0.0, 0.0]
    half = state._replace(
        existence=1.0, particles=np.repeat([[6.5, 0, 4, 0, 20.0], [8.5, 1.0, 4, 0, 20.0]], 100, axis=0)
    )
    half = half._replace(weights=np.full(200, 1 / 200))
    assert model.step(half, half.time_s + 1, None, np.random.default_rng(10)).existence == pytest.approx(0.5, rel=1e-12)


def test_it_finds_a_bright_target_and_loses_it_again():
    sensor = ImageSensor()
    rng = np.random.default_rng(11)
    bright = sensor.intensity_of(12.0)
    path = [(5 + 0.4 * k, 0.4, 8 + 0.2 * k, 0.2, bright) if 4 <= k < 16 else None for k in range(22)]
    frames = [sensor.simulate(np.array([at]) if at else np.empty((0, 5)), rng) for at in path]
    model = BernoulliFilter()
    model = model.replace(birth=model.birth.replace(snr_db=12.0))
    data = collect(run(model, frames, rng, start_s=-1.0), state_names=model.state_names)
    existence, mean = data["existence"].values, data["mean"].values
    assert existence[8:16].min() > 0.95
    assert existence[:3].max() < 0.5
    assert existence[19:].max() < 0.3
    errors = [np.hypot(mean[k, 0] - path[k][0], mean[k, 2] - path[k][2]) for k in range(8, 16)]
    assert max(errors) < 1.0
    deviation = np.sqrt(data["covariance"].sel(state="x", state_="x").values[8:16])
    assert (deviation > 0.02).all()
    assert (deviation < 1).all()


def test_a_frame_of_another_size_is_refused():
    model = BernoulliFilter(particles=10, newborns=10)
    state = model.init(np.random.default_rng(0), 0.0)
    with pytest.raises(DataError, match=r"frame: has shape \(3, 3\), the sensor expects \(20, 20\)"):
        model.step(state, state.time_s + 1, np.zeros((3, 3)), np.random.default_rng(0))


@pytest.mark.parametrize(("part", "name"), [("propagate", "motion"), ("draw", "birth")])
def test_a_part_that_gives_states_of_another_shape_is_refused(part, name):
    class Shapeless(Grid):
        def propagate(self, states, interval_s, rng):
            return states[:, 0] if part == "propagate" else states

        def draw(self, n, measurement, sensor, state_names, rng):
            births = super().draw(n, measurement, sensor, state_names, rng)
            return births._replace(states=births.states[:1]) if part == "draw" and n == 20 else births

    grid = Shapeless(5, np.eye(5))
    model = BernoulliFilter(motion=grid, sensor=grid, birth=grid, particles=60, newborns=20)
    with pytest.raises(DataError, match=rf"^{name}: gave states of shape \(.*\), the filter needs \(.0, 1\), one row"):
        next(run(model, [None], np.random.default_rng(0), start_s=-1.0))


@pytest.mark.thorough
def test_memory_stays_flat_over_a_long_stream():
    model = BernoulliFilter(particles=60, newborns=20)
    frame, rng = film(model.sensor, 1, seed=12)[0], np.random.default_rng(13)
    stream = run(model, (frame for _ in range(5200)), rng, start_s=-1.0)
    for _ in range(200):
        next(stream)
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        for _ in stream:
            pass
        gc.collect()
        grown = tracemalloc.get_traced_memory()[0] - before
        peak = tracemalloc.get_traced_memory()[1] - before
    finally:
        tracemalloc.stop()
    # one state is 80 x 5 numbers: nothing of 5000 frames may stay
    assert grown < 100_000
    assert peak < 300_000
