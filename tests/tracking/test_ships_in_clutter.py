"""Fifteen ships among 200 false alarms a scan, pairs crossing and pairs 60 m apart: each keeps its number."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.metrics.clear_mot import clear_mot
from elusive.metrics.target_table import sightings
from elusive.motion import ConstantVelocity
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarPlot, scans_by_rotation
from elusive.tracking.detections import DetectionTracker

SENSOR = RadarSensor(detection_probability=0.9, false_alarms=200.0, max_range_m=10_000.0, max_doppler_mps=40.0)
ROTATION_S, SCANS, SHIPS = 2.0, 40, 15
SETTLED = 10  # scans by which each ship is confirmed
NEAR_M = 30.0  # half of what pairs are apart: a swap is seen


def later(states, time_s):
    """States some time on, straight ahead."""
    moved = states.copy()
    moved[:, [0, 2]] += np.reshape(time_s, (-1, 1)) * states[:, [1, 3]]
    return moved


def fleet(rng):
    """Four pairs that meet half-way, three side by side, and one ship alone, ``(15, 4)``."""
    rows, halfway_s = [], ROTATION_S * SCANS / 2
    for pair in range(8):
        place, speed = rng.uniform(-4000, 4000, 2), rng.uniform(6, 12)
        course, between = rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 1.2)
        for second in range(1 if pair == 7 else 2):
            turned = course + (between * second if pair < 4 else 0.0)
            velocity = speed * np.array([np.sin(turned), np.cos(turned)])
            aside = 60.0 * second * np.array([np.cos(course), -np.sin(course)]) if pair >= 4 else 0.0
            start = place + aside - halfway_s * velocity
            rows.append([start[0], velocity[0], start[1], velocity[1]])
    return np.array(rows)


def at_once(states, rng):
    """Scans whose plots are all of one time."""
    return [SENSOR.simulate(later(states, k * ROTATION_S), rng, k * ROTATION_S) for k in range(SCANS)]


def in_turn(states, rng):
    """Scans of plots of a time each, as the antenna comes by."""
    plots = []
    for start_s in ROTATION_S * np.arange(SCANS):
        passing_s = np.zeros(len(states))
        for _ in range(3):
            there = later(states, start_s + passing_s)
            passing_s = ROTATION_S * (np.arctan2(there[:, 0], there[:, 2]) % (2 * np.pi)) / (2 * np.pi)
        for look in (
            SENSOR.simulate(np.empty((0, 4)), rng, start_s),
            SENSOR.replace(false_alarms=0.0).simulate(later(states, start_s + passing_s), rng, start_s),
        ):
            times_s = start_s + ROTATION_S * (look.bearing_rad % (2 * np.pi)) / (2 * np.pi)
            plots += map(RadarPlot, times_s, look.range_m, look.bearing_rad, look.doppler_mps)
    return list(scans_by_rotation(sorted(plots, key=lambda plot: plot.time_s), ROTATION_S, "plots"))


@pytest.mark.thorough
@pytest.mark.parametrize("seen", [at_once, in_turn])
@pytest.mark.parametrize("seed", range(6))
def test_ships_keep_their_numbers(seen, seed):
    rng = np.random.default_rng([15, seed])
    states = fleet(rng)
    assert len(states) == SHIPS
    tracker = DetectionTracker(motion=ConstantVelocity(q=0.05), sensor=SENSOR)
    belief, truth, tracks = tracker.init(rng), [], []
    for k, scan in enumerate(seen(states, rng)):
        belief = tracker.step(belief, scan.time_s, scan, rng)
        truth += [(k, ship, x, y) for ship, (x, _, y, _) in enumerate(later(states, scan.time_s))]
        tracks += [(k, one.track, *one.mean[[0, 2]]) for one in belief.tracks if one.status == "confirmed"]
    true, found = (np.array(rows) for rows in (truth, tracks))
    scores = clear_mot(*(sightings(*rows[:, :2].T.astype(int), rows[:, 2:]) for rows in (true, found)), gate=NEAR_M)
    assert scores.mismatches[SETTLED:].sum() == 0
    assert scores.misses[SETTLED:].sum() <= 0.01 * scores.targets[SETTLED:].sum()
    assert scores.false_positives[SETTLED:].sum() <= 0.01 * scores.targets[SETTLED:].sum()
