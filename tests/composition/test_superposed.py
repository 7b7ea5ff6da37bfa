"""The superposed tracker: every motion, knowledge and sensor whose readings add up, over uneven times."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import AdditiveSensor
from elusive.errors import ElusiveError, ParameterError
from elusive.model import Model
from elusive.sensors import ImageSensor
from elusive.sensors.field import FieldSensors
from elusive.tracking.birth_density import GaussianBirths
from elusive.tracking.superposed import SuperposedTracker
from tests.composition.builders import KNOWLEDGE, MIDDLE, MOTIONS, SIDE, prior_of

TIMES = [3.0, 3.2, 8.0, 8.0, 9.5]
MISSING = 2  # that measurement does not come
PLACES = tuple((float(x), float(y)) for x in range(0, SIDE + 1, 6) for y in range(0, SIDE + 1, 6))
FIELD = FieldSensors(positions_m=PLACES, power=100.0, core_m=3.0)


class OwnField:
    """A user's own sensor whose readings add up, in plain NumPy: variances for covariances."""

    def expected(self, states):
        return 100 / (((states[:, None, [0, 2]] - np.array(PLACES)) ** 2).sum(axis=2) + 9)

    def effect(self, expected, weights, existence):
        mean = existence * weights @ expected
        return mean, existence * weights @ expected**2 - mean**2

    def log_ratio(self, expected, measurement, others):
        left = measurement - sum(other[0] for other in others)
        precision = 1 / (np.ones(len(PLACES)) + sum(other[1] for other in others))
        return expected @ (precision * left) - 0.5 * expected**2 @ precision


SENSORS = {"field": FIELD, "image (white)": ImageSensor(rows=SIDE, columns=SIDE), "a user's own": OwnField()}


def births(names):
    prior = prior_of(names)
    return GaussianBirths(means=(prior.mean,), covariance=prior.covariance, birth_probability=0.3)


def tracker(motion, sensor, knowledge=()):
    return SuperposedTracker(
        motion=motion, sensor=sensor, birth=births(tuple(motion.state_names)), knowledge=knowledge, particles=120
    )


def measured(sensor, motion, rng):
    state = np.array([[MIDDLE.get(name, 0.0) for name in motion.state_names]])
    source = FIELD if isinstance(sensor, OwnField) else sensor
    return [None if k == MISSING else source.simulate(state, rng) for k in range(len(TIMES))]


@pytest.mark.parametrize("name", SENSORS)
def test_it_runs_at_uneven_times(name):
    sensor, rng, ran = SENSORS[name], np.random.default_rng(1), 0
    assert isinstance(sensor, AdditiveSensor)
    for motion_name, motion in MOTIONS.items():
        if name == "image (white)" and motion.state_names[-1] != "intensity":
            continue  # what such a sensor reads is not there
        seen = measured(sensor, motion, rng)
        for known_name, known in KNOWLEDGE.items():
            what = f"{motion_name}, {known_name}"
            model = tracker(motion, sensor, known)
            state = model.init(rng, 2.5)
            for time_s, measurement in zip(TIMES, seen, strict=True):
                state = model.step(state, time_s, measurement, rng)
                assert state.time_s == time_s
                for target in state.targets:
                    assert np.isfinite(target.mean).all(), what
                    assert np.isfinite(target.covariance).all(), what
                    assert 0 <= target.existence <= 1, what
            assert max(target.existence for target in state.targets) > 0.5, what
            with pytest.raises(ElusiveError, match="sort"):
                model.step(state, TIMES[0], None, rng)
            ran += 1
    assert ran >= 2 * len(KNOWLEDGE)


@pytest.mark.parametrize("name", SENSORS)
def test_yaml_is_read_back_or_the_part_that_cannot_be_is_named(name, tmp_path):
    for motion in MOTIONS.values():
        model = tracker(motion, SENSORS[name])
        own = [part for part in ("motion", "sensor") if not isinstance(getattr(model, part), Model)]
        if own:
            with pytest.raises(ParameterError, match=rf"\.{own[0]}: holds a Own"):
                model.to_yaml()
            continue
        path = tmp_path / "tracker.yaml"
        path.write_text(model.to_yaml())
        assert SuperposedTracker.from_yaml(path) == model
