"""The noise object: likelihood against densities sample by sample, frames against their statistics, filters on it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from elusive import run
from elusive.contracts import Births, Knowledge, Sensor
from elusive.errors import DataError, ParameterError
from elusive.filters import BernoulliFilter, ParticleFilter
from elusive.filters.priors import GaussianPrior
from elusive.model import Model
from elusive.motion import ConstantVelocity
from elusive.sensors import NoiseObject, NoiseObjectPath
from elusive.sensors.field_of_view import FieldOfView
from tests.reference.waveform import covered, log_likelihood


def any_state(shape: tuple[int, ...], position: float, other: float) -> np.ndarray:
    return np.array([position, 0.3]) if len(shape) == 1 else np.array([position, 0.3, other, -0.2])


@settings(max_examples=150, deadline=None)
@given(
    shape=st.sampled_from([(1,), (7,), (40,), (9, 14), (14, 9), (1, 6)]),
    size=st.integers(1, 6),
    mode=st.sampled_from(["additive", "replacing"]),
    border=st.sampled_from(["circular", "bounded"]),
    places=st.lists(st.tuples(st.floats(-20, 60), st.floats(-20, 60)), min_size=0, max_size=5),
    deviations=st.tuples(st.floats(0.1, 3), st.floats(0.1, 3)),
)
def test_likelihood_is_the_sum_of_log_densities(shape, size, mode, border, places, deviations) -> None:
    if border == "circular":
        size = min(size, *shape)
    sensor = NoiseObject(
        shape=shape,
        object_size=size,
        mode=mode,
        border=border,
        object_deviation=deviations[0],
        background_deviation=deviations[1],
    )
    frame = 2 * np.random.default_rng(len(places)).standard_normal(shape)
    states = np.array([any_state(shape, *place) for place in places]).reshape(-1, 2 * len(shape))
    expected = [log_likelihood(sensor, state, frame) for state in states]
    # a centre within rounding of the edge between two samples belongs to either
    halves = np.array([[p - size / 2 for p in place] for place in places]).reshape(-1, 2)
    clear = (np.abs(halves - np.round(halves)) > 1e-9).all(axis=1) | (halves == np.round(halves)).all(axis=1)
    found = sensor.log_likelihood(states, frame)
    assert found.shape == (len(places),)
    np.testing.assert_allclose(found[clear], np.array(expected)[clear], rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize(
    ("size", "x", "samples"),
    [
        (1, 4.0, [4]),
        (3, 4.0, [3, 4, 5]),
        (3, 4.4, [3, 4, 5]),
        (3, 4.6, [4, 5, 6]),
        (4, 4.5, [3, 4, 5, 6]),
        (4, 4.0, [2, 3, 4, 5]),
        (4, 0.5, [0, 1, 2, 11]),
        (3, 12.0, [0, 1, 11]),
        (3, -13.0, [0, 10, 11]),
    ],
)
def test_where_an_object_stands(size: int, x: float, samples: list[int]) -> None:
    """The tells are large: the frame's samples, and the likelihood of a frame with one loud sample."""
    sensor = NoiseObject(shape=(12,), object_size=size, object_deviation=1e6, background_deviation=1e-6)
    frame = sensor.simulate(np.array([[x, 0.0]]), np.random.default_rng(1))
    assert np.flatnonzero(np.abs(frame) > 1).tolist() == samples
    quiet = NoiseObject(shape=(12,), object_size=size)
    loud = [i for i in range(12) if quiet.log_likelihood(np.array([[x, 0.0]]), 9.0 * (np.arange(12) == i))[0] > 0]
    assert loud == samples


@pytest.mark.parametrize("mode", ["additive", "replacing"])
def test_a_frame_has_the_deviations_and_no_mean(mode: str) -> None:
    sensor = NoiseObject(
        shape=(30, 40), object_size=4, object_deviation=2.0, background_deviation=1.5, mode=mode, border="bounded"
    )
    states = np.array([[10.5, 0, 7.5, 0], [39.5, 0, 20.5, 0], [-50.0, 0, 3.0, 0]])
    rng = np.random.default_rng(2)
    frames = np.stack([sensor.simulate(states, rng) for _ in range(400)])
    inside = np.any([covered(sensor, state) for state in states], axis=0)
    assert inside.sum() == 16 + 8
    u = 2.5 if mode == "additive" else 2.0
    for mask, deviation in ((inside, u), (~inside, 1.5)):
        seen = frames[:, mask]
        assert seen.mean() == pytest.approx(0, abs=4 * deviation / np.sqrt(seen.size))
        assert seen.std() == pytest.approx(deviation, abs=4 * deviation / np.sqrt(2 * seen.size))
    by_column = frames[:, 6:10, 12].std(axis=0)  # the last column of the first object
    assert (np.abs(by_column - u) < 4 * u / np.sqrt(800)).all()


