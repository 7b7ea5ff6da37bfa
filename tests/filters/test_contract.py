"""Every public filter has init(rng, time_s) and step(state, time_s, measurement, rng), and a state with a time."""

from __future__ import annotations

import copy
import importlib
import inspect
import pkgutil

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import elusive.filters
from elusive import run
from elusive.filters.accumulate._accumulated import Accumulated
from elusive.filters.gaussian.kalman import KalmanFilter
from elusive.filters.particle.bernoulli import BernoulliFilter
from elusive.filters.particle.sir import ParticleFilter
from elusive.filters.priors import GaussianPrior
from elusive.model import Model
from elusive.motion import ConstantVelocity
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.clutter import ClutterSensor
from elusive.sensors.linear import LinearSensor

BEARINGS = BearingSensors(positions_m=((0.0, 0.0, 0.0), (70.0, 12.0, 0.0), (-60.0, 81.0, 0.0)))
# a filter whose fields have no defaults is built here
PRIOR = GaussianPrior(mean=(0.0,) * 4, covariance=tuple(map(tuple, np.eye(4).tolist())))
BUILT = {
    "KalmanFilter": lambda kind: kind(
        motion=ConstantVelocity(),
        sensor=LinearSensor(observed=((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)), covariance=((1.0, 0.0), (0.0, 1.0))),
        prior=PRIOR,
    ),
    "RecordedFilter": lambda kind: kind(
        detector=BernoulliFilter(sensor=ClutterSensor(rows=64, columns=64), particles=300, newborns=100)
    ),
    "ParticleFilter": lambda kind: kind(
        motion=ConstantVelocity(),
        sensor=Fix(),
        prior=PRIOR,
    ),
    "ExtendedKalmanFilter": lambda kind: kind(sensor=BEARINGS),
    "FixedLagSmoother": lambda kind: kind(sensor=BEARINGS),
    "InteractingFilter": lambda kind: kind(sensor=BEARINGS),
    "FactorGraphFilter": lambda kind: kind(sensor=BEARINGS),
}

DRAW_NOTHING = {"KalmanFilter", "RecurrentFilter", "ExtendedKalmanFilter", "FixedLagSmoother", "FactorGraphFilter"}
DRAW_NOTHING |= {"InteractingFilter"}
NO_COVARIANCE = {"RecurrentFilter"}


class Fix:
    """A user's sensor: the position with unit noise."""

    def log_likelihood(self, states, measurement):
        return -0.5 * ((states[:, [0, 2]] - measurement) ** 2).sum(axis=1)


def public_filters():
    """Every model with a ``step`` in a public module of elusive.filters."""
    walked = pkgutil.walk_packages(elusive.filters.__path__, "elusive.filters.")
    names = [module.name for module in walked if "._" not in module.name]
    things = [pair for name in names for pair in vars(importlib.import_module(name)).items()]
    found = {
        name: thing
        for name, thing in things
        if inspect.isclass(thing) and issubclass(thing, Model) and hasattr(thing, "step")
        if thing.__module__.startswith("elusive.filters.")
    }
    return sorted(found.items())


def test_there_are_filters():
    assert {"BernoulliFilter", "ExistenceParticleFilter", "ParticleFilter"} <= dict(public_filters()).keys()


@pytest.mark.parametrize(("name", "kind"), public_filters())
def test_the_signatures_are_the_contract(name, kind):
    assert list(inspect.signature(kind.init).parameters) == ["self", "rng", "time_s"]
    assert list(inspect.signature(kind.step).parameters) == ["self", "state", "time_s", "measurement", "rng"]
    returned = [inspect.signature(method, eval_str=True).return_annotation for method in (kind.init, kind.step)]
    state = inspect.signature(kind.step, eval_str=True).parameters["state"].annotation
    assert returned == [state, state]
    assert issubclass(state, tuple)
    assert state._fields[0] == "time_s"
    assert set(state._fields) >= ({"mean"} if name in NO_COVARIANCE else {"mean", "covariance"})


def measurements(model):
    rng = np.random.default_rng(0)
    if isinstance(model, ParticleFilter | KalmanFilter):
        return [np.array([0.1, 0.2]), None, np.array([0.3, 0.1])]
    if isinstance(getattr(model, "sensor", None), BearingSensors):
        one, two = BEARINGS.simulate(np.array([[9.0, 1, 9, 0], [11, 1, 9, 0]]), np.array([0.0, 2.0]), rng)
        return [one, None, two]
    if hasattr(model, "sensor"):
        frame = model.sensor.simulate(np.array([[9.0, 0, 9.0, 0, 30.0]]), rng)
        return [frame, None, frame]
    # a recording: the same scene again and again, in noise
    scene = gaussian_filter(rng.normal(size=(64, 64)), 2) * 100
    return [scene + rng.normal(size=scene.shape) for _ in range(14)]


def times(model):
    """Times of the measurements, uneven."""
    return [float(k) for k in range(len(measurements(model)))]


def leaves(state):
    """Every array and number of a state, those of states within it too."""
    if isinstance(state, tuple | list):
        return [leaf for part in state for leaf in leaves(part)]
    # what is handed on in place belongs to the latest state alone
    return [] if isinstance(state, Accumulated) else [state]


@pytest.mark.parametrize(("name", "kind"), public_filters())
def test_the_same_seed_gives_the_same_numbers_and_another_does_not(name, kind):
    model = BUILT[name](kind) if name in BUILT else kind()
    first, again, other = (
        list(run(model, measurements(model), np.random.default_rng(seed), times(model))) for seed in (5, 5, 6)
    )
    for one, two in zip(first, again, strict=True):
        for a, b in zip(leaves(one), leaves(two), strict=True):
            np.testing.assert_array_equal(a, b)
    assert np.array_equal(first[-1].mean, other[-1].mean) == (name in DRAW_NOTHING)


@pytest.mark.parametrize(("name", "kind"), public_filters())
def test_a_step_changes_nothing_it_was_given(name, kind):
    model = BUILT[name](kind) if name in BUILT else kind()
    state = model.init(np.random.default_rng(1))
    for time_s, measurement in zip(times(model), measurements(model), strict=True):
        kept = copy.deepcopy(leaves(state))
        later = model.step(state, time_s, measurement, np.random.default_rng(2))
        for part, before in zip(leaves(state), kept, strict=True):
            np.testing.assert_array_equal(part, before)
        state = later
