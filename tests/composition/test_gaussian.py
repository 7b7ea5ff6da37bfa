"""Every motion with every linearisable sensor in every Gaussian filter, at times .2 to 8 s apart.

A path is drawn from the motion itself, so that a filter whose claims hold has a normalised error squared (NEES) of mean
d; of R independent runs, R times their mean is chi-square of R d degrees of freedom (Bar-Shalom, Li and Kirubarajan,
2001, section 5.4.2).
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from elusive import run
from elusive.errors import DataError, ElusiveError
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.interacting import InteractingFilter
from elusive.filters.gaussian.kalman import KalmanFilter, smoothed
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.filters.gaussian.moments import moved
from elusive.filters.particle.sir import ParticleFilter
from elusive.filters.priors import GaussianPrior
from elusive.motion import (
    ConstantAcceleration,
    ConstantTurnRateVelocity,
    ConstantVelocity,
    CoordinatedTurn,
    WithIntensity,
)
from elusive.motion.altitude import WithAltitude
from elusive.sensors.arrival_times import ArrivalTimeSensors
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.hybrid import HybridSensors
from elusive.sensors.linear import LinearSensor
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarPlot


class OwnLinear:
    """A user's motion with F and Q: constant velocity."""

    state_names = ("x", "vx", "y", "vy")

    def F(self, interval_s):
        return np.kron(np.eye(2), [[1.0, interval_s], [0.0, 1.0]])

    def Q(self, interval_s):
        T = interval_s
        return 0.2 * np.kron(np.eye(2), [[T**3 / 3, T**2 / 2], [T**2 / 2, T]])

    def propagate(self, states, interval_s, rng):
        noise = rng.standard_normal((len(states), 4)) @ np.linalg.cholesky(self.Q(interval_s)).T if interval_s else 0.0
        return states @ self.F(interval_s).T + noise


class OwnDrawn:
    """A user's motion that can only be drawn from: the same."""

    state_names = OwnLinear.state_names

    def propagate(self, states, interval_s, rng):
        return OwnLinear().propagate(states, interval_s, rng)


class OwnPlace:
    """A user's sensor without a jacobian: the place, with a noise of its own."""

    def residual(self, state, measurement):
        return measurement - state[[0, 2]]

    def noise(self, measurement):
        return np.array([[4.0, 1.0], [1.0, 2.0]])

    def log_likelihood(self, states, measurement):
        off = measurement - states[:, [0, 2]]
        return -0.5 * np.einsum("ki,ij,kj->k", off, np.linalg.inv(self.noise(None)), off)

    def simulate(self, states, times_s, rng):
        return list(states[:, [0, 2]] + rng.multivariate_normal(np.zeros(2), self.noise(None), len(states)))


class Plain:
    """A sensor as a user's own: the compiled filters do not know it."""

    def __init__(self, sensor):
        for name in ("residual", "jacobian", "noise", "parts", "bend"):
            if hasattr(sensor, name):
                setattr(self, name, getattr(sensor, name))


PLACES = ((0.0, 0.0, 1.0), (170.0, 22.0, 30.0), (-160.0, 181.0, 3.0), (60.0, -150.0, 15.0))
SPEED = 300.0  # of a sound: the clocks are no better than the range
FLAT, SOLID = (BearingSensors(positions_m=PLACES, sigma_deg=0.5, dimensions=n) for n in (2, 3))
TOA = ArrivalTimeSensors(positions_m=PLACES, sigma_s=0.005, speed_mps=SPEED)
MOTIONS = {
    "cv": ConstantVelocity(q=0.2),
    "ca": ConstantAcceleration(q=0.002),
    "ct": CoordinatedTurn(q=0.2, turn_rate_deg=3.0),
    "ctrv": ConstantTurnRateVelocity(q_speed=0.02, q_turn=1e-6),
    "intensity": WithIntensity(motion=ConstantVelocity(q=0.2), q_intensity=0.1),
    "turning intensity": WithIntensity(motion=ConstantTurnRateVelocity(q_speed=0.02, q_turn=1e-6), q_intensity=0.1),
    "own linear": OwnLinear(),
    "own drawn": OwnDrawn(),
    "altitude": WithAltitude(motion=ConstantVelocity(q=0.2), q_vertical=0.1),
}
SENSORS = {
    "bearings": FLAT,
    "arrivals": TOA,
    "differences": TOA.replace(emission_known=False),
    "hybrid": HybridSensors(bearings=FLAT.replace(positions_m=PLACES[:2]), arrivals=TOA),
    "radar": RadarSensor(x_m=-100.0, y_m=-300.0, range_sd_m=3.0, bearing_sd_mrad=8.0, doppler_sd_mps=1.0),
    "own": OwnPlace(),
}
RISEN = {
    "bearings": SOLID,
    "arrivals": TOA.replace(dimensions=3),
    "hybrid": HybridSensors(bearings=SOLID, arrivals=TOA.replace(dimensions=3)),
}
GRID = [(motion, sensor) for motion in MOTIONS for sensor in (RISEN if motion == "altitude" else SENSORS)]
FILTERS = {
    "kalman": KalmanFilter,
    "extended": ExtendedKalmanFilter,
    "interacting": InteractingFilter,
    "lag": FixedLagSmoother,
    "map": MapSmoother,
}
START = {"x": 40.0, "vx": 3.0, "y": 60.0, "vy": -2.0, "z": 45.0, "vz": 0.5, "intensity": 20.0, "turn_rate": 0.02}
WIDTH = {"x": 10.0, "y": 10.0, "z": 10.0, "intensity": 3.0, "turn_rate": 0.01, "ax": 0.05, "ay": 0.05}
STEPS = 4