def test_overlapping_objects_add_up_or_the_last_shows() -> None:
    states, rng = np.array([[20.0, 0.0], [21.0, 0.0]]), np.random.default_rng(3)
    added = NoiseObject(shape=(50,), object_size=3, object_deviation=2.0)
    frames = np.stack([added.simulate(states, rng) for _ in range(4000)])
    expected = np.ones(50)
    expected[19:22] += 4
    expected[20:23] += 4
    np.testing.assert_allclose(frames.var(axis=0), expected, rtol=4 * np.sqrt(2 / 4000) * 1.2)
    instead = NoiseObject(shape=(50,), object_size=3, object_deviation=2.0, mode="replacing")
    assert np.stack([instead.simulate(states, rng) for _ in range(4000)])[:, 19:23].var() == pytest.approx(4, rel=0.05)


def test_no_object_is_the_background_alone_and_draws_no_more() -> None:
    sensor = NoiseObject(shape=(600,), background_deviation=0.7)
    frame = sensor.simulate(np.empty((0, 2)), np.random.default_rng(4))
    np.testing.assert_array_equal(frame, 0.7 * np.random.default_rng(4).standard_normal(600))
    assert sensor.log_likelihood(np.empty((0, 2)), frame).shape == (0,)


def test_masked_samples_and_lost_states_say_nothing() -> None:
    sensor = NoiseObject(shape=(60,), border="bounded")
    frame = np.random.default_rng(5).standard_normal(60)
    frame[[10, 12, 30]] = np.nan, np.inf, -np.inf
    states = np.array([[11.0, 0], [np.nan, 0], [np.inf, 0], [-2.6, 0], [1e300, 0], [-1e300, 0]])
    found = sensor.log_likelihood(states, frame)
    assert found[0] == pytest.approx(log_likelihood(sensor, states[0], frame))
    np.testing.assert_array_equal(found[1:], 0.0)
    np.testing.assert_array_equal(sensor.log_in_view(states[[0, 3, 4, 5]]), [0, -np.inf, -np.inf, -np.inf])
    np.testing.assert_array_equal(sensor.log_in_view(np.array([[-2.4, 0.0], [61.4, 0], [61.6, 0]])), [0, 0, -np.inf])
    everywhere = NoiseObject(shape=(60,))
    np.testing.assert_array_equal(everywhere.log_likelihood(states[1:3], frame), 0.0)
    np.testing.assert_array_equal(everywhere.log_in_view(states[[0, 3]]), 0.0)


@pytest.mark.parametrize("border", ["circular", "bounded"])
def test_a_sequence_has_its_objects_where_the_truth_says(border: str) -> None:
    sensor = NoiseObject(shape=(40, 50), object_size=3, object_deviation=1e5, background_deviation=1e-5, border=border)
    paths = [
        NoiseObjectPath(start=(45, 10), velocity=(2, -0.5), appears=2, leaves=6),
        NoiseObjectPath(start=(5, 30), velocity=(0, 0), appears=4),
    ]
    frames, truth = sensor.simulate_sequence(9, paths, np.random.default_rng(6))
    assert frames.shape == (9, 40, 50)
    assert truth.shape == (9, 2, 4)
    np.testing.assert_array_equal(np.isfinite(truth[:, 0, 0]), [False] * 2 + [True] * 5 + [False] * 2)
    np.testing.assert_array_equal(np.isfinite(truth[:, 1, 0]), [False] * 4 + [True] * 5)
    last = (45 + 2 * 4) % 50 if border == "circular" else 45 + 2 * 4
    np.testing.assert_array_equal(truth[6, 0], [last, 2, 8, -0.5])
    for frame, states in zip(frames, truth, strict=True):
        expected = np.zeros((40, 50), dtype=bool)
        for state in states[np.isfinite(states[:, 0])]:
            expected |= covered(sensor, state)
        np.testing.assert_array_equal(np.abs(frame) > 1, expected)


class Walk(Model):
    """Nearly constant velocity along a line."""

    q: float = 0.01

    @property
    def state_names(self) -> tuple[str, ...]:
        return ("x", "vx")

    def propagate(self, states: np.ndarray, interval_s: float, rng: np.random.Generator) -> np.ndarray:
        moved = states + np.sqrt(self.q) * rng.standard_normal(states.shape)
        moved[:, 0] += states[:, 1]
        return moved


