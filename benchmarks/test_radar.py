"""The radar particle filter over a recording of single plots, against NumPy and Stone Soup; its particle MAP."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from benchmarks.stone_soup_radar import RadarOpponent
from elusive.charts import FieldWater
from elusive.filters.particle.particle_map import map_estimate
from elusive.filters.particle.sir import ParticleFilter
from elusive.motion import ConstantVelocity, square_root
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarPlot
from elusive.sensors.scan_prior import ScanPrior
from elusive.tracking.detections import DetectionTracker
from tests.charts.shapes import land
from tests.reference import particle as reference
from tests.reference.motion import generator_noise, keyed_noise

STEPS = 20
RUNS = 20
MOTION = ConstantVelocity(q=(5 / 3) ** 2)
ROOT = square_root(MOTION.Q(1.0))
SENSOR = RadarSensor()


def recording():
    """Plots of a ship five kilometres away, a second apart."""
    rng, plots = np.random.default_rng(0), []
    for k in range(STEPS + 1):
        looked = SENSOR.simulate(np.array([[-20.0, 0.0, 5_000.0 + 7.0 * k, 7.0]]), rng, time_s=k)
        plots.append(RadarPlot(k, *(float(part[0]) for part in looked[2:5])))
    return plots


PLOTS = recording()


def model(particles, knowledge=()):
    prior = ScanPrior(SENSOR, PLOTS[0])
    return ParticleFilter(motion=MOTION, sensor=SENSOR, prior=prior, knowledge=knowledge, particles=particles)


def follow(radar, started, rng):
    state = started
    for plot in PLOTS[1:]:
        state = radar.step(state, plot.time_s, plot, rng)
    return state


def means(radar, started, rng):
    state, found = started, []
    for plot in PLOTS[1:]:
        state = radar.step(state, plot.time_s, plot, rng)
        found.append(state.mean)
    return found


def follow_in_numpy(radar, started, rng, noise=generator_noise):
    state = started
    for plot in PLOTS[1:]:
        state = reference.step(radar, ROOT, state, plot, rng, noise)
    return state


@pytest.mark.parametrize("particles", [2000, 6000])
def test_steps_against_numpy(benchmark, best_of, report, particles):
    radar, rng = model(particles), np.random.default_rng(1)
    started = radar.init(rng, 0.0)
    ours = follow(radar, started, np.random.default_rng(2))
    twin = follow_in_numpy(radar, started, np.random.default_rng(2), keyed_noise)
    np.testing.assert_allclose(ours.weights, twin[2], rtol=1e-8)
    np.testing.assert_allclose(ours.log_evidence, twin[5], rtol=1e-10)
    mine, theirs = best_of(lambda: follow(radar, started, rng), lambda: follow_in_numpy(radar, started, rng))
    report(f"radar particle filter, {particles} particles, against NumPy", theirs / mine, 3)
    benchmark(follow, radar, started, rng)


@pytest.mark.parametrize("particles", [2000, 6000])
def test_steps_against_stone_soup(benchmark, best_of, report, particles):
    radar, rng = model(particles), np.random.default_rng(1)
    started = radar.init(rng, 0.0)
    opponent = RadarOpponent(radar, started.particles, PLOTS[1:])
    ours = np.array([means(radar, started, np.random.default_rng(k)) for k in range(RUNS)])
    theirs = np.array([opponent() for _ in range(RUNS)])
    error = np.sqrt((ours.var(axis=0, ddof=1) + theirs.var(axis=0, ddof=1)) / RUNS)
    # of 80 Student's t of 38 degrees of freedom one beyond 4.8 comes once in five hundred such tests
    assert np.abs((ours.mean(axis=0) - theirs.mean(axis=0)) / error).max() < 4.8
    mine, other = best_of(lambda: follow(radar, started, rng), opponent, rounds=3)
    report(f"the same, {particles} particles, against Stone Soup's ParticleUpdater", other / mine, 10)
    benchmark.pedantic(opponent, rounds=3)


@pytest.mark.parametrize("particles", [2000, 6000])
def test_a_map_in_the_step(benchmark, best_of, report, particles):
    east = [(-15.0, 4_000.0), (400.0, 4_000.0), (400.0, 6_000.0), (-15.0, 6_000.0)]
    field = FieldWater().bind(land(shapely.Polygon(east), sigma=7.0))
    free, charted, rng = model(particles), model(particles, (field,)), np.random.default_rng(1)
    started = free.init(rng, 0.0)
    without, within = best_of(lambda: follow(free, started, rng), lambda: follow(charted, started, rng))
    report(f"the same, {particles} particles: time without a map over with the field", without / within, 0.5)
    benchmark(follow, charted, started, rng)


def test_scans_of_many_plots(benchmark, best_of, report):
    """Fifteen ships among 200 false alarms: a scan, to what its 200 beginnings alone cost in NumPy."""
    rng = np.random.default_rng(3)
    sensor = SENSOR.replace(detection_probability=0.9, false_alarms=200.0, max_range_m=10_000.0, max_doppler_mps=40.0)
    states = np.column_stack([rng.uniform(-5000, 5000, (15, 4))]) * [1, 0.001, 1, 0.001]
    tracker = DetectionTracker(motion=ConstantVelocity(q=0.05), sensor=sensor)
    belief = tracker.init(rng)
    looks = []
    for k in range(12):
        looks.append(sensor.simulate(states, rng, 2.0 * k))
        states[:, [0, 2]] += 2.0 * states[:, [1, 3]]
    for look in looks[:8]:
        belief = tracker.step(belief, look.time_s, look, rng)

    def followed():
        state = belief
        for look in looks[8:]:
            state = tracker.step(state, look.time_s, look, np.random.default_rng(4))
        return state

    def beginnings():
        """The draws of every plot's new target, in NumPy as they are written."""
        for look in looks[8:]:
            of = np.repeat(np.arange(look.detections), tracker.particles)
            distance, bearing = sensor.scattered(look.range_m[of], look.bearing_rad[of], rng)
            along = rng.normal(look.doppler_mps[of], sensor.doppler_sd_mps)
            across = rng.normal(0.0, 8.0, len(of))
            sin, cos = np.sin(bearing), np.cos(bearing)
            np.column_stack([distance * sin, along * sin + across * cos, distance * cos, along * cos - across * sin])

    assert sum(track.status == "confirmed" for track in followed().tracks) == 15
    mine, theirs = best_of(followed, beginnings, rounds=3)
    report(
        "detections of 15 ships and 200 false alarms: NumPy's draws of beginnings, over a whole scan",
        theirs / mine,
        0.5,
    )
    report("the same: .2 s over a scan's time", 0.2 * len(looks[8:]) / mine, 1)
    benchmark.pedantic(followed, rounds=3)


def test_particle_map(benchmark, best_of, report):
    radar, rng = model(2000), np.random.default_rng(1)
    before = follow(radar, radar.init(rng, 0.0), rng)
    after = radar.step(before, PLOTS[-1].time_s, PLOTS[-1], rng)
    score = SENSOR.log_likelihood(after.particles, PLOTS[-1])

    def restricted():
        return map_estimate(radar, before, after, PLOTS[-1], rng)

    def whole():
        return reference.map_index(after.particles, score, before.particles, before.weights, MOTION)

    mine, theirs = best_of(restricted, whole, rounds=2)
    report("particle MAP of 2000, 200 candidates and 600 parents, against all by SciPy", theirs / mine, 100)
    benchmark(restricted)
