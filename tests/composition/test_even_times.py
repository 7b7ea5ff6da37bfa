"""At even times, estimates are those of filters that counted steps: numbers of the last version that did.

Particle filters of linear motions have drawn other random numbers since: their twins count steps.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from elusive import run
from elusive.filters import ParticleFilter, RecurrentFilter
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.interacting import InteractingFilter
from elusive.filters.gaussian.kalman import KalmanFilter
from elusive.filters.priors import GaussianPrior
from elusive.motion import ConstantTurnRateVelocity, ConstantVelocity, MovingOrAnchored
from elusive.sensors import ImageSensor, RadarSensor
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.linear import LinearSensor

# existence (1 where a filter has none) and mean after each step, interval .5 s, of images 1 s
BEFORE = json.loads((Path(__file__).parent / "even_times.json").read_text(encoding="utf-8"))
T = 0.5
IMAGE, RADAR = ImageSensor(rows=10, columns=12), RadarSensor()
PLACES = BearingSensors(positions_m=((0.0, 0, 0), (70.0, 12, 0), (-60.0, 81, 0)))
STARTED_THEN = math.nan  # bearings' filters start with the first set


def recorded():
    """The measurements that were filtered: of one generator, in this order."""
    rng = np.random.default_rng(0)
    frames = [IMAGE.simulate(np.array([[3 + 0.3 * k, 0.6, 5, 0, 25.0]]), rng) for k in range(6)]
    ship = [np.array([[-20.0 + k, 2.0, 4000.0 + 3 * k, 6.0]]) for k in range(6)]
    scans = [RADAR.simulate(state, rng, T * (k + 1)) for k, state in enumerate(ship)]
    fixes = [np.array([0.5 * k, 1.0 * k]) + rng.normal(size=2) for k in range(6)]
    path = np.array([[20 + 1.5 * T * k, 1.5, 30 - T * k, -1.0] for k in range(8)])
    return frames, scans, fixes, PLACES.simulate(path, T * np.arange(8.0), rng)


FRAMES, SCANS, FIXES, SETS = recorded()
FIX_TIMES = T * np.arange(1, 7)


def prior(mean, variances):
    return GaussianPrior(mean=mean, covariance=np.diag(variances).tolist())


def of_radar(motion, *more):
    start = prior((-20.0, 0, 4000, 5, *(0.0 for _ in more)), (100.0, 9, 100, 9, *more))
    return ParticleFilter(motion=motion, sensor=RADAR, prior=start, particles=200)


POSITION = LinearSensor(observed=((1.0, 0, 0, 0), (0, 0, 1.0, 0)), covariance=((1.0, 0), (0, 1.0)))
CASES = {
    "sir ctrv": (of_radar(ConstantTurnRateVelocity(), 0.01), SCANS, None, 0.0),
    "sir anchoring": (of_radar(MovingOrAnchored(), 0.0), SCANS, None, 0.0),
    "recurrent": (RecurrentFilter(smoothing=0.8, max_velocity=2.0, velocity_step=0.5), FRAMES, None, -1.0),
    "kalman": (
        KalmanFilter(motion=ConstantVelocity(q=1.0), sensor=POSITION, prior=prior((0.0, 1, 0, 1), (4.0, 1, 4, 1))),
        FIXES, FIX_TIMES, 0.0,
    ),
    "extended": (ExtendedKalmanFilter(sensor=PLACES), SETS, None, STARTED_THEN),
    "interacting": (InteractingFilter(sensor=PLACES), SETS, None, STARTED_THEN),
    "fixed lag": (FixedLagSmoother(sensor=PLACES), SETS, None, STARTED_THEN),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_estimates_are_those_of_counted_steps(name):
    filter, measurements, times_s, start_s = CASES[name]
    states = run(filter, measurements, np.random.default_rng(1), times_s, start_s)
    found = [[getattr(state, "existence", 1.0), *state.mean] for state in states]
    np.testing.assert_allclose(found, BEFORE[name], rtol=1e-6, atol=1e-6)
