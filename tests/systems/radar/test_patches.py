"""False alarms that are far denser in places than range and bearing tell: a shower, surf; no ship is made of them."""

from __future__ import annotations

import csv
import re

import numpy as np
import pytest

from elusive.cli import main
from elusive.results import read_tracks_csv
from elusive.sensors import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.range_bands import BANDS, SECTORS
from elusive.systems.radar.first_pass import fitted
from elusive.systems.radar.learnt import MEMORY
from elusive.systems.radar.live import follow_radar
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.patches import BEARINGS, RANGES, Lasting, cell_of, laid
from elusive.systems.radar.ships import Surroundings
from elusive.systems.radar.survey import survey
from elusive.tracking.memory import Memory
from tests.systems.test_flat import Coming

SCANS, INTERVAL_S, ALARMS = 60, 2.5, 25.0
SHIPS = np.array([(900.0, 6.0, 500.0, -4.0), (-2500.0, 8.0, 1500.0, 5.0), (2600.0, -7.0, 2800.0, 2.0)])
SENSOR = RadarSensor(bearing_sd_mrad=5.0, detection_probability=0.85, max_range_m=6000.0, doppler_probability=0.0)
VIEW = SENSOR.replace(false_alarms=1.0)
SEA = np.ones((BANDS, SECTORS))


def shower(rng, n):
    """Places ``(n, 2)`` in 800 m of a side."""
    return np.array([2000.0, -2500.0]) + rng.uniform(-400, 400, (n, 2))


def surf(rng, n):
    """Places on a line of 6 km, 60 m about it."""
    east = rng.uniform(-3000, 3000, n)
    return np.column_stack([east, 3000 + 0.1 * east + rng.normal(0, 60, n)])


def recorded(where, seed):
    rng, scans = np.random.default_rng([seed, 77]), []
    for k in range(SCANS):
        states = SHIPS.copy()
        states[:, [0, 2]] += states[:, [1, 3]] * k * INTERVAL_S
        ships = SENSOR.simulate(states, rng, k * INTERVAL_S)
        east, north = where(rng, rng.poisson(ALARMS)).T
        ranges = np.append(np.hypot(east, north), ships.range_m)
        bearings = np.append(np.arctan2(east, north) % (2 * np.pi), ships.bearing_rad)
        order, times = np.argsort(bearings), np.full(len(ranges), ships.time_s)
        scans.append(RadarScan(ships.time_s, times, ranges[order], bearings[order], np.full(len(order), np.nan)))
    return scans


def others(folder):
    """How many confirmed tracks are no ship's; each ship has one."""
    found, wrong = set(), 0
    for rows in read_tracks_csv(folder / "tracks.csv").confirmed().values():
        truth = SHIPS[:, [0, 2]] + SHIPS[:, [1, 3]] * rows["time_s"][:, None, None]
        away = np.median(np.hypot(*(rows["position"][:, None] - truth).transpose(2, 0, 1)), axis=0)
        if away.min() < 80.0:
            found.add(int(away.argmin()))
        else:
            wrong += 1
    assert found == set(range(len(SHIPS)))
    return wrong


CASES = [(shower, 4), (shower, 3), (surf, 3), (surf, 4)]


def tracked(folder, capsys, scans, *told):
    """What the command says of scans; its results stand in ``out``."""
    with (folder / "plots.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time_s", "range_m", "bearing_deg"])
        for scan in scans:
            for distance, bearing in zip(scan.range_m, np.degrees(scan.bearing_rad), strict=True):
                rows.writerow([scan.time_s, f"{distance:.2f}", f"{bearing:.4f}"])
    with pytest.raises(SystemExit) as ended:
        main(["track", "radar", str(folder / "plots.csv"), "--particles", "400", "--out", str(folder / "out"), *told])
    said = capsys.readouterr().out
    assert not ended.value.code, said
    assert re.search(r"and 2[0-9.]+ in\s+[│\s]*\d+ patches", said), said
    return said


@pytest.mark.thorough
@pytest.mark.parametrize(("where", "seed"), CASES)
def test_a_shower_or_surf_is_no_crowd_of_ships(tmp_path, capsys, where, seed):
    """Of 51 tracks of no ship, a recording, a twentieth is left at most."""
    tracked(tmp_path, capsys, recorded(where, seed))
    assert others(tmp_path / "out") <= 51 / 20


@pytest.mark.thorough
def test_nor_where_all_else_of_the_radar_is_told(tmp_path, capsys):
    """Of ships that are points: 83 to 94 tracks of no ship in each of three recordings, where it was not looked for."""
    told = {"range-sd-m": 10.0, "bearing-sd-mrad": 5.0, "detection-probability": 0.85, "false-alarms": ALARMS}
    options = [word for name, value in told.items() for word in (f"--{name}", str(value))]
    said = tracked(tmp_path, capsys, recorded(shower, 14), "--extent", "point", *options)
    assert "radar.alarms" not in said
    assert others(tmp_path / "out") == 0


