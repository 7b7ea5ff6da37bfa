"""Plots that trail behind ships are taken for wakes: no track of theirs is sure, and ships are no hulls by them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from elusive.errors import ParameterError
from elusive.sensors import RadarSensor
from elusive.sensors.radar_scans import RadarPlot, RadarScan, scan_of
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.recorded import RecordedRadar
from elusive.systems.radar.wakes import Trailing, Wakes, wakes_finding
from tests.longer import longer
from tests.systems.radar.test_lives import shown

SENSOR = RadarSensor(range_sd_m=10.0, bearing_sd_mrad=3.0, max_range_m=8000.0, false_alarms=2.0)
COURSE = np.array([0.6, 0.8])


def ship(existence=0.9, speed=8.0):
    """One that sails north-east of the radar, its place known to 10 m."""
    east, north = speed * COURSE
    return SimpleNamespace(
        existence=existence, mean=np.array([1500.0, east, 2000.0, north]), covariance=np.diag([100.0, 0.25] * 2),
        detection=-1,
    )  # fmt: skip


def scan_at(places):
    far, angle = np.hypot(*places.T), np.arctan2(*places.T) % (2 * np.pi)
    return RadarScan(0.0, np.zeros(len(far)), far, angle, np.full(len(far), np.nan))


def test_a_wake_has_its_number_and_lies_behind():
    """Its density, integrated over range and bearing, is so many a ship; half of the mean distance ahead is none."""
    ranges, bearings = np.arange(1.0, 5000.0, 8.0), np.arange(0.2, 1.2, 2e-3)
    far, angle = (one.ravel() for one in np.meshgrid(ranges, bearings))
    places = far[:, None] * np.column_stack([np.sin(angle), np.cos(angle)])
    density = np.exp(Wakes(SENSOR, 1.5, 200.0).log_trailing([ship()], scan_at(places))) * 8.0 * 2e-3
    assert density.sum() == pytest.approx(0.9 * 1.5, rel=0.02)
    along = (np.array([1500.0, 2000.0]) - places) @ COURSE
    assert density @ along / density.sum() == pytest.approx(200.0, rel=0.05)
    assert density[along < -100.0].sum() < 1e-3
    still = Wakes(SENSOR, 1.5, 200.0).log_trailing([ship(speed=0.5)], scan_at(places[:3]))
    assert (still == -np.inf).all()


def counted(rng, drawn, scans=400):
    """What is counted of plots that lie so far behind a ship."""
    trailing = Trailing(1.0)
    for _ in range(scans):
        along = drawn(rng)
        places = np.array([1500.0, 2000.0]) - along[:, None] * COURSE + rng.normal(0, 10, (len(along), 2))
        trailing.add(scan_at(places), SENSOR, {1: ship()}, np.ones(len(along), dtype=bool))
    return trailing


def test_wakes_are_counted_and_hulls_and_chance_are_none():
    rng = np.random.default_rng(5)
    wakes = counted(rng, lambda rng: rng.exponential(150.0, rng.poisson(1.2)))
    number, length = wakes.wakes
    # what an error of 12 m takes to the other side counts against; what is beyond a kilometre is seldom
    assert number == pytest.approx(1.2, abs=4 * np.sqrt(1.2 / 400) + 1.2 * 2 * 12 / 150)
    assert length == pytest.approx(150.0, abs=4 * 150 / np.sqrt(480) + 12)
    assert counted(rng, lambda rng: rng.uniform(-60.0, 180.0, rng.poisson(2.0))).wakes == ()  # a hull
    assert counted(rng, lambda rng: rng.uniform(-1000.0, 1000.0, rng.poisson(0.3))).wakes == ()
    assert counted(rng, lambda rng: rng.uniform(0.0, 1000.0, rng.poisson(0.5))).wakes == ()
    assert counted(rng, lambda rng: np.zeros(0)).wakes == ()


@pytest.mark.parametrize("seed", longer(range(3), 1, 2))
def test_foam_stays_behind_a_ship_and_a_hull_goes_along(seed):
    """Pairs of plots that stay are as many behind as chance makes, where one on board lies anywhere along it."""
    rng = np.random.default_rng(seed)
    foam, hull, flakes = Trailing(1.0), Trailing(1.0), np.zeros((0, 2))
    for k in range(500):
        sails = ship()
        sails.mean[[0, 2]] += 1.5 * k * sails.mean[[1, 3]] - [3500.0, 4500.0]
        left = sails.mean[None, [0, 2]][: int(rng.random() < 0.3)]
        flakes = np.concatenate([flakes[rng.random(len(flakes)) < 0.85], left])
        board = sails.mean[[0, 2]] + rng.uniform(-100, 100, rng.poisson(2.0))[:, None] * COURSE
        for trailing, places in ((foam, flakes[rng.random(len(flakes)) < 0.7]), (hull, board)):
            seen = scan_at(places + rng.normal(0, 5, places.shape))
            trailing.add(seen, SENSOR, {1: sails}, np.ones(seen.detections, dtype=bool))
    assert foam.stays
    assert not hull.stays
    foam.add(seen, SENSOR, {}, np.ones(seen.detections, dtype=bool))
    assert not foam._before  # of a ship that has gone nothing is held: a radar watches for years


def test_what_is_told_of_wakes():
    assert wakes_finding(()).holds
    assert "1.5 plots a scan behind them, 200 m off" in wakes_finding((1.5, 200.0)).sentence
    with pytest.raises(ParameterError, match="plots a ship and scan and a distance"):
        RecordedRadar(false_alarm_wakes=(1.0,))


def trailed(rng, scans, ships=3, number=1.5, mean_s=20.0):
    """Scans of ships with wakes, and where the ships are then."""
    start, angle = rng.uniform(-2500, 2500, (ships, 2)), rng.uniform(0, 2 * np.pi, ships)
    sail = rng.uniform(6, 10, ships)[:, None] * np.column_stack([np.sin(angle), np.cos(angle)])
    found = []
    for k in range(scans):
        now = start + 2.5 * k * sail
        each = [now[rng.random(ships) < 0.9], rng.uniform(-5000, 5000, (rng.poisson(3), 2))]
        for place, velocity in zip(now, sail, strict=True):
            later = rng.exponential(mean_s, rng.poisson(number))
            each.append(place - later[:, None] * velocity + rng.normal(0, 10, (len(later), 2)))
        places = np.concatenate(each)
        far, bearing = np.hypot(*places.T), np.arctan2(*places.T)
        far, bearing = far + rng.normal(0, 10, len(far)), (bearing + rng.normal(0, 3e-3, len(far))) % (2 * np.pi)
        pairs = zip(far.tolist(), bearing.tolist(), strict=True)
        found.append(scan_of(2.5 * k, [RadarPlot(2.5 * k, abs(r), b, np.nan) for r, b in pairs]))
    return found, lambda time_s: start + time_s * sail


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(3))
def test_wakes_are_no_ships(seed):
    """Of rows of confirmed tracks that are of no ship a twentieth is left at most, and ships are found."""
    scans, truth = trailed(np.random.default_rng(seed), 60)
    taken = RadarTracking(particles=400, extent="point", radar={"false_alarm_wakes": ()})
    before, _ = shown(scans, truth, taken)
    wrong, found = shown(scans, truth, RadarTracking(particles=400))
    assert before > 20
    assert wrong < before / 20
    assert found > 0.9
