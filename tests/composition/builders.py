"""Builders of the grid: add a motion, sensor, piece of knowledge or filter here, and it is tried with all others.

Every state is of one plane of 24 by 24 units with the target near its middle, so that any sensor sees any motion's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import shapely

from elusive.charts import CourseBounds, ExactWater, FieldWater, IntervalWater, Lane, SpeedBounds
from elusive.contracts import Births
from elusive.filters import BernoulliFilter, ExistenceParticleFilter, ParticleFilter
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.kalman import KalmanFilter
from elusive.filters.priors import GaussianPrior
from elusive.motion import (
    ConstantAcceleration,
    ConstantTurnRateVelocity,
    ConstantVelocity,
    CoordinatedTurn,
    ManoeuvringVelocity,
    MovingOrAnchored,
    WithCoastError,
    WithIntensity,
)
from elusive.motion.altitude import WithAltitude
from elusive.motion.walk import Walk
from elusive.sensors import ClutterSensor, ImageSensor, NoiseObject, RadarSensor, fit_tail
from elusive.sensors.arrival_times import ArrivalTimeSensors
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.hybrid import HybridSensors
from elusive.sensors.linear import LinearSensor
from tests.charts.shapes import land

SIDE = 24
MIDDLE = {"x": 12.0, "y": 11.0, "vx": 0.2, "vy": -0.1, "intensity": 40.0}
SPREAD = {"x": 2.0, "y": 2.0, "vx": 0.3, "vy": 0.3, "turn_rate": 0.05, "intensity": 4.0, "z": 1.0, "vz": 0.1}


class OwnMotion:
    """A user's own motion, in plain NumPy: it drifts, whatever the rest of its state says."""

    state_names = ("x", "vx", "y", "vy", "mood")

    def propagate(self, states, interval_s, rng):
        moved = states.copy()
        moved[:, [0, 2]] += interval_s * states[:, [1, 3]] + 0.1 * interval_s**0.5 * rng.standard_normal(
            (len(states), 2)
        )
        return moved


class OwnSensor:
    """A user's own sensor, in plain NumPy: the position with unit noise."""

    def log_likelihood(self, states, measurement):
        return -0.5 * ((states[:, [0, 2]] - measurement) ** 2).sum(axis=1)

    def residual(self, state, measurement):
        return measurement - state[[0, 2]]

    def jacobian(self, state, measurement):
        return np.eye(len(state))[[0, 2]]

    def noise(self, measurement):
        return np.eye(2)


class OwnKnowledge:
    """A user's own knowledge: the west is likelier."""

    def log_probability(self, states):
        return -0.05 * np.abs(states[:, 0])


class OwnBirth:
    """A user's own birth: anywhere about the middle, in any components."""

    def draw(self, n, measurement, sensor, state_names, rng):
        return Births(prior_of(state_names).sample(n, rng), np.zeros(n))


MOTIONS: dict[str, Any] = {
    "cv": ConstantVelocity(q=0.01),
    "ct": CoordinatedTurn(q=0.01),
    "ca": ConstantAcceleration(q=0.001),
    "ctrv": ConstantTurnRateVelocity(),
    "altitude": WithAltitude(motion=ConstantVelocity(q=0.01)),
    "anchoring": MovingOrAnchored(),
    "manoeuvring": ManoeuvringVelocity(q=0.01),
    "coast_error": WithCoastError(motion=ConstantVelocity(q=0.01)),
    "cv with intensity": WithIntensity(motion=ConstantVelocity(q=0.01)),
    "ctrv with intensity": WithIntensity(motion=ConstantTurnRateVelocity()),
    "walk": Walk(),
    "a user's own": OwnMotion(),
}


class SensorCase(NamedTuple):
    """A sensor of states with these components, and what it reports of one of them at a time."""

    build: Callable[[tuple[str, ...]], Any]
    measure: Callable[[Any, np.ndarray, float, np.random.Generator], Any]
    detects: bool = False  # whether its likelihood is a ratio against no target


PLACES = ((0.0, 0.0, 0.0), (SIDE, 0.0, 0.0), (0.0, SIDE, 0.0))


def of_path(sensor, state, time_s, rng):
    return sensor.simulate(state[None], np.array([time_s]), rng)[0]


def response(sensor, state, time_s, rng):
    """Evidence of a white frame with a peak at the target."""
    frame = rng.standard_normal(sensor.shape)
    frame[round(state[2]), round(state[0])] += 8.0
    return sensor.evidence(frame, fit_tail(frame))


