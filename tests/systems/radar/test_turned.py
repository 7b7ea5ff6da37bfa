"""A picture that turns as a whole is told from false alarms, some of which fit any turn."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.systems.radar.turned import Together, Turns, common_of


def scan(time_s, far, bearing):
    plots = [RadarPlot(time_s, r, b % (2 * np.pi)) for r, b in zip(far.tolist(), bearing.tolist(), strict=True)]
    return scan_of(time_s, plots)


def alarms(rng, count):
    return 8000 * np.sqrt(rng.random(count)), rng.uniform(0, 2 * np.pi, count)


def test_alarms_alone_turn_nothing():
    """Of 9000 such scans six were taken for turned ones."""
    turns = Turns()
    rng = np.random.default_rng(4)
    for k in range(1500):
        turns.add(scan(2.5 * k, *alarms(rng, rng.integers(4, 70))))
    assert not turns.turned.turns


@pytest.mark.parametrize("count", [0, 4])
def test_ships_that_turn_together_are_seen_among_alarms(count):
    turns, rng = Turns(), np.random.default_rng(5)
    far, bearing = np.array([900.0, 2100, 3500, 4800, 6200, 7000]), np.array([0.2, 1.5, 2.2, 3.9, 4.4, 5.8])
    for k in range(20):
        more, where = alarms(rng, count)
        now = bearing + (0.4 if k >= 12 else 0.0) + rng.normal(0, 3e-3, 6)
        turns.add(scan(2.5 * k, np.concatenate([far, more]), np.concatenate([now, where])))
    (turn,) = turns.turned.turns
    assert turn.time_s == 2.5 * 12
    assert turn.turn_deg == pytest.approx(np.degrees(0.4), abs=2.0)


def test_a_spoke_that_goes_round_turns_nothing():
    """Another radar's pulses, on one bearing of a scan and farther on in the next."""
    turns, rng = Turns(), np.random.default_rng(6)
    for k in range(200):
        more, where = alarms(rng, 12)
        along = 400.0 * np.arange(1, 21) + rng.uniform(0, 400)
        spoke = 0.2 * k + rng.normal(0, 0.01) + rng.normal(0, 3e-3, len(along))
        turns.add(scan(2.5 * k, np.concatenate([along, more]), np.concatenate([spoke, where])))
    assert not turns.turned.turns


def test_plots_that_do_not_err_have_nothing_in_common():
    assert common_of(np.arange(200) // 4, np.zeros(200)) == Together()
