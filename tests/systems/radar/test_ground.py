"""Shores and bridges without a chart: found as places of the world, as dense as their plots, and no tracks of ships."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.sensors import RadarSensor
from elusive.sensors.radar_scans import OwnShip, RadarPlot, RadarScan, scan_of
from elusive.systems.radar.ground import Fixed, ground_finding
from elusive.systems.radar.ground_echoes import GroundEchoes
from elusive.systems.radar.parameters import RadarTracking
from tests.systems.radar.test_lives import shown

SENSOR = RadarSensor(
    range_sd_m=10.0, bearing_sd_mrad=3.0, max_range_m=6000.0, false_alarms=2.0, max_doppler_mps=40.0, doppler_sd_mps=1.0
)
PERIOD_S, OWN = 2.5, np.array([6.0, 0.0])


def coast(rng, n=100):
    """Echoes along a shore 900 m north of where the radar sails, each seen in its own share of the scans."""
    places = np.column_stack([rng.uniform(-2500, 3500, n), 900 + rng.uniform(0, 60, n)])
    return places, rng.uniform(0.2, 0.9, n)


def sailed(rng, scans, echoes, often, ships=(), moving=True):
    """Scans of a radar that sails east, or rests, past echoes, and ships with false alarms."""
    found, ships = [], np.array(ships).reshape(-1, 4)
    for k in range(scans):
        time_s = PERIOD_S * k
        own = moving * time_s * OWN
        now = ships[:, [0, 2]] + time_s * ships[:, [1, 3]]
        alarm = np.column_stack([rng.uniform(0, 6000, 2), rng.uniform(0, 2 * np.pi, 2)])
        seen = np.concatenate([echoes[rng.random(len(echoes)) < often], now[rng.random(len(now)) < 0.9]]) - own
        far, bearing = np.hypot(*seen.T) + rng.normal(0, 10, len(seen)), np.arctan2(*seen.T)
        bearing = bearing + rng.normal(0, 3e-3, len(seen))
        rows = np.concatenate([np.column_stack([far, bearing % (2 * np.pi)]), alarm])
        scan = scan_of(time_s, [RadarPlot(time_s, r, b) for r, b in rows[rows[:, 0] < 6000].tolist()])
        found.append(scan._replace(own=OwnShip(own[0], moving * OWN[0], own[1], moving * OWN[1])))
    return found, lambda time_s: ships[:, [0, 2]] + time_s * ships[:, [1, 3]]


def ground_of(scans):
    fixed = Fixed.of(SENSOR, scans)
    for scan in scans:
        fixed.add(scan, SENSOR.places(scan)[0])
    return np.array(fixed.standing(SENSOR)[0]).reshape(-1, 6)


@pytest.mark.parametrize("headway_m", [200.0, 400.0])
def test_ships_that_follow_each_other_are_no_ground(headway_m):
    """Of a radar that rests their way has plots all along, in a row."""
    rng = np.random.default_rng(4)
    convoy = np.array([[-500.0 - headway_m * k, 5.0, 1500.0 + 30 * (k % 2), 0.0] for k in range(6)])
    scans, _ = sailed(rng, 80, np.zeros((0, 2)), np.zeros(0), convoy, moving=False)
    assert not len(ground_of(scans))
    echoes, often = coast(rng)
    scans, _ = sailed(rng, 80, echoes, often, convoy, moving=False)
    places = ground_of(scans)[:, :2]
    assert len(places) > 40
    assert (places[:, 1] < 1300).all()


@pytest.mark.parametrize("moving", [True, False])
def test_a_shore_is_ground_and_what_stands_alone_or_sails_is_not(moving):
    rng = np.random.default_rng(3)
    echoes, often = coast(rng)
    alone = np.array([[500.0, -1500.0], [2000.0, -2500.0], [2150.0, -2500.0]])  # two of them as ships at anchor are
    ships = [[-1500.0, 5.0, -800.0, 0.0], [1500.0, -1.5, -900.0, 0.0]]  # the second hardly sails
    scans, _ = sailed(rng, 60, np.concatenate([echoes, alone]), np.concatenate([often, [0.9, 0.9, 0.9]]), ships, moving)
    places = ground_of(scans)[:, :2]
    near = np.hypot(*(echoes[:, None] - places).transpose(2, 0, 1)).min(axis=1) < 40
    assert near.mean() > 0.8
    assert (places[:, 1] > 800).all()
    assert ground_finding(()).holds
    finding = ground_finding(tuple(map(tuple, places)))
    assert not finding.holds
    assert finding.remedy == "Give the chart (--chart)."


def test_false_alarms_are_no_ground():
    """Nor are they where they are dense: 40 a scan within a kilometre of a radar that rests."""
    rng = np.random.default_rng(4)
    for dense in (0, 40):
        scans = []
        for _ in range(60):
            far = np.concatenate([rng.uniform(0, 6000, 4), rng.uniform(0, 1000, dense)])
            rows = zip(far.tolist(), rng.uniform(0, 2 * np.pi, len(far)).tolist(), strict=True)
            scans.append(scan_of(0.0, [RadarPlot(0.0, *row) for row in rows]))
        assert not len(ground_of(scans))


def test_ground_is_as_dense_as_its_plots():
    """Over range and bearing its density integrates to the number of its plots, wherever the radar is by then."""
    ground = ((500.0, 900.0, 60.0, 30.0, 20.0, 1.5), (560.0, 910.0, 40.0, 80.0, 0.0, 0.5))
    step_m, step_rad = 6.0, 4e-3
    ranges, bearings = np.arange(900.0, 1400.0, step_m), np.arange(0.1, 0.8, step_rad)
    far, angle = (one.ravel() for one in np.meshgrid(ranges, bearings))
    blank = np.full(len(far), np.nan)
    for own in (OwnShip(), OwnShip(200.0, 6.0, -300.0, 0.0)):
        scan = RadarScan(0.0, np.zeros(len(far)), far, angle, blank, own)
        density = np.exp(GroundEchoes.of(SENSOR, ground).log_scattered(scan))
        assert density.sum() * step_m * step_rad == pytest.approx(2.0, rel=0.01)


def test_the_doppler_of_ground_is_the_radars_own():
    """Straight ahead of a ship of 6 m/s what rests comes nearer by as much: Doppler is Gaussian about that."""
    ground = ((900.0, 0.0, 60.0, 60.0, 0.0, 1.0),)
    dopplers = np.arange(-12.0, 0.0, 0.01)
    many = np.full(len(dopplers), 900.0), np.full(len(dopplers), np.pi / 2)
    scan = RadarScan(0.0, np.zeros(len(dopplers)), *many, dopplers, OwnShip(0.0, 6.0, 0.0, 0.0))
    density = np.exp(GroundEchoes.of(SENSOR, ground).log_scattered(scan))
    density /= density.sum() * 0.01
    mean = density @ dopplers * 0.01
    assert mean == pytest.approx(-6.0, abs=0.01)
    assert density @ (dopplers - mean) ** 2 * 0.01 == pytest.approx(1.0, rel=0.01)


@pytest.mark.thorough
@pytest.mark.parametrize("moving", [True, False])
def test_a_radar_without_a_chart_makes_no_ships_of_a_shore(moving):
    """Rows of confirmed tracks that are of no ship and sail are few, and ships are found."""
    rng = np.random.default_rng(7)
    ships = [[-1500.0, 5.0, -800.0, 0.0], [1500.0, -6.0, 400.0, 0.0], [500.0, 0.0, -1500.0, 0.0]]
    scans, truth = sailed(rng, 60, *coast(rng), ships, moving)
    wrong, found = shown(scans, truth, RadarTracking(particles=200), 2.0)
    assert wrong < 30
    assert found > 0.9
