"""A ship's true places, from tables and from AIS, beside the track that a radar makes of it."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest
from pyais import encode_dict

from elusive import run
from elusive.contracts import X, Y
from elusive.errors import DataError
from elusive.filters.particle.sir import ParticleFilter
from elusive.geometry.local_frame import LocalFrame
from elusive.io import Truth
from elusive.io.ship_truth import read_ship_truth
from elusive.motion import ConstantVelocity
from elusive.sensors.radar import RadarSensor
from elusive.sensors.scan_prior import ScanPrior

FRAME = LocalFrame.at(-76.46, 38.96)
MIDNIGHT = datetime(2026, 3, 1, tzinfo=UTC).timestamp()
SHIP, OTHER = 244660000, 366123456


def saved(folder, text, name="truth.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def ships(path, **more):
    found = read_ship_truth(path, FRAME, **more)
    return dict(zip(found.names, found.paths, strict=True))


def ais_line(unix_s, lonlat, mmsi=SHIP):
    data = {"type": 1, "mmsi": mmsi, "lon": lonlat[0], "lat": lonlat[1], "speed": 8.0, "course": 40.0}
    return f"{unix_s:.0f} " + encode_dict(data, talker_id="AI", sentence_type="VDM", radio_channel="A")[0]


def ais_log(folder, times_s, places, mmsi=SHIP, others=()):
    lonlat = FRAME.to_lonlat(places)
    lines = [ais_line(MIDNIGHT + time, place, mmsi) for time, place in zip(times_s, lonlat, strict=True)]
    return saved(folder, "\n".join([*lines, *others]), "log.nmea")


def path_of(times_s):
    """A ship that turns slowly, 3 km north of the radar."""
    angle = 0.7 + 0.004 * (times_s - times_s[0])
    return np.column_stack([1000.0 * np.sin(angle), 4000.0 - 1000.0 * np.cos(angle)])


@pytest.mark.parametrize(
    "text",
    [
        "time_s,x_m,y_m\n1,10,20\n2.5,-11,2e1\n",
        "\ufefftime_s;status;x_m;y_m\n# a remark\n1;moored;10;20\n\n2.5;;-11;20",
        '"time_s"\ty_m\tx_m\r\n1\t20\t10\r\n2.5\t20\t-11\r\n',
    ],
)
def test_tables_in_metres(tmp_path, text):
    np.testing.assert_array_equal(read_ship_truth(saved(tmp_path, text), FRAME).paths[0], [[1, 10, 20], [2.5, -11, 20]])


def test_tables_in_degrees(tmp_path):
    places = np.array([[-500.0, 2500.0], [12.0, -8000.0]])
    rows = [f"{k},{lon!r},{lat!r},x" for k, (lon, lat) in enumerate(FRAME.to_lonlat(places).tolist())]
    found = read_ship_truth(saved(tmp_path, "\n".join(["time_s,lon_deg,lat_deg,name", *rows])), FRAME).paths[0]
    np.testing.assert_allclose(found, np.column_stack([[0, 1], places]), atol=1e-6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,x_m\n1,2\n", "the columns are 'time_s,x_m'; name them time_s,x_m,y_m"),
        ("time_s,x_m,y_m,x_m\n1,2,3,4\n", "the columns are"),
        ("time_s,x_m,y_m\n", "holds no place; write time_s,x_m,y_m"),
        ("time_s,x_m,y_m\n1,2\n", "line 2: has 2 cells for 3 columns"),
        ("time_s,x_m,y_m\n1,2,north\n", "line 2, column y_m: 'north' is no number"),
        ("time_s,x_m,y_m\n1,2,nan\n", "line 2, column y_m: 'nan' is no number"),
        ("time_s,x_m,y_m\n1,2,3\n\n0.5,2,3\n", "line 4: 0.5 s comes after 1 s"),
        ("time_s,x_m,y_m\n1,2,3\n1,2,3\n", "line 3: target 1 is there twice at 1 s"),
        ("time_s,lon_deg,lat_deg\n1,5,95\n", r"1 s: \(5, 95\) is no longitude and latitude"),
        (b"time_s,x_m,y_m\n1,2,\xff\n", "is not text in UTF-8"),
        ("1,2,3\n4,5,6\n", "holds no AIS position"),
        ("", "holds no AIS position"),
    ],
)
def test_what_is_no_truth_is_refused(tmp_path, text, message):
    with pytest.raises(DataError, match=rf"truth\.csv.*{message}"):
        read_ship_truth(saved(tmp_path, text), FRAME)


def test_what_does_not_fit_is_refused(tmp_path):
    with pytest.raises(DataError, match=r"none\.csv: cannot be read \(No such file"):
        read_ship_truth(tmp_path / "none.csv", FRAME)
    with pytest.raises(DataError, match="mmsi=5 chooses in an AIS log; leave it out"):
        read_ship_truth(saved(tmp_path, "time_s,x_m,y_m\n1,2,3\n"), FRAME, mmsi=5)
    other = ais_line(MIDNIGHT, (5.0, 53.0), OTHER)
    log = ais_log(tmp_path, [0.0, 1.0], np.zeros((2, 2)), others=[other])
    assert {ship: len(table) for ship, table in ships(log).items()} == {str(SHIP): 2, str(OTHER): 1}
    assert list(ships(log, mmsi=OTHER)) == [str(OTHER)]
    with pytest.raises(DataError, match="no AIS position of 7"):
        read_ship_truth(log, FRAME, mmsi=7)


def test_several_ships_in_a_table(tmp_path):
    text = "time_s,ship,x_m,y_m\n1,a,1,2\n1,b,3,4\n2,a,5,6\n"
    found = ships(saved(tmp_path, text))
    assert {ship: table.tolist() for ship, table in found.items()} == {"a": [[1, 1, 2], [2, 5, 6]], "b": [[1, 3, 4]]}


def test_times_of_a_log(tmp_path):
    times = np.array([5.0, 15.0, 15.0, 25.0])
    places = path_of(times)
    later = [ais_line(MIDNIGHT + 20, FRAME.to_lonlat(path_of(np.array([20.0])))[0])]  # relayed late
    log = ais_log(tmp_path, times, places, others=later)
    found = ships(log)[str(SHIP)]
    assert found[:, 0].tolist() == [5, 15, 20, 25]
    assert ships(log, midnight_unix_s=0.0)[str(SHIP)][:, 0].tolist() == [MIDNIGHT + t for t in (5, 15, 20, 25)]
    assert ships(log, midnight_unix_s=MIDNIGHT - 3600)[str(SHIP)][0, 0] == 3605
    # a position is told to 1e-4 minutes, .19 m
    np.testing.assert_allclose(found[[0, 1, 3], 1:], places[[0, 1, 3]], atol=0.14)


def test_between_reports():
    truth = np.array([[0.0, 0.0, 0.0], [10.0, 100.0, -50.0], [400.0, 0.0, 0.0], [410.0, 10.0, 10.0]])
    times = np.array([-1.0, 0.0, 2.5, 10.0, 11.0, 399.0, 400.0, 405.0, 410.0, 411.0])
    nan = [np.nan, np.nan]
    expected = [nan, [0, 0], [25, -12.5], [100, -50], nan, nan, [0, 0], [5, 5], [10, 10], nan]
    ship = Truth(("1",), (truth,), longest_gap_s=200.0)
    np.testing.assert_allclose(ship.at(times)[:, 0], expected)
    longer = ship._replace(longest_gap_s=500.0)
    np.testing.assert_allclose(longer.at(times[4:6])[:, 0, 0], [100 * 389 / 390, 100 / 390])
    np.testing.assert_allclose(Truth(("1",), (truth[:1],)).at([0.0, 1.0])[:, 0], [[0, 0], nan])


def test_a_radar_track_beside_ais(tmp_path):
    """Radar plots each 2.5 s, the ship's own positions each 10 s: paired in time and in one frame."""
    times = 36_000.0 + 2.5 * np.arange(121)
    places = path_of(times)
    velocity = np.gradient(places, times, axis=0)
    states = np.column_stack([places, velocity])[:, [0, 2, 1, 3]]
    log = ais_log(tmp_path, times[::4], places[::4])
    truth = read_ship_truth(log, FRAME).at(times)[:, 0]
    np.testing.assert_allclose(truth, places, atol=0.3)  # straight between reports: 4^2 x 10^2 / 8000 m beside the arc
    sensor, rng = RadarSensor(), np.random.default_rng(0)
    scans = [sensor.simulate(state[None], rng, time) for state, time in zip(states, times, strict=True)]
    tracker = ParticleFilter(motion=ConstantVelocity(q=0.02), sensor=sensor, prior=ScanPrior(sensor, scans[0]))
    tracked = list(run(tracker, scans[1:], rng, start_s=times[0]))
    mean = np.array([state.mean[[X, Y]] for state in tracked])
    covariance = np.array([state.covariance[np.ix_([X, Y], [X, Y])] for state in tracked])

    def squared(true):
        off = (mean - true)[20:]
        return (off * np.linalg.solve(covariance[20:], off[:, :, None])[:, :, 0]).sum(axis=1).mean()

    assert 0.7 < squared(truth[1:]) < 3.5  # 2 where all is right; errors persist, so that 100 are worth about 20
    late = read_ship_truth(log, FRAME, midnight_unix_s=MIDNIGHT + 10).at(times)[:, 0]
    assert np.nanmean(np.hypot(*(late - truth).T)) == pytest.approx(40, abs=1)
    assert squared(places[1:] + 8.0) > 6
