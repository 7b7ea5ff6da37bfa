"""What stands still as a radar sails: right recordings are silent, wrong ones named by what was done to them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from elusive.contracts import Array
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import OwnShip, RadarScan
from elusive.systems.radar.still import still_finding
from tests.longer import longer

SENSOR = RadarSensor(detection_probability=0.9, false_alarms=1.0, max_range_m=5000.0, max_doppler_mps=40.0)
PERIOD_S = 2.5
Spoilt = Callable[[RadarScan, float, OwnShip], RadarScan]


def sailed(seed: int, fixed: int = 25, ships: int = 3, spoilt: Spoilt | None = None) -> list[RadarScan]:
    """A radar of 7 m/s that turns by 90 degrees half-way, past echoes that stand and ships that do not."""
    rng = np.random.default_rng([seed, 4])
    course = rng.uniform(0, 2 * np.pi) + np.radians(np.clip(np.arange(120) - 50, 0, 20) * 4.5)
    velocity = 7.0 * np.column_stack([np.sin(course), np.cos(course)])
    way = np.cumsum(PERIOD_S * velocity, axis=0)
    stand = np.zeros((fixed, 4))
    stand[:, [0, 2]] = way[60] + rng.uniform(-3500, 3500, (fixed, 2))
    sail, heading = np.zeros((ships, 4)), rng.uniform(0, 2 * np.pi, ships)
    sail[:, [0, 2]] = way[60] + rng.uniform(-3000, 3000, (ships, 2))
    sail[:, [1, 3]] = 6.0 * np.column_stack([np.sin(heading), np.cos(heading)])
    own = [OwnShip(x, vx, y, vy) for (x, y), (vx, vy) in zip(way.tolist(), velocity.tolist(), strict=True)]
    scans = []
    for k, here in enumerate(own):
        there = sail.copy()
        there[:, [0, 2]] += PERIOD_S * (k - 60) * sail[:, [1, 3]]
        scan = SENSOR.simulate(np.concatenate([stand, there]) - np.array(here), rng, PERIOD_S * k)._replace(own=here)
        scans.append(spoilt(scan, float(course[k]), own[max(k - 4, 0)]) if spoilt else scan)
    return scans


def judged(scans: list[RadarScan]) -> tuple[bool, str]:
    found = still_finding(scans, SENSOR.range_sd_m, SENSOR.bearing_sd_rad)
    return found.holds, found.sentence


def turned(scan: RadarScan, by_rad: float) -> RadarScan:
    return scan._replace(bearing_rad=(scan.bearing_rad + by_rad) % (2 * np.pi))


SPOILT: dict[str, Spoilt] = {
    "bearings are 2 degrees too large": lambda scan, course, before: turned(scan, np.radians(2)),
    "bearings are 7 degrees too small": lambda scan, course, before: turned(scan, np.radians(-7)),
    "bearings count anticlockwise": lambda scan, course, before: scan._replace(
        bearing_rad=2 * np.pi - scan.bearing_rad
    ),
    "bearings are from the bow": lambda scan, course, before: turned(scan, -course),
    "ranges are in yards": lambda scan, course, before: scan._replace(range_m=scan.range_m / 0.9144),
    "ranges are 150 m too long": lambda scan, course, before: scan._replace(range_m=scan.range_m + 150),
    "the radar's own places are 10 s late": lambda scan, course, before: scan._replace(own=before),
}


@pytest.mark.parametrize("what", SPOILT)
@pytest.mark.parametrize("seed", longer([0, 1], 1))
def test_what_was_done_is_named(what: str, seed: int) -> None:
    holds, sentence = judged(sailed(seed, spoilt=SPOILT[what]))
    assert not holds
    assert f" if {what};" in sentence


@pytest.mark.parametrize(("fixed", "ships"), longer([(25, 3), (10, 3), (0, 10)], (25, 3)))
def test_a_right_way_is_silent(fixed: int, ships: int) -> None:
    """None of 252 drawn otherwise was named: with 95 % at most 1 in 80."""
    assert all(judged(sailed(seed, fixed, ships))[0] for seed in range(3))


def test_the_scans_of_a_moment_say_nothing() -> None:
    assert judged(sailed(0, spoilt=SPOILT["bearings are from the bow"])[:15])[0]
    assert judged([])[0]


def test_a_log_without_velocities_says_nothing() -> None:
    nowhere: Array = np.full(4, np.nan)
    assert judged([scan._replace(own=OwnShip(*nowhere.tolist())) for scan in sailed(0)])[0]
