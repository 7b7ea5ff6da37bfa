"""Targets of several detections: closed forms against sums over every set of detections, ships by their echoes."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from elusive.motion import ConstantVelocity
from elusive.motion.extent import WithExtent
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import LENGTH, HullRadar, breadth_m
from elusive.sensors.radar_scans import RadarScan
from elusive.tracking.association import marginals
from elusive.tracking.detection_targets import Evidence, Expected, Target
from elusive.tracking.detections import DetectionTracker
from elusive.tracking.extended_scan import associated_extended
from elusive.tracking.lifecycle import Life
from tests.longer import longer

RADAR = RadarSensor(
    detection_probability=0.9, false_alarms=2.0, max_range_m=6000.0, doppler_probability=0.0, bearing_sd_mrad=2.0
)
HULLS = HullRadar(**{name: getattr(RADAR, name) for name in RadarSensor.model_fields})


class Further:
    """A sensor that says how many further detections each target makes, and nothing else."""

    def __init__(self, further):
        self.further = iter(further)

    def further_detections(self, states):
        return next(self.further)


def scanned(rng, targets, detections, particles=5):
    """Return targets before a scan and what its detections say of them, at random."""
    alive, found = [], []
    for _ in range(targets):
        weights = rng.dirichlet(np.ones(particles))
        states, r = rng.standard_normal((particles, 4)), float(rng.uniform(0.2, 0.9))
        target = Target(Life(), r, states, weights, states[0], np.eye(4), weights, -1, 0.0, 1.0, False, 0.0)
        alive.append(Expected(target, r, states, weights, states[0], np.eye(4), None))
        missed = np.full(particles, 0.3)
        densities = rng.gamma(0.5, 4.0, (detections, particles))
        likely = np.vstack([missed, (1 - missed) * densities])
        scale = np.zeros(detections + 1)
        which = np.arange(detections)
        found.append(Evidence(r, weights, 1.0, False, which, likely, likely @ weights, scale))
    return alive, found


def test_a_target_of_several_detections_is_that_of_the_sum_over_every_set_of_them():
    rng = np.random.default_rng(2)
    (one,), (said,) = scanned(rng, 1, 4)
    further, clutter = rng.uniform(0.1, 3.0, 5), rng.uniform(0.5, 2.0, 4)
    (after,), _, unclaimed = associated_extended(
        [one], [said], [], [said.which], None, np.log(clutter), Further([further] * 40)
    )
    densities = said.likely[1:] / 0.7
    by_size = lambda k: 0.7 * np.exp(-further) * further ** (k - 1) / math.factorial(k - 1) * math.factorial(k)  # noqa: E731
    joint, of_none = said.likely[0].copy(), np.zeros(4)
    totals = {(): said.likely[0]}
    for k in range(1, 5):
        for some in itertools.combinations(range(4), k):
            totals[some] = by_size(k) * np.prod(densities[list(some)] / clutter[list(some)][:, None], axis=0)
            joint = joint + totals[some]
    evidence = 1 - said.existence + said.existence * float(said.weights @ joint)
    assert after.existence == pytest.approx(said.existence * float(said.weights @ joint) / evidence)
    np.testing.assert_allclose(after.weights, said.weights * joint / (said.weights @ joint))
    for j in range(4):
        made = sum(float(said.weights @ part) for some, part in totals.items() if j in some)
        of_none[j] = 1 - said.existence * made / evidence
    np.testing.assert_allclose(unclaimed, of_none)


def test_of_a_detection_each_the_messages_are_those_of_williams_and_lau():
    rng = np.random.default_rng(3)
    alive, found = scanned(rng, 2, 1)
    clutter = np.array([0.8])
    nothing = Further([np.zeros(5)] * 100)
    targets, _, unclaimed = associated_extended(
        alive, found, [], [one.which for one in found], None, np.log(clutter), nothing
    )
    log_odds = np.concatenate([one.log_made - one.log_missed - np.log(clutter) for one in found])
    exact = marginals(np.array([0, 1]), np.array([0, 0]), log_odds, 2, 1)
    np.testing.assert_allclose(unclaimed, exact.unclaimed, rtol=1e-3)
    for target, said, missed, made in zip(targets, found, exact.missed, exact.pairs, strict=True):
        unseen = missed * math.exp(-said.log_missed) * said.existence * said.total[0]
        assert target.existence == pytest.approx(unseen + made, rel=1e-3)


def test_the_density_of_a_plot_along_a_hull_is_one_in_all():
    state = np.array([[1200.0, 5.0, 1500.0, -3.0, math.log(180.0), 0.0]])
    distance, bearing = np.meshgrid(np.arange(1700, 2150, 8.0), np.radians(np.arange(34.0, 44.0, 0.1)))
    plots = RadarScan(0.0, np.zeros(distance.size), distance.ravel(), bearing.ravel(), np.full(distance.size, np.nan))
    density = np.exp(HULLS.log_densities(state, plots, np.arange(distance.size)))
    assert density.sum() * 8.0 * math.radians(0.1) == pytest.approx(1.0, abs=0.01)


def test_a_hull_has_the_breadth_of_ships():
    np.testing.assert_allclose(breadth_m(np.array([20.0, 200.0, 80.0])), [5.0, 200 / 6.5, 80 / 5.25])


def test_new_ships_go_anywhere_whatever_pairs_of_plots_say():
    """Courses are drawn along pairs of plots; under their weights they are uniform, as births are."""
    rng = np.random.default_rng(1)
    scan = RadarScan(0.0, np.zeros(2), np.array([2000.0, 2000.0]), np.radians([10.0, 13.0]), np.full(2, np.nan))
    born = HULLS.draw_births(scan, np.arange(2), 40_000, 8.0, rng)
    for states, weights in zip(born.states, born.weights, strict=True):
        course = np.arctan2(states[:, 1], states[:, 3])
        for turns in (1, 2):
            assert abs(weights @ np.exp(1j * turns * course)) < 0.03
        assert weights @ states[:, LENGTH] == pytest.approx(math.log(40.0), abs=0.05)


def sailed(ships, rng, scans=40, interval_s=2.5):
    """Scans of ships on straight ways: place, velocity, fixed echoes along and across, probability of each."""
    quiet = RADAR.replace(detection_probability=1.0, false_alarms=0.0)
    for k in range(scans):
        rows = []
        for place, velocity, echoes, seen in ships:
            along = np.array(velocity) / np.hypot(*velocity)
            across = np.array([along[1], -along[0]])
            for u, v in np.array(echoes)[rng.random(len(echoes)) < seen]:
                x, y = np.array(place) + interval_s * k * np.array(velocity) + u * along + v * across
                rows.append([x, velocity[0], y, velocity[1]])
        real = quiet.simulate(np.array(rows).reshape(-1, 4), rng, interval_s * k)
        false = RADAR.simulate(np.zeros((0, 4)), rng, interval_s * k)
        parts = [np.concatenate(both) for both in zip(real.plots, false.plots, strict=True)]
        yield RadarScan(interval_s * k, *parts)


LONG = [(u, v) for u, v in zip(np.linspace(-90, 90, 6), (10, -12, 0, 5, -8, 3), strict=True)]
POINT = [(0.0, 0.0)]
SCENES = {
    "a long ship": ([((-500.0, 3000.0), (7.0, 0.0), LONG, 0.5)], [180.0]),
    "a long ship that comes straight on": ([((0.0, 4500.0), (0.0, -6.0), LONG, 0.5)], [180.0]),
    "two small ships side by side": (
        [((-500.0, 3000.0), (7.0, 0.0), POINT, 0.9), ((-500.0, 2940.0), (7.0, 0.0), POINT, 0.9)], [0.0, 0.0]
    ),
    "a pilot boat beside a long ship": (
        [((-500.0, 1500.0), (7.0, 0.0), LONG, 0.5), ((-500.0, 1420.0), (7.0, 0.0), POINT, 0.9)], [0.0, 180.0]
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    "scene", longer(SCENES, "a long ship that comes straight on", "a pilot boat beside a long ship")
)
def test_each_ship_is_one_track_of_its_own_length(scene):
    ships, lengths = SCENES[scene]
    rng = np.random.default_rng(4)
    motion = WithExtent(motion=ConstantVelocity(q=(2 / 3) ** 2))
    tracker = DetectionTracker(motion=motion, sensor=HULLS, particles=1500)
    state = tracker.init(rng)
    for scan in sailed(ships, rng):
        state = tracker.step(state, scan.time_s, scan, rng)
        sure = [target for target in state.targets if target.life.status == "confirmed"]
        if scan.time_s > 50.0:
            assert len(sure) == len(ships)
    found = sorted(HULLS.extent(one.particles, one.weights)["length_m"] for one in sure)
    for seen, length in zip(found, lengths, strict=True):
        assert seen == pytest.approx(length, abs=45.0)
    ends = [np.array(place) + scan.time_s * np.array(velocity) for place, velocity, *_ in ships]
    for target in sure:
        assert min(np.hypot(*(target.mean[[0, 2]] - end)) for end in ends) < 40.0