def position(names):
    return np.eye(len(names))[[0, 2]].tolist()


BEARINGS = BearingSensors(positions_m=PLACES)
ARRIVALS = ArrivalTimeSensors(positions_m=PLACES)
SENSORS: dict[str, SensorCase] = {
    "image (white)": SensorCase(
        lambda names: ImageSensor(rows=SIDE, columns=SIDE), lambda s, x, t, rng: s.simulate(x[None], rng), True
    ),
    "image (clutter)": SensorCase(lambda names: ClutterSensor(rows=40, columns=40), response, True),
    "noise object": SensorCase(
        lambda names: NoiseObject(shape=(SIDE, SIDE), object_size=5),
        lambda s, x, t, rng: s.simulate(x[None], rng),
        True,
    ),
    "radar": SensorCase(
        lambda names: RadarSensor(range_sd_m=1.0, false_alarms=1e-9, max_range_m=50.0, max_doppler_mps=25.0),
        lambda s, x, t, rng: s.simulate(x[None], rng, t),
        True,
    ),
    "bearings": SensorCase(lambda names: BEARINGS, of_path),
    "arrival times": SensorCase(lambda names: ARRIVALS, of_path),
    "both": SensorCase(lambda names: HybridSensors(bearings=BEARINGS, arrivals=ARRIVALS), of_path),
    "linear": SensorCase(
        lambda names: LinearSensor(observed=position(names), covariance=((1.0, 0.0), (0.0, 1.0))),
        lambda s, x, t, rng: s.simulate(x[None], rng)[0],
    ),
    "a user's own": SensorCase(lambda names: OwnSensor(), lambda s, x, t, rng: x[[0, 2]] + rng.standard_normal(2)),
}

COAST = land(shapely.box(-100, -100, 2, 100), sigma=1.0)
KNOWLEDGE: dict[str, tuple[Any, ...]] = {
    "none": (),
    "the sensor's view": (FieldOfView(),),
    "banks": (IntervalWater(lower_m=1.0, upper_m=23.0, sigma_m=1.0),),
    "speeds and courses": (SpeedBounds(upper_mps=20.0, sigma_mps=2.0), CourseBounds(from_deg=290.0, to_deg=250.0)),
    "a lane": (Lane(path_m=((0.0, 11.0), (24.0, 11.0)), width_m=16.0, sigma_m=1.0, one_way=False),),
    "a chart": (ExactWater().bind(COAST),),
    "view, chart and a user's own": (FieldOfView(), FieldWater().bind(COAST), OwnKnowledge()),
}


def prior_of(names):
    """Gaussian about the middle, of any components."""
    deviations = np.array([SPREAD.get(name, 0.1) for name in names])
    mean = tuple(MIDDLE.get(name, 0.0) for name in names)
    return GaussianPrior(mean=mean, covariance=np.diag(deviations**2).tolist())


class FilterCase(NamedTuple):
    """A filter of a motion, a sensor and what is known; ``knows``: whether it takes knowledge at all."""

    build: Callable[[Any, Any, tuple[Any, ...], GaussianPrior], Any]
    knows: bool = True


FILTERS: dict[str, FilterCase] = {
    "ParticleFilter": FilterCase(
        lambda motion, sensor, known, prior: ParticleFilter(
            motion=motion, sensor=sensor, prior=prior, knowledge=known, particles=60
        )
    ),
    "BernoulliFilter": FilterCase(
        lambda motion, sensor, known, prior: BernoulliFilter(
            motion=motion, sensor=sensor, birth=OwnBirth(), knowledge=known, particles=60, newborns=20
        )
    ),
    "ExistenceParticleFilter": FilterCase(
        lambda motion, sensor, known, prior: ExistenceParticleFilter(
            motion=motion, sensor=sensor, birth=OwnBirth(), knowledge=known, particles=80, initial_existence=0.5
        )
    ),
    "KalmanFilter": FilterCase(
        lambda motion, sensor, known, prior: KalmanFilter(motion=motion, sensor=sensor, prior=prior), knows=False
    ),
    "ExtendedKalmanFilter": FilterCase(
        lambda motion, sensor, known, prior: ExtendedKalmanFilter(motion=motion, sensor=sensor, prior=prior),
        knows=False,
    ),
}