def prior_of(motion):
    mean = np.array([START.get(name, 0.0) for name in motion.state_names])
    deviations = np.array([WIDTH.get(name, 1.0) for name in motion.state_names])
    return GaussianPrior(mean=mean.tolist(), covariance=np.diag(deviations**2).tolist())


def recorded(motion, sensor, rng, steps=STEPS):
    """A path from the prior, and what the sensor reports of it."""
    times = np.round(np.cumsum(rng.uniform(0.2, 8.0, steps)), 3)
    states = [prior_of(motion).sample(1, rng)]
    for interval_s in np.diff(times):
        states.append(motion.propagate(states[-1], float(interval_s), rng))
    path = np.concatenate(states)
    if isinstance(sensor, RadarSensor):
        noise = rng.normal(size=(3, steps)) * [[sensor.range_sd_m], [sensor.bearing_sd_rad], [sensor.doppler_sd_mps]]
        r, b, d = np.array(sensor.measured(path)) + noise
        return times, path, [RadarPlot(*z) for z in zip(times, r, b % (2 * np.pi), d, strict=True)]
    return times, path, sensor.simulate(path, times, rng)


def made(name, motion, sensor, **changes):
    shared = {"sensor": sensor, "prior": prior_of(motion)}
    if name == "kalman":
        return KalmanFilter(motion=motion, **shared)
    if name == "interacting":
        return InteractingFilter(motions=(motion,) * 3, loss="squares", **shared, **changes)
    if name == "lag":
        # several measurements: what leaves the window is linearised once and for all
        changes = {"lag_s": 12.0, **changes}
    if name in ("lag", "map") and "turn_rate" in motion.state_names:
        # the noise of a turn leaves the place certain: a descent needs room beside the arc
        changes = {"position_noise_m": 0.3, "iterations": 50, **changes}
    return FILTERS[name](motion=motion, loss="squares", **shared, **changes)


def followed(name, filter, times, measurements):
    """Mean and covariance at the last time."""
    if name == "map":
        found = filter.smooth(measurements, times)
        return found.states[-1], found.covariances[-1]
    *_, last = run(filter, measurements, np.random.default_rng(0), times)
    assert last.time_s == times[-1]
    return last.mean, last.covariance


