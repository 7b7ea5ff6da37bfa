"""Sea clutter that is densest about the radar: where false alarms are is learnt, and no ship is made of them."""

from __future__ import annotations

import csv
import json
import math
import pickle

import numpy as np
import pytest
import shapely
from scipy.stats import vonmises

from elusive.charts import Coast, CoastPart, HardWater
from elusive.cli import main
from elusive.results import read_tracks_csv
from elusive.sensors import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.range_bands import BANDS, SECTORS, SURE, edges, shares_of, uniform
from elusive.systems.radar.first_pass import fitted
from elusive.systems.radar.fit import fit_radar
from elusive.systems.radar.learnt import LOOK, MEMORY
from elusive.systems.radar.live import follow_radar
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.recorded import ROOM
from elusive.systems.radar.ships import Surroundings
from elusive.systems.radar.survey import survey
from elusive.tracking.memory import Memory
from tests.systems.test_flat import Coming

SCANS, INTERVAL_S, ALARMS, DECAY_M = 36, 2.5, 20.0, 900.0
SHIPS = np.array([(900.0, 6.0, 500.0, -4.0), (-2500.0, 8.0, 1500.0, 5.0)])
SENSOR = RadarSensor(
    bearing_sd_mrad=5.0, detection_probability=0.85, max_range_m=6000.0, doppler_probability=0.0
)  # without false alarms


def recorded(seed, upwind=0.0):
    """Two ships among false alarms of exponential ranges; their bearings are von Mises, ``upwind`` 0: uniform."""
    rng, scans = np.random.default_rng([seed, 31]), []
    for k in range(SCANS):
        states = SHIPS.copy()
        states[:, [0, 2]] += states[:, [1, 3]] * k * INTERVAL_S
        ships = SENSOR.simulate(states, rng, k * INTERVAL_S)
        ranges = rng.exponential(DECAY_M, rng.poisson(ALARMS))
        ranges = np.append(ranges[ranges < SENSOR.max_range_m], ships.range_m)
        bearings = np.append(
            rng.vonmises(2.0, upwind, len(ranges) - len(ships.range_m)) % (2 * np.pi), ships.bearing_rad
        )
        order = np.argsort(bearings)
        nothing = np.full(len(order), np.nan)
        times = np.full(len(order), ships.time_s)
        scans.append(
            ships._replace(times_s=times, range_m=ranges[order], bearing_rad=bearings[order], doppler_mps=nothing)
        )
    return scans


def expected_shares(reach_m, scans=SCANS, fade=1.0):
    """The posterior mean in view to a range, of all that came about: the law's shares beside the uniform prior.

    Returned with standard errors; each scan counts ``fade`` of the next.
    """
    weights = fade ** np.arange(scans)
    limits, number = edges(0.0, reach_m, BANDS), weights.sum() * ALARMS
    law = -np.diff(np.exp(-limits / DECAY_M))
    error = np.sqrt(law * (1 - law) * ALARMS * (weights**2).sum())
    return (number * law + SURE * np.array(uniform(BANDS))) / (number + SURE), error / (number + SURE)


def followed(folder, scans, **told):
    """What a live run knows of its radar at its end, and the findings."""
    memory = Memory()
    parameters = RadarTracking(particles=300, radar={"max_range_m": SENSOR.max_range_m, **told})
    follow_radar(Coming(iter(scans)), parameters, folder, None, lambda step: None, memory=memory)
    findings = json.loads((folder / "checks.json").read_text())
    assert pickle.loads(pickle.dumps(memory.kept))[1].parameters == memory.first.parameters  # a checkpoint holds it
    return memory.first.parameters.radar, {row["name"] for row in findings if not row["holds"]}


def written(folder, scans):
    with (folder / "plots.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time_s", "range_m", "bearing_deg"])
        for scan in scans:
            for distance, bearing in zip(scan.range_m, np.degrees(scan.bearing_rad), strict=True):
                rows.writerow([scan.time_s, f"{distance:.2f}", f"{bearing:.4f}"])
    return str(folder / "plots.csv")


def test_each_ship_is_one_track_and_no_other_is_there(tmp_path, capsys):
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as ended:
        main(["track", "radar", written(tmp_path, recorded(1)), "--particles", "500", "--out", str(out)])
    assert not ended.value.code, capsys.readouterr()
    assert all(row["holds"] for row in json.loads((out / "checks.json").read_text()))
    check_tracks(out)


