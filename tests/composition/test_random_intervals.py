"""A target of constant velocity, seen after .2 to 8 s: every filter that takes the sensor says how far off it is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from elusive import run
from elusive.contracts import Births
from elusive.filters import BernoulliFilter, ExistenceParticleFilter, ParticleFilter
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.kalman import KalmanFilter
from elusive.filters.priors import GaussianPrior
from elusive.motion import ConstantVelocity
from elusive.sensors import RadarSensor
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.linear import LinearSensor
from tests.longer import longer

MOTION = ConstantVelocity(q=0.05)
PRIOR = GaussianPrior(mean=(500.0, 2.0, 800.0, -3.0), covariance=np.diag([100.0, 1.0, 100.0, 1.0]).tolist())
STEPS, TRIALS = 8, 40


class FromPrior:
    """Births as the prior has them."""

    def draw(self, n, measurement, sensor, state_names, rng):
        return Births(PRIOR.sample(n, rng), np.zeros(n))


class Against:
    """A sensor as a detector's: its likelihood over that of measurements far off."""

    def __init__(self, sensor):
        self.sensor = sensor

    def log_likelihood(self, states, measurement):
        return self.sensor.log_likelihood(states, measurement) + 50.0


SENSORS = {
    "linear": LinearSensor(observed=((1.0, 0, 0, 0), (0, 0, 1.0, 0)), covariance=((25.0, 0.0), (0.0, 25.0))),
    "radar": RadarSensor(bearing_sd_mrad=5.0),
    "bearings": BearingSensors(positions_m=((0.0, 0.0, 0.0), (1000.0, 0.0, 0.0)), sigma_deg=0.5),
}
CERTAIN = {"birth_probability": 0.0, "death_probability": 0.0, "initial_existence": 1.0, "birth": FromPrior()}
FILTERS = {
    "particle": lambda sensor: ParticleFilter(motion=MOTION, sensor=sensor, prior=PRIOR, particles=2000),
    "bernoulli": lambda sensor: BernoulliFilter(
        motion=MOTION, sensor=Against(sensor), particles=2000, newborns=1, **CERTAIN
    ),
    "existence": lambda sensor: ExistenceParticleFilter(
        motion=MOTION, sensor=Against(sensor), particles=2000, **CERTAIN
    ),
    "kalman": lambda sensor: KalmanFilter(motion=MOTION, sensor=sensor, prior=PRIOR),
    "extended": lambda sensor: ExtendedKalmanFilter(motion=MOTION, sensor=sensor, prior=PRIOR, loss="squares"),
}
GAUSSIAN = {"kalman", "extended"}
CASES = [
    (name, sensor)
    for name in FILTERS
    for sensor in SENSORS
    if name not in GAUSSIAN or hasattr(SENSORS[sensor], "residual")
]


def measure(sensor, state, time_s, rng):
    if isinstance(sensor, BearingSensors):
        return sensor.simulate(state, np.array([time_s]), rng)[0]
    if isinstance(sensor, RadarSensor):
        return sensor.simulate(state, rng, time_s)
    return sensor.simulate(state, rng)[0]


@pytest.mark.parametrize(
    ("name", "which"),
    longer(CASES, *((name, "bearings") for name in ("existence", "bernoulli", "particle")), ("existence", "radar")),
)
def test_errors_are_as_large_as_said(name, which):
    """NEES of the last state, summed over trials, within the chi-square band that one run in 10 000 leaves."""
    sensor, nees = SENSORS[which], []
    filter = FILTERS[name](sensor)
    for trial in range(TRIALS):
        rng = np.random.default_rng([7, trial])
        intervals = rng.uniform(0.2, 8.0, STEPS)
        times, state, seen = np.cumsum(intervals), PRIOR.sample(1, rng), []
        for time_s, interval_s in zip(times, intervals, strict=True):
            state = MOTION.propagate(state, float(interval_s), rng)
            seen.append(measure(sensor, state, float(time_s), rng))
        *_, last = run(filter, seen, rng, times, start_s=0.0)
        assert getattr(last, "existence", 1.0) == 1.0
        off = last.mean - state[0]
        nees.append(off @ np.linalg.solve(last.covariance, off))
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 4 * TRIALS)
    assert low < sum(nees) < high
