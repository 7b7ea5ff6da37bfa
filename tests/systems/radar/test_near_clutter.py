"""Sea clutter that is densest about the radar: where false alarms are is learnt, and no ship is made of them."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from elusive.cli import main
from elusive.results import read_tracks_csv
from elusive.sensors import RadarSensor
from elusive.sensors.range_bands import BANDS, edges, shares_of, uniform
from elusive.systems.radar.fit import fit_radar
from elusive.systems.radar.parameters import RadarTracking

SCANS, INTERVAL_S, ALARMS, DECAY_M = 36, 2.5, 20.0, 900.0
SHIPS = np.array([(900.0, 6.0, 500.0, -4.0), (-2500.0, 8.0, 1500.0, 5.0)])
SENSOR = RadarSensor(
    bearing_sd_mrad=5.0, detection_probability=0.85, max_range_m=6000.0, doppler_probability=0.0
)  # without false alarms


def recorded(seed):
    """Two ships among false alarms of exponential ranges, uniform in bearing."""
    rng, scans = np.random.default_rng([seed, 31]), []
    for k in range(SCANS):
        states = SHIPS.copy()
        states[:, [0, 2]] += states[:, [1, 3]] * k * INTERVAL_S
        ships = SENSOR.simulate(states, rng, k * INTERVAL_S)
        ranges = rng.exponential(DECAY_M, rng.poisson(ALARMS))
        ranges = np.append(ranges[ranges < SENSOR.max_range_m], ships.range_m)
        bearings = np.append(rng.uniform(0, 2 * np.pi, len(ranges) - len(ships.range_m)), ships.bearing_rad)
        order = np.argsort(bearings)
        nothing = np.full(len(order), np.nan)
        times = np.full(len(order), ships.time_s)
        scans.append(
            ships._replace(times_s=times, range_m=ranges[order], bearing_rad=bearings[order], doppler_mps=nothing)
        )
    return scans


def test_each_ship_is_one_track_and_no_other_is_there(tmp_path, capsys):
    with (tmp_path / "plots.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time_s", "range_m", "bearing_deg"])
        for scan in recorded(1):
            for distance, bearing in zip(scan.range_m, np.degrees(scan.bearing_rad), strict=True):
                rows.writerow([scan.time_s, f"{distance:.2f}", f"{bearing:.4f}"])
    with pytest.raises(SystemExit) as ended:
        main(["track", "radar", str(tmp_path / "plots.csv"), "--particles", "500", "--out", str(tmp_path / "out")])
    assert not ended.value.code, capsys.readouterr()
    assert all(row["holds"] for row in json.loads((tmp_path / "out" / "checks.json").read_text()))
    assert len(read_tracks_csv(tmp_path / "out" / "tracks.csv").confirmed()) == len(SHIPS)


def test_a_fit_says_where_they_are():
    tree = fit_radar(recorded(2), "x").tree
    assert RadarTracking(**tree).radar.false_alarm_shares == tuple(tree["radar"]["false_alarm_shares"])
    limits = edges(0.0, SENSOR.max_range_m, BANDS)
    expected = -np.diff(np.exp(-limits / DECAY_M))
    error = np.sqrt(expected * (1 - expected) / (SCANS * ALARMS))
    # the view reaches 5 % beyond the furthest plot, and the uniform prior counts as 200 plots of 900
    assert np.abs(np.array(tree["radar"]["false_alarm_shares"]) - expected).max() < 4 * error.max() + 0.1


@pytest.mark.parametrize("seen", [1.0, 0.25])
def test_a_handful_of_plots_leaves_the_shares_uniform(seen):
    counts, shown = np.zeros(BANDS), np.ones(BANDS)
    counts[0], shown[-1] = 2.0, seen
    assert np.array(shares_of(np.zeros(BANDS), shown)) == pytest.approx(np.array(uniform(BANDS)))
    assert 0.5 * np.abs(np.subtract(shares_of(counts, shown), uniform(BANDS))).sum() < 0.02
    many = 1e6 * np.array(uniform(BANDS)) * shown
    assert np.array(shares_of(many, shown)) == pytest.approx(np.array(uniform(BANDS)))