def check_tracks(folder):
    tracks = read_tracks_csv(folder / "tracks.csv").confirmed()
    assert len(tracks) == len(SHIPS)
    ends = np.array([rows["position"][-1] for rows in tracks.values()])
    truth = SHIPS[:, [0, 2]] + SHIPS[:, [1, 3]] * (SCANS - 1) * INTERVAL_S
    assert np.hypot(*(ends[:, None] - truth).T).min(axis=1).max() < 60.0  # a plot errs by 15 m at 3 km


def test_a_live_run_learns_what_it_is_not_told(tmp_path):
    scans = recorded(4)
    radar, findings = followed(tmp_path, scans)
    assert not findings
    check_tracks(tmp_path)
    taken_over = SCANS // LOOK * LOOK
    mean, error = expected_shares(SENSOR.max_range_m, taken_over, 1 - 1 / MEMORY)
    assert (np.abs(np.array(radar.false_alarm_shares) - mean) < 4 * error + 8 / (taken_over * ALARMS + SURE)).all()
    weights = (1 - 1 / MEMORY) ** np.arange(taken_over)
    error = math.sqrt(ALARMS * (weights**2).sum()) / weights.sum()
    assert radar.false_alarms == pytest.approx(ALARMS, abs=4 * error + 8 / weights.sum())
    # errors are fitted to twenty scans; triples of two ships share plots: 3 / (2 n) is a deviation's variance
    triples = 2 * 2 * LOOK * SENSOR.detection_probability**3
    assert radar.bearing_sd_mrad == pytest.approx(SENSOR.bearing_sd_mrad, rel=4 * math.sqrt(1.5 / triples))