@pytest.mark.thorough
def test_live_it_is_none_either(tmp_path):
    memory, parameters = Memory(), RadarTracking(particles=300, radar={"max_range_m": 6000.0})
    follow_radar(Coming(iter(recorded(shower, 1))), parameters, tmp_path, None, lambda step: None, memory=memory)
    assert others(tmp_path) == 0
    patches = memory.first.parameters.radar.false_alarm_patches
    error = 4 * np.sqrt(ALARMS / MEMORY)  # of what is remembered
    assert sum(number for *_, number in patches) == pytest.approx(ALARMS, abs=error + 1.0)


@pytest.mark.parametrize("told", [pytest.param((), marks=pytest.mark.thorough), ((2000.0, 4000.0, 120.0, 150.0, 3.0),)])
def test_what_is_told_stays(told):
    scans = recorded(shower, 2)[:4]
    parameters = RadarTracking(radar={"false_alarm_patches": told}, particles=100)
    found, _ = fitted(parameters, scans, survey(scans), Surroundings(None), None)
    assert found.radar.false_alarm_patches == told


def law_of(shares, rate):
    """Alarms a scan in the cells, of bands with these shares."""
    band = np.repeat(np.arange(BANDS), 2 ** np.arange(BANDS))
    each = np.array(shares)[band] / 2**band
    return rate * np.repeat(each[:, None], BEARINGS, axis=1) / BEARINGS


def test_the_law_and_a_patch_are_told_apart():
    rng, scans, shares, rate = np.random.default_rng(4), 60.0, np.array([0.3, 0.25, 0.2, 0.1, 0.1, 0.05]), 20.0
    law, more = law_of(shares, rate), np.zeros((RANGES, BEARINGS))
    more[30:36, 20:24] = 0.4
    counts = rng.poisson(scans * (law + more)).astype(float)
    found = laid(counts, np.ones(counts.shape, dtype=bool), scans, SEA, VIEW)
    assert found.false == pytest.approx(rate, abs=4 * np.sqrt(rate / scans) + 0.2)
    assert sum(patch[-1] for patch in found.patches) == pytest.approx(9.6, abs=4 * np.sqrt(9.6 / scans) + 0.2)
    there = np.zeros(more.shape, dtype=bool)
    middles = [(0.5 * (near + far), np.radians(0.5 * (first + last))) for near, far, first, last, _ in found.patches]
    distance, bearing = np.array(middles).T
    nothing = np.full(len(distance), np.nan)
    there[cell_of(RadarScan(0.0, nothing, distance, bearing, nothing), VIEW)] = True
    assert (there == (more > 0)).mean() > 0.999
    # where they do not last they are of the law
    assert laid(counts, more == 0, scans, SEA, VIEW).false == pytest.approx(29.6, abs=4 * np.sqrt(29.6 / scans) + 0.2)


def test_the_law_alone_has_hardly_a_patch():
    rng, scans, shares = np.random.default_rng(5), 60.0, np.array([0.4, 0.25, 0.15, 0.1, 0.06, 0.04])
    for rate in (1.0, 30.0):
        counts = rng.poisson(scans * law_of(shares, rate)).astype(float)
        found = laid(counts, np.ones(counts.shape, dtype=bool), scans, SEA, VIEW)
        assert sum(patch[-1] for patch in found.patches) < 0.05 * rate
    assert laid(np.zeros_like(counts), counts > 0, scans, SEA, VIEW).patches == ()


@pytest.mark.parametrize("fade", [1.0, 1 - 1 / MEMORY])
def test_what_passes_through_a_cell_or_rests_alone_is_no_patch(fade):
    rng, counted = np.random.default_rng(6), Lasting(fade)
    taken = []
    for k in range(60):
        came = np.zeros((RANGES, BEARINGS))
        came[1, 1] = rng.poisson(0.5)
        came[2, 2] = 4.0 * (20 <= k < 30) + (k == 50)  # a long ship, and an alarm
        came[3, 3] = k == 40
        came[4, 4] = 2 * (k % 30 == 5)
        came[9, 9] = rng.random() < 0.7  # a buoy
        counted.add(came)
        if came[3, 3]:
            taken.append((counted.scan, 3, 3))
    weights = fade ** np.arange(60)
    assert counted.scans == pytest.approx(weights.sum())
    assert counted.counts[3, 3] == pytest.approx(weights[19])
    counted.take_back(taken)
    assert counted.counts[3, 3] == pytest.approx(0.0, abs=1e-12)
    assert counted.lasting[1, 1]
    assert counted.lasting[4, 4]
    assert not counted.lasting[2, 2]
    assert not counted.lasting[3, 3]
    assert not counted.lasting[9, 9]
