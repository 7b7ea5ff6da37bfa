"""What a recording says of its radar, against the radar that made it."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.charts.charted_area import read_charts
from elusive.checks import broken
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import open_radar_plots, write_radar_plots_csv
from elusive.results import STATUSES
from elusive.sensors.radar import RadarSensor
from elusive.systems.radar.fit import bias_of, charted, fit_radar
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.run import track_radar_recording
from elusive.systems.radar.triples import Triples
from tests.charts.scenes import cell_path
from tests.longer import longer
from tests.systems.radar.test_headings import sailed as late_headings


def seen_by(sensor, rng, *, ships=5, scans=240, interval_s=2.5):
    """Ships that sail nearly straight, as the sensor sees them."""
    x, v, found = rng.uniform(-5000, 5000, (ships, 2)), rng.normal(0, 5, (ships, 2)), []
    for k in range(scans):
        v = v + rng.normal(0, 0.05 * interval_s**0.5, v.shape)
        x = x + v * interval_s
        found.append(sensor.simulate(np.column_stack([x[:, 0], v[:, 0], x[:, 1], v[:, 1]]), rng, k * interval_s))
    return found


def some_radar(rng, **fields):
    drawn = {
        "range_sd_m": np.exp(rng.uniform(np.log(3), np.log(35))),
        "bearing_sd_mrad": np.exp(rng.uniform(np.log(0.8), np.log(10))),
        "detection_probability": rng.uniform(0.65, 0.98),
        "false_alarms": rng.uniform(0.5, 12.0),
    }
    return RadarSensor(**(drawn | fields), max_range_m=8000.0, doppler_probability=0.0)


def fitted_as_told(seed):
    rng = np.random.default_rng([seed, 7])
    sensor = some_radar(rng)
    found = fit_radar(seen_by(sensor, rng), "x")
    radar = found.tree["radar"]
    assert radar["range_sd_m"] == pytest.approx(sensor.range_sd_m, rel=0.15)
    assert radar["bearing_sd_mrad"] == pytest.approx(sensor.bearing_sd_mrad, rel=0.15)
    assert radar["detection_probability"] == pytest.approx(sensor.detection_probability, abs=0.08)
    assert radar["false_alarms"] == pytest.approx(sensor.false_alarms, rel=0.15, abs=0.5)
    assert RadarTracking(**found.tree).radar.range_sd_m == radar["range_sd_m"]


@pytest.mark.thorough
@pytest.mark.parametrize("seed", longer(range(2), 1))
def test_errors_detection_and_false_alarms_are_those_of_the_radar(seed):
    fitted_as_told(seed)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(2, 20))
def test_so_they_are_in_twenty_settings(seed):
    fitted_as_told(seed)


def test_bearings_that_err_by_far_are_not_cut_off():
    """At 5 km plots err by more than ships sail: of those that are near each other bearings seem half as wrong."""
    rng = np.random.default_rng(11)
    sensor, triples = some_radar(rng, range_sd_m=12.0, bearing_sd_mrad=28.0), Triples()
    for scan in seen_by(sensor, rng, scans=150, interval_s=1.5):
        triples.add(scan)
    found = triples.fit()
    assert found is not None
    assert found.bearing_sd_rad == pytest.approx(0.028, rel=0.15)
    assert found.range_sd_m == pytest.approx(12, rel=0.2)


@pytest.mark.parametrize(("times", "turns"), [(1.0, 1.0), (3.0, 3.0), (1.0, 6.0)])
def test_plots_that_are_rounded_err_as_rounding_does(times, turns):
    """Their differences are alike again and again, as if they did not err at all."""
    rng = np.random.default_rng(3)
    sensor, triples = some_radar(rng, range_sd_m=12.0, bearing_sd_mrad=6.0), Triples()
    steps = 12.0 * times, 0.006 * turns
    for scan in seen_by(sensor, rng, scans=150):
        far, angle = (step * np.round(one / step) for step, one in zip(steps, scan[2:4], strict=True))
        triples.add(scan._replace(range_m=far, bearing_rad=angle))
    found = triples.fit()
    assert found is not None
    assert found.range_sd_m == pytest.approx(np.hypot(12.0, steps[0] / np.sqrt(12)), rel=0.2)
    assert found.bearing_sd_rad == pytest.approx(np.hypot(0.006, steps[1] / np.sqrt(12)), rel=0.2)


def test_places_that_are_rounded_err_as_rounding_does():
    """To 60 m, by a map whose axes turn as longitudes do; of a radar that errs by a tenth of that."""
    rng = np.random.default_rng(5)
    sensor, triples = some_radar(rng, range_sd_m=6.0, bearing_sd_mrad=1.0), Triples()
    for scan in seen_by(sensor, rng, scans=150):
        x, y = (60 * np.round(scan.range_m * axis(scan.bearing_rad) / 60) for axis in (np.sin, np.cos))
        x += 2e-7 * x * y
        triples.add(scan._replace(range_m=np.hypot(x, y), bearing_rad=np.arctan2(x, y)))
    found = triples.fit()
    assert found is not None
    assert found.range_sd_m == pytest.approx(np.hypot(6.0, 60 / np.sqrt(12)), rel=0.25)


def test_echoes_that_lie_about_ships_make_no_errors_of_the_radar():
    """Foam stays where ships were: triples of some of it lie about nothing, tens of metres wide."""
    rng = np.random.default_rng(4)
    sensor, triples = some_radar(rng, range_sd_m=3.0, bearing_sd_mrad=3.0), Triples()
    x, v, foam = rng.uniform(-3000, 3000, (4, 2)), rng.normal(0, 6, (4, 2)), np.zeros((0, 2))
    for k in range(90):
        x = x + 4 * v
        foam = np.concatenate([foam[rng.random(len(foam)) < 0.85], x[rng.random(4) < 0.5]])
        places = np.concatenate([x, foam[rng.random(len(foam)) < 0.7]])
        states = np.column_stack([places[:, 0], np.zeros(len(places)), places[:, 1], np.zeros(len(places))])
        triples.add(sensor.simulate(states, rng, 4.0 * k))
    found = triples.fit()
    assert found is not None
    assert found.range_sd_m < 2 * sensor.range_sd_m
    assert found.bearing_sd_rad < 2 * sensor.bearing_sd_rad


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(12))
def test_of_an_unknown_radar_each_ship_is_one_track(seed, tmp_path):
    """Nothing is told of it: with 10 m, 1 mrad, .9 and one false alarm there are 14 tracks of 5 ships.

    At crossings of two ships and at the view's edge a track may end: on the mean of the twelve 5.2 are measured.
    """
    rng = np.random.default_rng([seed, 77])
    sensor, ships = some_radar(rng), 5
    x, v, states = rng.uniform(-5000, 5000, (ships, 2)), rng.normal(0, 5, (ships, 2)), []
    for _ in range(120):
        v = v + rng.normal(0, 0.05 * 2.5**0.5, v.shape)
        x = x + v * 2.5
        states.append(np.column_stack([x[:, 0], v[:, 0], x[:, 1], v[:, 1]]))
    write_radar_plots_csv(tmp_path / "plots.csv", [sensor.simulate(s, rng, 2.5 * k) for k, s in enumerate(states)])
    source = open_radar_plots(tmp_path / "plots.csv")
    outcome = track_radar_recording(source, RadarTracking(), None)
    assert not broken(outcome.findings), outcome.findings
    rows = outcome.log.rows
    sure = rows[(rows["status"] == STATUSES.index("confirmed")) & (rows["time_s"] > 50)]
    assert len(set(sure["track"].tolist())) <= ships + 1
    found, beside = 0, 0
    for k, state in enumerate(states[21:], 21):
        far = np.hypot(state[:, 0], state[:, 2])
        near = 4 * np.hypot(sensor.range_sd_m, sensor.bearing_sd_rad * far)
        off = np.linalg.norm(sure["position"][sure["time_s"] == 2.5 * k][:, None] - state[:, [0, 2]], axis=2) < near
        found += (off.any(axis=0) | (far > sensor.max_range_m)).sum()
        beside += (~off.any(axis=1)).sum()
    assert found >= 0.97 * ships * 99
    assert beside <= 0.01 * ships * 99


@pytest.mark.parametrize("seed", range(20))
def test_biases_lie_within_three_of_their_errors(seed):
    """A dozen charted rocks, each charted 4 m off on an axis, beside false alarms and ships."""
    rng = np.random.default_rng([seed, 8])
    sensor = some_radar(rng, range_sd_m=12.0, bearing_sd_mrad=2.0)
    far, angle = rng.uniform(800, 6000, 12), rng.uniform(0, 2 * np.pi, 12)
    rocks = np.column_stack([far * np.sin(angle), far * np.cos(angle)])
    bias_m, bias_rad = rng.uniform(-80, 80), rng.uniform(-0.02, 0.02)
    at = far + bias_m, angle + bias_rad
    echoes = np.column_stack([at[0] * np.sin(at[1]), np.zeros(12), at[0] * np.cos(at[1]), np.zeros(12)])
    scans = [sensor.simulate(echoes, rng, 2.5 * k) for k in range(20)]
    found = bias_of(scans, rocks + rng.normal(0, 4, rocks.shape), 12.0, 0.002)
    assert found.places == 12
    assert abs(found.range_m - bias_m) < 3 * found.range_se_m
    assert abs(found.bearing_rad - bias_rad) < 3 * found.bearing_se_rad
    assert found.range_se_m < 5
    assert found.bearing_se_rad < 0.003


def test_plots_that_do_not_follow_each_other_are_no_fit():
    rng = np.random.default_rng(1)
    alarms = [some_radar(rng, false_alarms=2.0).simulate(np.zeros((0, 4)), rng, 2.5 * k) for k in range(50)]
    with pytest.raises(DataError, match="too few plots follow each other"):
        fit_radar(alarms, "x")


def findings(seed, tmp_path):
    """Of a right recording: told as it was made."""
    rng = np.random.default_rng([seed, 9])
    sensor = some_radar(rng)
    write_radar_plots_csv(tmp_path / "p.csv", seen_by(sensor, rng, ships=int(rng.integers(1, 6)), scans=60))
    names = "range_sd_m", "bearing_sd_mrad", "detection_probability", "false_alarms"
    told = RadarTracking(knowledge={"kind": "none"}, radar={name: getattr(sensor, name) for name in names})
    source = open_radar_plots(tmp_path / "p.csv")
    return broken(track_radar_recording(source, told, None, radar_lon_deg=4.0, radar_lat_deg=52.0).findings)


@pytest.mark.parametrize("seed", [pytest.param(k, marks=pytest.mark.thorough if k else ()) for k in range(20)])
def test_a_right_recording_has_no_finding(seed, tmp_path):
    assert findings(seed, tmp_path) == ()


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [0, 1])
def test_a_biased_radar_is_fitted_by_the_marks_of_a_real_chart(seed):
    """Beacons, landmarks and rocks of a cell, each charted 10 m off on an axis, and three ships."""
    frame = LocalFrame.about(read_charts(cell_path("US5AK5SI")))
    known, water = charted([cell_path("US5AK5SI")], frame)
    rng = np.random.default_rng(seed)
    there = known + rng.normal(0, 10, known.shape)
    fixed = np.column_stack([there[:, 0], 0 * there[:, 0], there[:, 1], 0 * there[:, 0]])
    far = 1.1 * float(np.hypot(*there.T).max())
    sensor = RadarSensor(
        bearing_sd_mrad=3.0, detection_probability=0.9, false_alarms=3.0, max_range_m=far, doppler_probability=0.0
    )
    scans = []
    for time_s in 2.5 * np.arange(60):
        ways = ((-3000, 6, 1000, 2), (2000, -5, -2000, 1), (500, 0, 4000, -4))
        ships = np.array([[x + time_s * vx, vx, y + time_s * vy, vy] for x, vx, y, vy in ways], dtype=float)
        looked = sensor.simulate(np.concatenate([ships, fixed]), rng, float(time_s))
        off = looked._replace(range_m=looked.range_m + 25.0, bearing_rad=(looked.bearing_rad + 0.008) % (2 * np.pi))
        scans.append(off)
    found = {value.what: value for value in fit_radar(scans, "plots", known, water).values}
    assert float(found["deviation of a range [m]"].value) == pytest.approx(10.0, rel=0.25)
    assert float(found["deviation of a bearing [mrad]"].value) == pytest.approx(3.0, rel=0.25)
    for name, truth in (("bias of ranges [m]", 25.0), ("bias of bearings [mrad]", 8.0)):
        assert abs(float(found[name].value) - truth) < 3 * found[name].deviation


def test_late_headings_are_put_right_before_a_radar_is_fitted():
    """Two seconds late, ships are lost at each turn, and seen in three of five scans."""
    fitted = {value.what: value for value in fit_radar(late_headings(2.0, ships=3, alarms=0)[:40], "late").values}
    assert float(fitted["delay of headings [s]"].value) == pytest.approx(2.0, abs=0.4)
    assert float(fitted["probability of detection"].value) == pytest.approx(0.9, abs=0.06)
