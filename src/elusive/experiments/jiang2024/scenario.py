"""The three flights of Jiang et al. (2024), section 4, past three sensors, and what no estimator of them can beat.

The paper gives neither start points, nor the speed of the turn, nor the samples a step, nor how long CA and CTRV fly.
The values here make its EKF rows plausible: CV and CTRV start at the origin, on the first sensor, and last 25 steps; CA
starts at (10, 10) and lasts 70; N = 100.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import VX, VY, Array, X, Y
from elusive.model import Model, Positive
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearing_table import tabulated
from elusive.sensors.bearings import BearingSensors

MotionName = Literal["cv", "ca", "ctrv"]
MOTIONS: tuple[MotionName, ...] = ("cv", "ca", "ctrv")
SIGMAS_DEG = (1.0, 5.0, 15.0, 20.0, 25.0)
PLACES_M = ((0.0, 0.0, 0.0), (70.0, 12.0, 0.0), (-60.0, 81.0, 0.0))
STEPS: dict[MotionName, int] = {"cv": 25, "ca": 70, "ctrv": 25}
STARTS_M: dict[MotionName, tuple[float, float]] = {"cv": (0.0, 0.0), "ca": (10.0, 10.0), "ctrv": (0.0, 0.0)}
SPEED_MPS = 10.0  # each axis of CV
FIRST_SPEED_MPS, ACCELERATION_MPS2 = 0.1, 0.1  # each axis of CA
TURNING_MPS, TURN_RATE, FIRST_HEADING = 10.0 * 2**0.5, np.pi / 180, np.pi / 10  # rad a step, rad
STEP_NOISE_M = 0.5


class Flight(NamedTuple):
    """A path and its bearings."""

    states: Array  # (T, 4) x, vx, y, vy at t = 1 .. T
    azimuth_rad: Array  # (T, 3) circular means, clockwise from north
    sets: list[BearingSet]  # the same, one bearing a sensor and step, for :meth:`FlightCase.mean_sensors`


class FlightCase(Model):
    """One flight and its noise."""

    motion: MotionName = Field("cv", description="Of section 4.1 (cv), 4.2 (ca) or 4.3 (ctrv)")
    sigma_deg: Positive = Field(1.0, le=180, description="Deviation of a direction of arrival, sigma_phi [deg]")
    samples: int = Field(100, ge=1, description="Samples a sensor and step, N; not given in the paper")

    @property
    def sensors(self) -> BearingSensors:
        """The sensors, each bearing a single sample."""
        return BearingSensors(positions_m=PLACES_M, sigma_deg=self.sigma_deg, samples=self.samples)

    @property
    def mean_sensors(self) -> BearingSensors:
        """The sensors, each bearing the mean of the samples of a step."""
        return BearingSensors(positions_m=PLACES_M, sigma_deg=self.sigma_deg / self.samples**0.5)

    @property
    def times_s(self) -> Array:
        """Times of the steps, ``(T,)`` [s]."""
        return np.arange(1.0, STEPS[self.motion] + 1)

    def path(self, rng: Generator) -> Array:
        """Draw a path, ``(T, 4)``: the noise of eqs. 26, 27 and 29 accumulates."""
        velocity = velocities(self.motion)
        steps = velocity + STEP_NOISE_M * rng.standard_normal(velocity.shape)
        states = np.empty((len(velocity), 4))
        states[:, [X, Y]] = np.array(STARTS_M[self.motion]) + steps.cumsum(axis=0)
        states[:, [VX, VY]] = velocity
        return states

    def simulate(self, rng: Generator) -> Flight:
        """Draw a path and its bearings."""
        states = self.path(rng)
        table = tabulated(self.sensors.simulate(states, self.times_s, rng), self.sensors)
        azimuth = table.azimuth_rad.reshape(len(states), len(PLACES_M))
        each, level = np.arange(len(PLACES_M)), np.full(len(PLACES_M), np.nan)
        sets = [BearingSet(float(t), each, row, level) for t, row in zip(self.times_s, azimuth, strict=True)]
        return Flight(states, azimuth, sets)


def velocities(motion: MotionName) -> Array:
    """Velocity of each step, ``(T, 2)`` [m/s]: eqs. 26, 28 and 30."""
    return _velocities(motion, _parameters(motion))


class PathInformation(NamedTuple):
    """Fisher information of all places of a flight, in turn, and of what its velocities depend on."""

    motion: Array  # (2T + p, 2T + p)
    bearings: Array  # the same, of single samples with a deviation of one degree


def path_information(motion: MotionName, rng: Generator, paths: int = 200) -> PathInformation:
    """Information on a flight, averaged over paths: Tichavsky, Muravchik and Nehorai (1998).

    The velocities depend on speeds; on first speeds and accelerations; on speed, heading and turn rate. Nothing is
    known of those before, nor of the first place.
    """
    case = FlightCase(motion=motion, sigma_deg=1.0, samples=1)
    states = np.stack([case.path(rng) for _ in range(paths)])
    T = states.shape[1]
    each = case.sensors.information(states.reshape(-1, 4)).reshape(paths, T, 4, 4).mean(axis=0)
    theta = _parameters(motion)
    slopes = []
    for k, value in enumerate(theta):
        shift = np.zeros(len(theta))
        shift[k] = 1e-6 * max(abs(value), 1.0)
        slopes.append((_velocities(motion, theta + shift) - _velocities(motion, theta - shift)) / 2 / shift[k])
    step = np.zeros((2 * (T - 1), 2 * T + len(theta)))  # derivative of s_t - s_(t-1) - v_t, t = 2 .. T
    rows = np.arange(2 * (T - 1))
    step[rows, rows], step[rows, rows + 2] = -1.0, 1.0
    step[:, 2 * T :] = -np.stack(slopes, axis=-1)[1:].reshape(2 * (T - 1), -1)
    bearings = np.zeros((step.shape[1],) * 2)
    for k in range(T):
        bearings[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = each[k][np.ix_([X, Y], [X, Y])]
    return PathInformation(step.T @ step / STEP_NOISE_M**2, bearings)


def bound_rmse(information: PathInformation, case: FlightCase) -> float:
    """Posterior Cramer-Rao bound of a smoother's root mean square error over a flight [m]."""
    T = STEPS[case.motion]
    whole = information.motion + information.bearings * case.samples / case.sigma_deg**2
    return float(np.sqrt(np.trace(np.linalg.inv(whole)[: 2 * T, : 2 * T]) / T))


def _parameters(motion: MotionName) -> Array:
    if motion == "cv":
        return np.full(2, SPEED_MPS)
    if motion == "ca":
        return np.array([FIRST_SPEED_MPS, FIRST_SPEED_MPS, ACCELERATION_MPS2, ACCELERATION_MPS2])
    return np.array([TURNING_MPS, FIRST_HEADING, TURN_RATE])


def _velocities(motion: MotionName, theta: Array) -> Array:
    steps = np.arange(1, STEPS[motion] + 1)[:, None]
    if motion == "cv":
        return np.tile(theta, (len(steps), 1))
    if motion == "ca":
        return np.asarray(theta[:2] + steps * theta[2:])
    heading = theta[1] + steps * theta[2]
    return np.asarray(theta[0] * np.hstack([np.cos(heading), np.sin(heading)]))
