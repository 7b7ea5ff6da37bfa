"""A picture that turns as a whole is told from false alarms, some of which fit any turn."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.sensors import RadarSensor
from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.systems.radar.turned import Turns

SENSOR = RadarSensor(range_sd_m=10.0, bearing_sd_mrad=3.0, max_range_m=8000.0)


def scan(time_s, far, bearing):
    plots = [RadarPlot(time_s, r, b % (2 * np.pi)) for r, b in zip(far.tolist(), bearing.tolist(), strict=True)]
    return scan_of(time_s, plots)


def alarms(rng, count):
    return 8000 * np.sqrt(rng.random(count)), rng.uniform(0, 2 * np.pi, count)


def test_alarms_alone_turn_nothing():
    turns, rng = Turns(SENSOR), np.random.default_rng(4)
    for k in range(300):
        turns.add(scan(2.5 * k, *alarms(rng, rng.integers(4, 60))))
    assert turns.finding.holds


@pytest.mark.parametrize(("count", "step"), [(0, 0.4), (4, 0.4), (4, 0.05), (4, 2.5)])
def test_ships_that_turn_together_are_seen_among_alarms(count, step):
    turns, rng = Turns(SENSOR), np.random.default_rng(5)
    far, bearing = np.array([900.0, 2100, 3500, 4800, 6200, 7000]), np.array([0.2, 1.5, 2.2, 3.9, 4.4, 5.8])
    for k in range(40):
        more, where = alarms(rng, count)
        now = bearing + (step if k >= 22 else 0.0) + rng.normal(0, 3e-3, 6)
        heard = far + rng.normal(0, 10, 6)
        turns.add(scan(2.5 * k, np.concatenate([heard, more]), np.concatenate([now, where])))
    finding = turns.finding
    assert not finding.holds
    assert "at 55 s" in finding.sentence  # 22 scans of 2.5 s
    assert finding.seen == pytest.approx(np.degrees(step), abs=2.0)


def test_ships_that_turn_each_for_itself_turn_no_picture():
    turns, rng = Turns(SENSOR), np.random.default_rng(6)
    place, course = rng.uniform(-4000, 4000, (6, 2)), rng.uniform(0, 2 * np.pi, 6)
    for k in range(60):
        course = course + np.where((k + 7 * np.arange(6)) % 30 < 10, 0.1, 0.0)
        place = place + 20 * np.column_stack([np.sin(course), np.cos(course)])
        far, bearing = np.hypot(*place.T), np.arctan2(*place.T)
        turns.add(scan(2.5 * k, far + rng.normal(0, 10, 6), bearing + rng.normal(0, 3e-3, 6)))
    assert turns.finding.holds


def test_a_spoke_that_goes_round_turns_nothing():
    """Another radar's pulses, on one bearing of a scan and farther on in the next."""
    turns, rng = Turns(SENSOR), np.random.default_rng(6)
    for k in range(200):
        more, where = alarms(rng, 12)
        along = 400.0 * np.arange(1, 21) + rng.uniform(0, 400)
        spoke = 0.2 * k + rng.normal(0, 0.01) + rng.normal(0, 3e-3, len(along))
        turns.add(scan(2.5 * k, np.concatenate([along, more]), np.concatenate([spoke, where])))
    assert turns.finding.holds
