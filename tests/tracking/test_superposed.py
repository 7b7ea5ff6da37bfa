"""Several targets whose readings add up: existence, places and labels against what is known of simple scenes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import Field
from scipy.stats import chi2

from elusive.errors import DataError
from elusive.model import Model
from elusive.motion import ConstantVelocity
from elusive.sensors.additive import DenseAdditiveSensor
from elusive.sensors.field import FieldSensors
from elusive.tracking.birth_density import AreaBirths, GaussianBirths
from elusive.tracking.superposed import SuperposedTracker

GRID = tuple((float(x), float(y)) for y in range(5, 60, 10) for x in range(5, 60, 10))
FIELD = FieldSensors(positions_m=GRID)
COVARIANCE = tuple(map(tuple, np.diag([100.0, 1.0, 100.0, 1.0]).tolist()))


def tracker(**changes):
    given = {
        "motion": ConstantVelocity(q=0.05),
        "sensor": FIELD,
        "birth": GaussianBirths(
            means=((15.0, 0, 30, 0), (45.0, 0, 30, 0)), covariance=COVARIANCE, birth_probability=0.01
        ),
        "particles": 500,
    }
    return SuperposedTracker(**given | changes)


def flights(rng, steps, *starts, q=0.05):
    """Paths ``(B, 4, K)`` of constant velocity."""
    motion, states, path = ConstantVelocity(q=q), np.array(starts), []
    for _ in range(steps):
        path.append(states)
        states = motion.propagate(states, 1.0, rng)
    return np.stack(path, axis=2)


def followed(model, truth, rng, present=lambda k: slice(None)):
    state = model.init(rng)
    for k in range(truth.shape[2]):
        state = model.step(state, float(k), model.sensor.simulate(truth[present(k)][:, :, k], rng), rng)
        yield state


def test_two_targets_are_found_followed_and_labelled():
    near = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        truth = flights(rng, 25, (12.0, 0.8, 28.0, 0.0), (48.0, -0.8, 32.0, 0.0))
        *_, before, last = followed(tracker(), truth, rng)
        tracks = last.tracks
        assert [track.status for track in tracks] == ["confirmed"] * 2
        assert {track.track for track in tracks} == {track.track for track in before.tracks}
        places, true = np.array([track.mean[[0, 2]] for track in tracks]), truth[:, [0, 2], -1]
        near += min(np.linalg.norm(places - pair, axis=1).max() for pair in (true, true[::-1])) < 3.0
    assert near >= 9  # in one scene of a hundred they meet so closely that both are lost for a while


def test_targets_that_appear_at_once_are_told_apart_at_once():
    # three where the birth density has two components: the third is not put down to the first two
    for seed in range(10):
        rng = np.random.default_rng([11, seed])
        truth = np.array([[12.0, 0.3, 20, 0.3], [48, -0.3, 22, 0], [30, 0, 45, -0.2]])
        model = tracker()
        state = model.step(model.init(rng), 0.0, FIELD.simulate(truth, rng), rng)
        assert [target.existence > 0.99 for target in state.targets] == [True] * 3
        for place in truth[:, [0, 2]]:
            off = min((target.mean[[0, 2]] - place for target in state.targets), key=np.linalg.norm)
            assert np.linalg.norm(off) < 5.0
        assert min(1 / (target.weights @ target.weights) for target in state.targets) > 50


def test_a_target_that_leaves_is_deleted_once_and_forgotten():
    rng = np.random.default_rng(1)
    truth = flights(rng, 30, (15.0, 0.3, 30.0, 0.0))
    shown = [state.tracks for state in followed(tracker(), truth, rng, lambda k: slice(0, 1 if k < 15 else 0))]
    statuses = [track.status for step in shown for track in step if track.track == shown[10][0].track]
    assert statuses.count("deleted") == 1
    assert statuses[-1] == "deleted"
    assert shown[-1] == ()


def test_noise_alone_confirms_no_track():
    rng = np.random.default_rng(2)
    nobody = np.zeros((1, 4, 200))
    statuses = [t.status for state in followed(tracker(), nobody, rng, lambda k: slice(0, 0)) for t in state.tracks]
    assert "confirmed" not in statuses


def test_existence_of_one_target_is_that_of_the_exact_recursion():
    # a sensor that hears targets alike wherever they are: existence follows from the readings alone
    class Counter(DenseAdditiveSensor):
        level: float = Field(1.0, description="What a target adds")

        @property
        def noise_variance(self):
            return np.ones(3)

        def added(self, states):
            return np.full((len(states), 3), self.level)

    model = tracker(
        sensor=Counter(), birth=AreaBirths(area=(0, 1, 0, 1), birth_probability=1e-9, most=1), death_probability=0.1,
        forget_below=1e-12,
    )  # fmt: skip
    rng = np.random.default_rng(3)
    readings = rng.normal(1.0, 1.0, (6, 3))
    state, existence = model.init(rng, -1.0), 0.0
    for k, reading in enumerate(readings):
        state = model.step(state, float(k), reading, rng)
        ratio = math.exp((reading - 0.5).sum())
        # the survivor and the newborn are in one place, and become one
        prior = 0.9 * existence + 1e-9
        odds = prior / (1 - prior) * ratio
        existence = odds / (1 + odds)
        oldest = max(state.targets, key=lambda target: target.existence)
        assert oldest.existence == pytest.approx(existence, rel=0.02)


@pytest.mark.parametrize("seed", range(4))
def test_existence_is_that_of_an_integral_over_all_places(seed):
    # readings so noisy that one tells little: the evidence by a sum over a grid of places, the newborn's velocity aside
    rng = np.random.default_rng([8, seed])
    sensor = FieldSensors(positions_m=GRID, noise_sd=9.0)
    birth = GaussianBirths(means=((30.0, 0, 30, 0),), covariance=COVARIANCE, birth_probability=0.02)
    measurement = sensor.simulate(np.array([[24.0, 0, 36, 0]]), rng)
    axis = np.linspace(-20, 80, 401)
    grid = np.zeros((len(axis) ** 2, 4))
    grid[:, [0, 2]] = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    prior = np.exp(-0.5 * ((grid[:, [0, 2]] - 30) ** 2).sum(axis=1) / 100)
    mass = prior / prior.sum() * np.exp(sensor.log_likelihood(grid, measurement))
    log_odds = math.log(0.02 / 0.98) + math.log(mass.sum())
    model = tracker(sensor=sensor, birth=birth, particles=4000, forget_below=1e-6)
    (target,) = model.step(model.init(rng), 0.0, measurement, rng).targets
    # 4000 particles that share ancestors
    assert math.log(target.existence / (1 - target.existence)) == pytest.approx(log_odds, abs=0.15)
    np.testing.assert_allclose(target.mean[[0, 2]], mass @ grid[:, [0, 2]] / mass.sum(), atol=0.8)


def nees(trials, particles, *starts):
    """Normalised squared errors of position of targets that are found, after 14 readings."""
    squares = []
    for seed in range(trials):
        rng = np.random.default_rng([4, seed])
        truth = flights(rng, 14, *starts)
        *_, last = followed(tracker(particles=particles), truth, rng)
        for place in truth[:, [0, 2], -1]:
            there = [target for target in last.targets if target.existence > 0.5]
            target = min(there, key=lambda target: np.hypot(*(target.mean[[0, 2]] - place)))
            off = target.mean[[0, 2]] - place
            squares.append(off @ np.linalg.solve(target.covariance[np.ix_([0, 2], [0, 2])], off))
    return np.array(squares)


def test_the_covariance_of_a_lone_target_holds():
    squares = nees(40, 1000, (25.0, 0.5, 30.0, 0.3))
    low, high = chi2.ppf([0.0015, 0.9985], 2 * len(squares)) / len(squares)
    assert low < squares.mean() < high


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("trials", "starts"),
    [
        (500, [(25.0, 0.5, 30.0, 0.3)]),
        (170, [(12.0, 0.3, 20.0, 0.3), (48.0, -0.3, 22.0, 0.0), (30.0, 0.0, 45.0, -0.2)]),
    ],
)
def test_the_covariance_of_targets_apart_holds_over_many_trials(trials, starts):
    squares = nees(trials, 1000, *starts)
    # a thousand particles cost .17 +- .04, as eight sets of seeds have it
    low, high = chi2.ppf([0.025, 0.975], 2 * len(squares)) / len(squares) * [1.0, 1 + 0.17 / 2]
    assert low < squares.mean() < high


def test_existence_is_calibrated():
    """Of tracks told 70 to 80 %, 70 to 80 % are targets: one target in half of the scenes, heard faintly."""
    sensor = FieldSensors(positions_m=GRID, noise_sd=9.0)
    birth = GaussianBirths(means=((30.0, 0, 30, 0),), covariance=COVARIANCE, birth_probability=0.5, most=1)
    model = tracker(sensor=sensor, birth=birth, particles=300, death_probability=0.0)
    told, there = [], []
    for seed in range(500):
        rng = np.random.default_rng([9, seed])
        present = rng.random() < 0.5
        start = np.array([30.0, 0, 30, 0]) + rng.standard_normal(4) * np.sqrt(np.diag(COVARIANCE))
        measurement = sensor.simulate(start[None] if present else np.zeros((0, 4)), rng)
        targets = model.step(model.init(rng), 0.0, measurement, rng).targets
        told.append(max((target.existence for target in targets), default=0.0))
        there.append(present)
    told, there = np.array(told), np.array(there)
    for low in (0.0, 0.2, 0.4, 0.6, 0.8):
        some = (told >= low) & (told <= low + 0.2)
        spread = math.sqrt((told[some] * (1 - told[some])).sum()) / max(some.sum(), 1)
        assert some.sum() > 15
        assert abs(there[some].mean() - told[some].mean()) < 3.3 * spread + 0.01


def test_a_missing_measurement_predicts_and_equal_times_only_update():
    rng = np.random.default_rng(5)
    truth = flights(rng, 10, (15.0, 0.5, 30.0, 0.0))
    *_, state = followed(tracker(), truth, rng)
    model = tracker()
    later = model.step(state, 12.0, None, rng)
    assert later.targets[0].existence == pytest.approx(state.targets[0].existence * 0.99**3, rel=1e-9)
    assert later.targets[0].covariance[0, 0] > state.targets[0].covariance[0, 0]
    again = model.step(state, state.time_s, FIELD.simulate(truth[:, :, -1], rng), rng)
    np.testing.assert_array_equal(again.targets[0].particles, state.targets[0].particles)
    with pytest.raises(DataError, match="comes after"):
        model.step(state, 3.0, None, rng)


@pytest.mark.parametrize("gap_s", [3600.0, 1e8])
def test_a_target_is_found_after_hours_without_a_measurement(gap_s):
    rng, model = np.random.default_rng(3), tracker()
    truth = flights(rng, 12, (15.0, 0.5, 30.0, 0.0))
    *_, state = followed(model, truth, rng)
    for k in range(12):  # somebody has come since for sure, and may be anywhere
        state = model.step(state, gap_s + k, FIELD.simulate(truth[:, :, k], rng), rng)
    places = [track.mean[[0, 2]] for track in state.tracks if track.status == "confirmed"]
    assert min(np.hypot(*(place - truth[0, [0, 2], -1])) for place in places) < 3.0


def test_a_target_that_was_followed_wrongly_is_put_right():
    rng, model = np.random.default_rng(10), tracker()
    truth = flights(rng, 12, (25.0, 0.5, 30.0, 0.3))
    *_, state = followed(model, truth[:, :, :8], rng)
    (target,) = state.targets
    wrong = target.particles + np.array([14.0, 0, 6, 0])
    state = state._replace(targets=(target._replace(particles=np.asfortranarray(wrong)),))
    for k in range(8, 12):
        state = model.step(state, float(k), model.sensor.simulate(truth[:, :, k], rng), rng)
    (found,) = [target for target in state.targets if target.existence > 0.5]
    assert np.linalg.norm((found.mean - truth[0, :, -1])[[0, 2]]) < 2.0


class West(Model):
    """Targets are west of a line."""

    def log_probability(self, states):
        return np.where(states[:, 0] < 15.0, 0.0, -np.inf)


def test_knowledge_counts_in_places_and_in_existence():
    rng = np.random.default_rng(6)
    truth = flights(rng, 12, (14.5, 0.0, 30.0, 0.0), q=0.0)
    *_, state = followed(tracker(), truth, rng)
    free, known = (
        max(model.step(state, 12.0, None, np.random.default_rng(7)).targets, key=lambda target: target.existence)
        for model in (tracker(), tracker(knowledge=(West(),)))
    )
    west = free.particles[:, 0] < 15.0
    assert 0.2 < west.mean() < 0.95
    np.testing.assert_allclose(known.weights, west / west.sum(), atol=1e-12)
    odds = free.existence / (1 - free.existence) * west.mean()
    assert known.existence == pytest.approx(odds / (1 + odds))


def test_the_same_seed_gives_the_same():
    def run():
        rng = np.random.default_rng(7)
        return [
            state.targets[0].mean
            for state in followed(tracker(), flights(rng, 6, (15.0, 0, 30, 0)), rng)
            if state.targets
        ]

    for one, other in zip(run(), run(), strict=True):
        np.testing.assert_array_equal(one, other)