def test_clutter_upwind_is_no_hull_and_no_ship(tmp_path):
    radar, findings = followed(tmp_path, recorded(23, upwind=1.0), detection_probability=0.85)
    assert not findings
    check_tracks(tmp_path)
    limits = np.linspace(0, 2 * np.pi, SECTORS + 1)
    law = np.diff(vonmises.cdf(limits, 1.0, loc=2.0))
    weights = (1 - 1 / MEMORY) ** np.arange(SCANS // LOOK * LOOK)
    number = ALARMS * weights.sum()
    error = np.sqrt(law * (1 - law) * ALARMS * (weights**2).sum()) / (number + SURE)
    mean = (number * law + SURE / SECTORS) / (number + SURE)
    assert (np.abs(np.array(radar.false_alarm_sectors) - mean) < 4 * error + 8 / (number + SURE)).all()


@pytest.mark.thorough
def test_a_live_run_that_is_told_everything_stays_with_it(tmp_path):
    told = {"range_sd_m": 10.0, "bearing_sd_mrad": 5.0, "detection_probability": 0.85, "false_alarms": 1.0}
    radar, findings = followed(tmp_path, recorded(4)[:20], **told)
    assert {name: getattr(radar, name) for name in told} == told
    assert "radar.alarms" in findings


@pytest.mark.thorough
def test_where_they_are_is_found_though_all_else_is_told(tmp_path):
    told = {"range_sd_m": 10.0, "bearing_sd_mrad": 5.0, "detection_probability": 0.85, "false_alarms": ALARMS}
    _, findings = followed(tmp_path / "live", recorded(9), **told)
    assert not findings
    check_tracks(tmp_path / "live")
    parameters = RadarTracking(particles=300, radar={"max_range_m": SENSOR.max_range_m, **told})
    scans = recorded(10)
    found, seen = fitted(parameters, scans, survey(scans), Surroundings(None), None)
    assert not (*seen.found, *seen.assumed)
    assert {name: getattr(found.radar, name) for name in told} == told
    mean, error = expected_shares(SENSOR.max_range_m)
    assert (np.abs(np.array(found.radar.false_alarm_shares) - mean) < 4 * error + 8 / (SCANS * ALARMS + SURE)).all()


@pytest.mark.thorough
def test_a_sea_that_rises_is_known_after_a_few_scans(tmp_path):
    rough = recorded(5)
    calm = [scan.select_detections(np.flatnonzero(scan.range_m > 2 * DECAY_M)) for scan in rough[:24]]
    before, _ = followed(tmp_path / "calm", calm)
    after, _ = followed(tmp_path / "rough", [*calm, *rough[24:28]])
    assert before.false_alarms < ALARMS / 4  # e^-2 of them
    assert after.false_alarms > ALARMS / 2


@pytest.mark.parametrize("told", [pytest.param((1.0,), marks=pytest.mark.thorough), (2.0, 1.0)])
def test_what_is_told_stays(tmp_path, told):
    scans = recorded(1)[:12]
    parameters = RadarTracking(radar={"false_alarm_shares": told}, particles=100)
    found, _ = fitted(parameters, scans, survey(scans), Surroundings(None), None)
    assert found.radar.false_alarm_shares == told
    assert found.radar.false_alarms is not None


@pytest.mark.thorough
def test_a_fit_says_where_they_are():
    scans = recorded(2)
    radar = RadarTracking(**fit_radar(scans, "x").tree).radar
    mean, error = expected_shares(ROOM * max(scan.range_m.max() for scan in scans))
    # of two ships' 60 plots a scan or two is not known to be theirs before they are confirmed
    assert (np.abs(np.array(radar.false_alarm_shares) - mean) < 4 * error + 8 / (SCANS * ALARMS + SURE)).all()
    assert radar.false_alarms == pytest.approx(ALARMS, abs=4 * math.sqrt(ALARMS / SCANS) + 8 / SCANS)


@pytest.mark.thorough
def test_land_far_away_does_not_make_more_of_what_is_near():
    """Land lies beyond 3 km, with three echoes a scan, where hardly an alarm would be; half of the view is it."""
    rng, scans = np.random.default_rng(9), []
    for scan in recorded(3):
        sea = scan.select_detections(np.flatnonzero(scan.range_m < 3000.0))
        ranges = np.append(sea.range_m, rng.uniform(3200.0, 6000.0, 3))
        bearings = np.append(sea.bearing_rad, rng.uniform(0, 2 * np.pi, 3))
        full = (np.full(len(ranges), scan.time_s), ranges, bearings, np.full(len(ranges), np.nan))
        scans.append(RadarScan(scan.time_s, *(part[np.argsort(bearings)] for part in full)))
    land = shapely.box(-9000, -9000, 9000, 9000) - shapely.Point(0, 0).buffer(3000)
    water = HardWater().bind(Coast.of(CoastPart(land, 10.0)))
    found = fit_radar(scans, "x", water=water).tree["radar"]["false_alarms"]
    # the prior, of which half is on land, counts as 200 plots of some 900 there
    assert ALARMS - 4 * math.sqrt(ALARMS / SCANS) < found < ALARMS * (1 + SURE / (SCANS * ALARMS)) + 2


@pytest.mark.parametrize("seen", [1.0, 0.25])
def test_a_handful_of_plots_leaves_the_shares_uniform(seen):
    counts, shown = np.zeros((BANDS, SECTORS)), np.ones((BANDS, SECTORS))
    counts[0, 3], shown[-1] = 2.0, seen
    even = np.array(uniform(BANDS)), np.full(SECTORS, 1 / SECTORS)
    for found, one in zip(shares_of(np.zeros_like(counts), shown), even, strict=True):
        assert found == pytest.approx(one)
    for found, one in zip(shares_of(counts, shown), even, strict=True):
        assert 0.5 * np.abs(found - one).sum() < 0.02
    for found, one in zip(shares_of(1e6 * np.outer(*even) * shown, shown), even, strict=True):
        assert found == pytest.approx(one)


def test_shares_are_those_of_the_sea_beside_land():
    """Land hides more of one sector the farther it is: counts of each alone would make its nearest bands too dense."""
    rng = np.random.default_rng(3)
    bands, sectors = rng.dirichlet(np.full(BANDS, 4.0)), rng.dirichlet(np.full(SECTORS, 4.0))
    sea = np.ones((BANDS, SECTORS))
    sea[:, 2] = np.linspace(1.0, 0.1, BANDS)
    found = shares_of(1e8 * np.outer(bands, sectors) * sea, sea)
    assert found[0] == pytest.approx(bands, rel=1e-3)
    assert found[1] == pytest.approx(sectors, rel=1e-3)
