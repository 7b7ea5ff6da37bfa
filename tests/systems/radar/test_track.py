"""From plots to tracks of ships: simulation against geometry, limits from the recording, what the verdict says."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
import xarray as xr
from scipy.stats import chi2

from elusive.charts import Coast, CoastPart
from elusive.charts.biased import CoastBias
from elusive.errors import DataError, ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import open_radar_plots, read_truth
from elusive.io.routes import Route
from elusive.results import STATUSES, read_tracks_csv
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.recorded import RecordedRadar
from elusive.systems.radar.run import track_radar_recording
from elusive.systems.radar.simulate import RadarSimulation, simulate_radar, voyage
from elusive.systems.radar.summary import bias_row, contradicts
from elusive.systems.radar.survey import survey
from elusive.systems.radar.track import track_radar
from tests.charts.scenes import cell_path
from tests.longer import longer

FRAME = LocalFrame.at(-76.44, 38.97)
RADAR = {"radar_lon_deg": -76.44, "radar_lat_deg": 38.97}
CORNERS = np.array([[1000.0, 2000.0], [1600.0, 2000.0], [1600.0, 1200.0]])


def route(corners, speeds=None):
    speed = np.full(len(corners), np.nan) if speeds is None else np.array(speeds, dtype=float)
    return Route(FRAME.to_lonlat(corners), speed)


def one_voyage(route, frame, parameters):
    times, (states,) = voyage([route], frame, parameters)
    return times, states


def test_ships_of_several_routes_are_seen_until_they_arrive(tmp_path):
    sure = RadarSimulation(speed_mps=10.0, radar=RadarSensor(range_sd_m=1.0, bearing_sd_mrad=0.1))
    routes = [route(CORNERS), route(CORNERS[:2] + 500.0)]
    times, states = voyage(routes, FRAME, sure)
    assert times[-1] == 140.0
    assert np.isfinite(states[0]).all()
    assert np.isfinite(states[1, :61]).all()
    assert np.isnan(states[1, 61:]).all()
    found = simulate_radar(routes, sure, tmp_path, **RADAR)
    assert found.rows[0] == ("Voyage", "140 s, 141 scans, 2 ships")
    truth = read_truth(tmp_path / "truth.csv", "m")
    assert {ship: len(table) for ship, table in zip(truth.names, truth.paths, strict=True)} == {"1": 141, "2": 61}
    np.testing.assert_allclose(truth.paths[1][:, 1:], states[1, :61][:, [0, 2]], atol=1e-6)
    scans = list(open_radar_plots(tmp_path / "plots.csv"))
    assert [len(scan.range_m) for scan in scans] == [2] * 61 + [1] * 80


def test_a_voyage_keeps_its_route_and_speed():
    times, states = one_voyage(route(CORNERS), FRAME, RadarSimulation(speed_mps=5.0, interval_s=0.7))
    assert times[-1] == pytest.approx(280.0, abs=0.7)
    along = [shapely.LineString(CORNERS).interpolate(5.0 * time_s) for time_s in times]
    np.testing.assert_allclose(states[:, [0, 2]], [(point.x, point.y) for point in along], atol=1e-4)
    np.testing.assert_allclose(np.hypot(states[:, 1], states[:, 3]), 5.0)
    times, states = one_voyage(route(CORNERS, [3.0, 8.0, np.nan]), FRAME, RadarSimulation(interval_s=10.0))
    assert times[-1] == 300.0  # 200 s and 100 s
    np.testing.assert_allclose(states[[0, 19, 20, 30], 1], [3.0, 3.0, 0.0, 0.0], atol=1e-6)


def test_simulated_plots_err_as_the_radar_does(tmp_path):
    out = tmp_path / "plots.csv"
    simulate_radar([route(CORNERS)], RadarSimulation(speed_mps=2.0, seed=4), tmp_path, **RADAR)
    (truth,) = read_truth(tmp_path / "truth.csv", "m").paths
    scans = list(open_radar_plots(out))
    assert len(scans) == len(truth) == 701
    (range_m, bearing_rad) = np.array([(scan.range_m[0], scan.bearing_rad[0]) for scan in scans]).T
    x, y = truth[:, 1:].T
    squares = ((range_m - np.hypot(x, y)) / 10) ** 2 + ((bearing_rad - np.arctan2(x, y)) / 1e-3) ** 2
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 2 * len(scans))
    assert low < squares.sum() < high


def test_a_route_on_land_or_out_of_view_is_said(tmp_path):
    sight = {"max_range_m": 2300.0}
    shape = shapely.box(1500, 1000, 2500, 2500)
    lonlat = FRAME.unproject(np.array([shape], dtype=object))[0]
    (tmp_path / "coast.geojson").write_text(shapely.to_geojson(lonlat))
    rows = dict(
        simulate_radar(
            [route(CORNERS)],
            RadarSimulation(radar=sight),
            tmp_path / "made",
            charts=[tmp_path / "coast.geojson"],
            **RADAR,
        ).rows
    )
    share = {name: float(text.split()[0]) for name, text in rows.items() if text.endswith("of the scans")}
    assert share["On charted land"] == pytest.approx(100 * 900 / 1400, abs=0.5)  # from x = 1500 m on
    assert share["Off the charts"] == pytest.approx(100 * 500 / 1400, abs=0.5)
    assert rows["In the radar's view"] == "not all the way"


def test_limits_are_those_of_the_recording_or_told():
    scans = [
        scan_of(0.0, [RadarPlot(0.0, 4000.0, 1.0, -20.0), RadarPlot(0.0, 100.0, 1.0)]),
        scan_of(1.0),
        scan_of(2.0, [RadarPlot(2.0, 3000.0, 2.0, 10.0)]),
    ]
    seen = survey(scans)
    assert seen[:4] == (3, 3, 4000.0, 20.0)
    sensor = RecordedRadar().bind(seen)
    assert (sensor.max_range_m, sensor.max_doppler_mps, sensor.false_alarms) == (4200.0, 30.0, 1.0)
    told = RecordedRadar(max_range_m=9000.0, max_doppler_mps=50.0, detection_probability=0.7).bind(seen)
    assert (told.max_range_m, told.max_doppler_mps, told.detection_probability) == (9000.0, 50.0, 0.7)
    empty = RecordedRadar(min_range_m=500.0, false_alarms=0.0).bind(survey([]))
    assert empty.max_range_m == 520.0


def test_chart_and_radar_contradict_where_plots_lie_on_land_and_never_by_chance():
    rng = np.random.default_rng(1)
    assert not contradicts(rng.random(20_000)).any()  # a ship on the coast itself
    inland = np.repeat([0.9, 0.01, math.nan, 0.01, 1.0], [30, 5, 7, 20, 30])
    np.testing.assert_array_equal(np.flatnonzero(contradicts(inland)), np.arange(30, 62))
    assert not contradicts(np.zeros(19)).any()  # too few to judge
    assert contradicts(np.zeros(20)).all()


def test_the_bias_is_said():
    assert bias_row(CoastBias(np.array([12.0, -3.0]), np.diag([4.0, 9.0]))) == (
        "Bias of the chart",
        "+12.0 ± 2.0 m east, -3.0 ± 3.0 m north",
    )


@pytest.mark.thorough
def test_a_real_chart_is_used_and_everything_is_written(tmp_path):
    """A ship 12 m off the shore of a real bay, its plots at 5 km."""
    corners = np.array([[-5090.0, 3160.0], [-4990.0, 3105.0], [-4900.0, 3056.0], [-4830.0, 3060.0]])
    simulate_radar([route(corners)], RadarSimulation(speed_mps=4.0, seed=1), tmp_path, **RADAR)
    source = open_radar_plots(tmp_path / "plots.csv")
    charts = [cell_path("US5MD1MC")]
    errors, files = {}, {}
    for kind in ("none", "field"):
        parameters = RadarTracking(
            knowledge={"kind": kind},
            charted={"imprecision": {"coast_sigma_m": 10}},
            radar={"detection_probability": 1, "false_alarms": 0},
            seed=2,
        )
        out = tmp_path / kind
        outcome = track_radar_recording(source, parameters, out, charts=charts if kind == "field" else (), **RADAR)
        files[kind] = sorted(path.name for path in out.iterdir())
        rows = read_tracks_csv(out / "tracks.csv").rows
        rows = rows[rows["status"] == STATUSES.index("confirmed")]
        assert [line[0] for line in outcome.tracked.tracks] == ["1"]
        truth = read_truth(tmp_path / "truth.csv", "m").at(rows["time_s"])[:, 0]
        errors[kind] = np.sqrt(np.mean(np.sum((rows["position"] - truth) ** 2, axis=1)))
        with xr.open_dataset(out / "result.nc", engine="h5netcdf") as dataset:
            sure = dataset.status == STATUSES.index("confirmed")
            np.testing.assert_allclose(dataset.x[sure], rows["position"][:, 0])
            np.testing.assert_allclose(dataset.time[sure], rows["time_s"])
            assert bool(dataset.allowed.isnull().all()) == (kind == "none")
            assert kind == "none" or float(dataset.allowed.min()) < 0.99
    assert files["none"] == files["field"]
    assert errors["field"] < 12
    assert errors["none"] < 15


@pytest.mark.parametrize("kind", longer(["none", "hard", "nearest", "grid", "exact", "field"], "grid"))
def test_every_knowledge_and_every_coast_error(kind):
    coast = Coast.of(CoastPart(shapely.box(1600, -9000, 9000, 9000), 20.0, None))
    times, states = one_voyage(route([[1560.0, 2000.0], [1560.0, 2140.0]]), FRAME, RadarSimulation())
    sensor = RadarSensor(detection_probability=0.9, false_alarms=2, max_range_m=5000, max_doppler_mps=30)
    rng = np.random.default_rng(3)
    looks = [sensor.simulate(state[None], rng, time_s=time) for state, time in zip(states, times, strict=True)]
    for error in ("fresh", "persistent", "bias") if kind in ("hard", "field") else ("persistent",):
        parameters = RadarTracking(knowledge={"kind": kind}, coast={"coast_error": error}, particles=800)
        *_, last = track_radar(looks, parameters.bind(sensor, coast), parameters)
        (ship,) = [one for one in last.tracks if one.status == "confirmed"]
        np.testing.assert_allclose(ship.mean[[0, 2]], states[-1, [0, 2]], atol=25)


def test_refusals(tmp_path):
    simulate_radar([route(CORNERS)], RadarSimulation(), tmp_path, **RADAR)
    source = open_radar_plots(tmp_path / "plots.csv")
    for told, name in (
        ({"knowledge": {"kind": "hard"}}, "knowledge"),
        ({"coast": {"coast_error": "bias"}}, "coast_error"),
        ({"charted": {"imprecision": {"coast_sigma_m": 5.0}}}, "coast_sigma_m"),
    ):
        with pytest.raises(ParameterError, match=f"{name}: says how a chart is used, and no chart is given"):
            track_radar_recording(source, RadarTracking(**told), tmp_path / "out", **RADAR)
    with pytest.raises(DataError, match="is no longitude and latitude"):
        track_radar_recording(
            source, RadarTracking(knowledge={"kind": "none"}), tmp_path / "out", radar_lon_deg=0, radar_lat_deg=95
        )
    parameters, sensor = RadarTracking(knowledge={"kind": "hard"}), RecordedRadar().bind(survey(source))
    with pytest.raises(ParameterError, match="knowledge: says how a chart is used, and no chart is given"):
        parameters.bind(sensor, None)
    assert not (tmp_path / "out").exists()