def check_nees(motion, sensor, runs):
    """Errors of independent runs; bounds that one in 10 000 combinations leaves by chance, and some for the bend."""
    motion, seen = MOTIONS[motion], (RISEN if motion == "altitude" else SENSORS)[sensor]
    d = len(motion.state_names)
    total = dict.fromkeys(FILTERS, 0.0)
    rng = np.random.default_rng(sum(map(ord, sensor)) + d)
    for _ in range(runs):
        times, path, measurements = recorded(motion, seen, rng)
        measurements[STEPS // 2] = None
        for name in FILTERS:
            mean, covariance = followed(name, made(name, motion, seen), times, measurements)
            error = mean - path[-1]
            total[name] += error @ np.linalg.solve(covariance, error)
    low, high = chi2.ppf([5e-5, 1 - 5e-5], runs * d)
    for name, nees in total.items():
        if name == "lag" and "turn_rate" in motion.state_names:
            # its descents may end beside the arc, as its description says
            continue
        assert low * 0.9 < nees < high * 1.15, name


@pytest.mark.parametrize(("motion", "sensor"), GRID)
def test_every_filter_is_as_sure_as_it_may_be(motion, sensor):
    check_nees(motion, sensor, 1)


@pytest.mark.thorough
@pytest.mark.parametrize(("motion", "sensor"), GRID)
def test_over_many_runs_too(motion, sensor):
    check_nees(motion, sensor, 12)


@pytest.mark.parametrize(
    ("motion", "sensor"),
    [("cv", "bearings"), ("cv", "differences"), ("ctrv", "bearings"), ("altitude", "hybrid"), ("altitude", "arrivals")],
)
@pytest.mark.parametrize("loss", ["squares", "cauchy"])
def test_compiled_and_plain_are_the_same(motion, sensor, loss):
    motion = MOTIONS[motion]
    seen = RISEN[sensor] if "z" in motion.state_names else SENSORS[sensor]
    times, _, measurements = recorded(motion, seen, np.random.default_rng(1))
    for name in ("extended", "interacting", "lag", "map"):
        # a displacement at each step: a descent over steps that are almost certain ends sooner or later by chance
        changes = {"loss": loss, "position_noise_m": 0.3}
        changes |= {"iterations": 2} if name in ("extended", "interacting") else {}
        compiled, plain = (made(name, motion, s).replace(**changes) for s in (seen, Plain(seen)))
        for one, other in zip(
            followed(name, compiled, times, measurements), followed(name, plain, times, measurements), strict=True
        ):
            # a descent ends within a share of the deviation; an arc's slope loses digits near a straight line
            close = 1e-3 if name in ("lag", "map") else 2e-7 if motion is MOTIONS["ctrv"] else 1e-8
            np.testing.assert_allclose(one, other, rtol=close, atol=close)


def test_evidence_of_compiled_and_plain_is_the_same():
    for motion in (MOTIONS["cv"], MOTIONS["ctrv"]):
        times, _, measurements = recorded(motion, FLAT, np.random.default_rng(2))
        for name, find in (("extended", "track"), ("interacting", "track"), ("map", "smooth")):
            compiled, plain = (made(name, motion, sensor, position_noise_m=0.3) for sensor in (FLAT, Plain(FLAT)))
            found = [getattr(filter, find)(measurements, times).log_evidence for filter in (compiled, plain)]
            assert found[0] == pytest.approx(found[1], abs=1e-3)


H = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.5))
LINEAR = LinearSensor(observed=H, covariance=((2.0, 0.3), (0.3, 1.0)))


def linear_problem():
    rng = np.random.default_rng(3)
    motion = MOTIONS["cv"]
    times = np.cumsum(rng.uniform(0.2, 8.0, 10))
    path = [prior_of(motion).sample(1, rng)]
    for interval_s in np.diff(times):
        path.append(motion.propagate(path[-1], float(interval_s), rng))
    measurements = list(LINEAR.simulate(np.concatenate(path), rng))
    measurements[4] = None
    return motion, times, measurements


def test_of_a_linear_problem_all_are_the_kalman_filter_and_its_smoother():
    motion, times, measurements = linear_problem()
    kalman = made("kalman", motion, LINEAR)
    states = list(run(kalman, measurements, np.random.default_rng(0), times))
    for name in ("extended", "interacting", "lag"):
        filter = made(name, motion, LINEAR)
        for ours, exact in zip(run(filter, measurements, np.random.default_rng(0), times), states, strict=True):
            np.testing.assert_allclose(ours.mean, exact.mean, atol=1e-6)
            np.testing.assert_allclose(ours.covariance, exact.covariance, rtol=1e-6, atol=1e-7)
            if name != "lag":
                assert ours.log_evidence == pytest.approx(exact.log_evidence, abs=1e-7)
    backwards = smoothed(kalman, states)
    whole = made("map", motion, LINEAR).smooth(measurements, times)
    rts = made("extended", motion, LINEAR).track(measurements, times, smooth=True)
    for found in (whole, rts):
        np.testing.assert_allclose(found.states, [s.mean for s in backwards], atol=1e-6)
        np.testing.assert_allclose(found.covariances, [s.covariance for s in backwards], rtol=1e-6, atol=1e-7)
        # Laplace's approximation of a Gaussian is exact
        assert found.log_evidence == pytest.approx(sum(s.log_evidence for s in states), abs=1e-5)


def test_a_motion_that_is_drawn_from_is_nearly_the_motion_itself():
    mean, covariance = np.array(prior_of(OwnLinear()).mean), np.array(prior_of(OwnLinear()).covariance)
    exact, drawn = moved(OwnLinear(), mean, covariance, 3.0), moved(OwnDrawn(), mean, covariance, 3.0)
    np.testing.assert_allclose(drawn.F, exact.F, atol=1e-9)
    deviation = np.sqrt(np.diag(exact.Q))
    # 2000 draws, four standard errors
    assert (np.abs(drawn.mean - exact.mean) < 4 / np.sqrt(2000) * deviation).all()
    np.testing.assert_allclose((drawn.Q - exact.Q) / np.outer(deviation, deviation), 0, atol=4 * np.sqrt(2 / 2000))


