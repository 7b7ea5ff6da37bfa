"""Five targets on 144 sensors whose readings add up, 1000 particles each: a step beside NumPy's, and beside 5 ms.

The NumPy twin is the same tracker with the sensor as one writes it from the definitions: the power by broadcasting, and
Gaussians of 144 readings with whole covariances.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_triangular

from elusive.motion import ConstantVelocity
from elusive.sensors.field import FieldSensors
from elusive.tracking.birth_density import GaussianBirths
from elusive.tracking.superposed import SuperposedTracker

PLACES = tuple((10.0 * x + 5, 10.0 * y + 5) for x in range(12) for y in range(12))
STARTS = np.array([[20.0, 1, 20, 1], [100, -1, 20, 1], [20, 1, 100, -1], [100, -1, 100, -1], [60, 0.5, 30, 0.5]])
COVARIANCE = tuple(map(tuple, np.diag([10.0, 1, 10, 1]).tolist()))
STEPS = 8


class PlainField:
    """The field's sensors in NumPy."""

    def expected(self, states):
        squared = ((states[:, None, [0, 2]] - np.array(PLACES)) ** 2).sum(axis=2)
        return 500 / (squared + 25)

    def effect(self, expected, weights, existence):
        mean = existence * weights @ expected
        return mean, existence * (expected.T * weights) @ expected - np.outer(mean, mean)

    def log_ratio(self, expected, measurement, others):
        covariance = np.eye(len(measurement)) + sum(other[1] for other in others)
        root = np.linalg.cholesky(covariance)
        left = solve_triangular(root, measurement - sum(other[0] for other in others), lower=True)
        along = solve_triangular(root, expected.T, lower=True)
        return left @ along - 0.5 * (along * along).sum(axis=0)


def tracker(sensor):
    return SuperposedTracker(
        motion=ConstantVelocity(q=0.25),
        sensor=sensor,
        birth=GaussianBirths(means=tuple(map(tuple, STARTS.tolist())), covariance=COVARIANCE, birth_probability=0.01),
    )


@pytest.fixture
def belief():
    rng, sensor = np.random.default_rng(0), FieldSensors(positions_m=PLACES)
    model, states = tracker(sensor), STARTS
    state = model.init(rng)
    for step in range(STEPS):
        state = model.step(state, float(step), sensor.simulate(states, rng), rng)
        states = model.motion.propagate(states, 1.0, rng)
    assert sum(target.existence > 0.9 for target in state.targets) == len(STARTS)
    return state, sensor.simulate(states, rng)


def test_a_step_against_numpy(benchmark, belief, best_of, report):
    state, readings = belief
    rng = np.random.default_rng(1)
    ours, plain = tracker(FieldSensors(positions_m=PLACES)), tracker(PlainField())
    mine, theirs = best_of(
        lambda: ours.step(state, float(STEPS), readings, rng), lambda: plain.step(state, float(STEPS), readings, rng)
    )
    report("superposed, 5 targets x 1000 on 144 sensors, against NumPy", theirs / mine, 5)
    report("superposed, the same: 5 ms over a step's time", 5e-3 / mine, 1)
    benchmark(ours.step, state, float(STEPS), readings, rng)