class Anywhere(Model):
    """Newborn states uniform over the frame, up to one sample a frame."""

    def draw(self, n, measurement, sensor, state_names, rng) -> Births:
        low, high = ([0, -1], [sensor.shape[0], 1]) if len(state_names) == 2 else ([0, -1] * 2, [30, 1, 30, 1])
        return Births(rng.uniform(low, high, (n, len(low))), np.zeros(n))


def test_a_particle_filter_follows_it_in_one_dimension() -> None:
    sensor = NoiseObject(shape=(80,), object_size=7, object_deviation=3.0, border="bounded")
    assert isinstance(sensor, Sensor)
    assert isinstance(FieldOfView().bind(sensor), Knowledge)
    path = NoiseObjectPath(start=(20,), velocity=(0.6,))
    recording = sensor.simulate_sequence(40, [path], np.random.default_rng(7))
    prior = GaussianPrior(mean=(20, 0.5), covariance=((16, 0), (0, 0.1)))
    model = ParticleFilter(motion=Walk(), sensor=sensor, prior=prior, knowledge=(FieldOfView(),), particles=1500)
    *_, state = run(model, recording.frames, np.random.default_rng(8), start_s=-1.0)
    assert abs(state.mean[0] - recording.truth[-1, 0, 0]) < 2
    # the filter's evidence is what tells a wrong deviation
    total = {}
    for deviation in (1.5, 3.0, 6.0):
        other = model.replace(sensor=sensor.replace(object_deviation=deviation))
        total[deviation] = sum(
            state.log_evidence for state in run(other, recording.frames, np.random.default_rng(9), start_s=-1.0)
        )
    assert max(total, key=total.__getitem__) == 3.0


def test_the_filters_follow_it_in_two_dimensions() -> None:
    sensor = NoiseObject(shape=(30, 30), object_size=5, object_deviation=2.0, border="bounded")
    path = NoiseObjectPath(start=(8, 20), velocity=(0.5, -0.3), appears=10)
    recording = sensor.simulate_sequence(40, [path], np.random.default_rng(10))
    at = recording.truth[-1, 0, [0, 2]]
    prior = GaussianPrior(mean=(8, 0.5, 20, -0.3), covariance=tuple(np.diag([4.0, 0.1, 4.0, 0.1]).tolist()))
    known = ParticleFilter(motion=ConstantVelocity(), sensor=sensor, prior=prior)
    *_, state = run(known, recording.frames[10:], np.random.default_rng(11), start_s=-1.0)
    assert np.hypot(*(state.mean[[0, 2]] - at)) < 1.5
    unknown = BernoulliFilter(motion=ConstantVelocity(), sensor=sensor, birth=Anywhere(), particles=3000, newborns=3000)
    states = list(run(unknown, recording.frames, np.random.default_rng(12), start_s=-1.0))
    assert max(state.existence for state in states[:10]) < 0.5
    assert states[-1].existence > 0.95
    assert np.hypot(*(states[-1].mean[[0, 2]] - at)) < 1.5


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"shape": ()}, "shape: must be"),
        ({"shape": (4, 5, 6)}, "shape: must be"),
        ({"shape": (4, 0)}, "shape: must be"),
        ({"shape": (30, 4), "object_size": 5}, "more than once round"),
        ({"object_size": 0}, "object_size"),
        ({"object_deviation": 0.0}, "object_deviation"),
        ({"background_deviation": float("nan")}, "background_deviation"),
        ({"mode": "added"}, "mode"),
    ],
)
def test_what_is_no_sensor_is_refused(fields: dict, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        NoiseObject(**fields)


def test_bad_data_is_refused() -> None:
    line, image, rng = NoiseObject(shape=(20,)), NoiseObject(shape=(8, 9)), np.random.default_rng(0)
    with pytest.raises(DataError, match=r"frame: has shape \(21,\), the sensor expects \(20,\)"):
        line.log_likelihood(np.zeros((1, 2)), np.zeros(21))
    with pytest.raises(DataError, match="give one row a state, beginning x, vx, y, vy"):
        image.log_likelihood(np.zeros((1, 2)), np.zeros((8, 9)))
    with pytest.raises(DataError, match="give one row a state"):
        line.simulate(np.zeros(2), rng)
    with pytest.raises(DataError, match="not finite"):
        line.simulate(np.array([[np.nan, 0.0]]), rng)
    with pytest.raises(ParameterError, match="path 0 needs 2 numbers"):
        image.simulate_sequence(3, [NoiseObjectPath(start=(1,), velocity=(1,))], rng)
    with pytest.raises(DataError, match="frames: must be at least 1"):
        line.simulate_sequence(0, [], rng)