def test_several_motions_over_the_components_that_they_share():
    motions = (MOTIONS["cv"], MOTIONS["ca"], MOTIONS["ctrv"])
    _, _, measurements = recorded(MOTIONS["cv"], FLAT, np.random.default_rng(4))
    shared = {"motions": motions, "prior": prior_of(MOTIONS["cv"])}
    compiled, plain = (InteractingFilter(sensor=s, **shared).track(measurements) for s in (FLAT, Plain(FLAT)))
    np.testing.assert_allclose(compiled.states, plain.states, atol=1e-7)
    np.testing.assert_allclose(compiled.probabilities, plain.probabilities, atol=1e-7)


@pytest.mark.parametrize("name", FILTERS)
def test_equal_times_update_without_moving(name):
    motion = MOTIONS["cv"]
    times, _, sets = recorded(motion, FLAT, np.random.default_rng(5))
    halves = [[sets[k]._replace(**{f: getattr(sets[k], f)[rows] for f in sets[k]._fields[1:4]}) for k in range(STEPS)]
              for rows in (slice(2), slice(2, 4))]  # fmt: skip
    twice = [part for both in zip(*halves, strict=True) for part in both]
    for sensor in (FLAT, Plain(FLAT)):
        filter = made(name, motion, sensor)
        mean, covariance = followed(name, filter, times, sets)
        apart, spread = followed(name, filter, np.repeat(times, 2), twice)
        deviation = np.sqrt(np.diag(covariance))
        # linearised at two places rather than one
        assert (np.abs(apart - mean) < 0.1 * deviation).all()
        np.testing.assert_allclose(np.sqrt(np.diag(spread)), deviation, rtol=0.05)


@pytest.mark.parametrize("name", [name for name in FILTERS if name != "map"])
def test_time_that_runs_backwards_is_refused(name):
    filter = made(name, MOTIONS["cv"], FLAT)
    state = filter.init(np.random.default_rng(0), 5.0)
    with pytest.raises(DataError, match="comes after 5 s; sort the measurements by time"):
        filter.step(state, 4.0, FLAT.nothing(4.0), np.random.default_rng(0))


@pytest.mark.parametrize("sensor", SENSORS)
def test_the_particle_filter_takes_the_same_sensors(sensor):
    motion, seen = MOTIONS["cv"], SENSORS[sensor]
    times, _, measurements = recorded(motion, seen, np.random.default_rng(6))
    particles = ParticleFilter(motion=motion, sensor=seen, prior=prior_of(motion), particles=100_000)
    *_, drawn = run(particles, measurements, np.random.default_rng(0), times)
    mean, covariance = followed("extended", made("extended", motion, seen), times, measurements)
    deviation = np.sqrt(np.diag(covariance))
    assert (np.abs(drawn.mean - mean) < 0.4 * deviation).all()
    np.testing.assert_allclose(np.sqrt(np.diag(drawn.covariance)), deviation, rtol=0.25)


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("sensor", ["bearings", "arrivals", "hybrid", "linear"])
def test_yaml_is_written_and_read_back(name, sensor, tmp_path):
    seen = LINEAR if sensor == "linear" else SENSORS[sensor]
    for motion in ("cv", "ct"):
        filter = made(name, MOTIONS[motion], seen)
        (tmp_path / "filter.yaml").write_text(filter.to_yaml())
        assert type(filter).from_yaml(tmp_path / "filter.yaml") == filter


@pytest.mark.parametrize("name", FILTERS)
def test_a_users_own_part_is_no_yaml(name):
    for motion, sensor in ((OwnDrawn(), FLAT), (MOTIONS["cv"], OwnPlace())):
        with pytest.raises(ElusiveError, match=r"Own(Drawn|Place)"):
            made(name, motion, sensor).to_yaml()


def test_without_a_prior_only_what_starts_by_itself():
    for sensor, motion in ((OwnPlace(), MOTIONS["cv"]), (FLAT, OwnDrawn())):
        with pytest.raises(ElusiveError, match="prior: is needed with"):
            ExtendedKalmanFilter(sensor=sensor, motion=motion)
    assert ExtendedKalmanFilter(sensor=FLAT, motion=OwnLinear()).compiled
