"""AIS beside a radar's plots: what is right names tracks, what is wrong is named and moves none."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from pyais import encode_dict

from elusive.contracts import Array
from elusive.io import write_radar_plots_csv
from elusive.results import STATUSES, read_tracks_csv
from elusive.sensors.radar import RadarSensor
from tests.cli.test_radar import FRAME, RADAR, Run
from tests.cli.test_radar_checks import failing
from tests.cli.test_radar_live import EVEN

SENSOR = RadarSensor(
    detection_probability=0.9, false_alarms=2.0, max_range_m=6000.0, doppler_probability=0.0, bearing_sd_mrad=2.0
)
WAYS = [((-2500.0, -1000.0), (4.0, 3.0)), ((-500.0, 2500.0), (6.0, -2.0)), ((1500.0, -2000.0), (-3.0, 5.0)),
        ((3000.0, 3000.0), (-5.0, -2.0)), ((9000.0, 1000.0), (5.0, 1.0))]  # fmt: skip
SEEN = ["--range-sd-m", "10", "--bearing-sd-mrad", "2", "--detection-probability", "0.9", "--false-alarms", "2"]
SEEN += ["--max-range-m", "6000", "--particles", "1000"]
TRACK = ["track", "radar", "plots.csv", *RADAR, *SEEN, "--knowledge", "none", "--out", "out"]
HEAD = "time_s,mmsi,lon_deg,lat_deg,sog_mps,cog_deg"
FIRST_S = datetime(2026, 5, 1, 12, tzinfo=UTC).timestamp()


def plots(folder: Path) -> None:
    """Four ships in view, the fifth beyond it, for two minutes."""
    rng, scans = np.random.default_rng(1), []
    for k in range(48):
        states = np.array([[x + 2.5 * k * vx, vx, y + 2.5 * k * vy, vy] for (x, y), (vx, vy) in WAYS])
        scans.append(SENSOR.simulate(states, rng, 2.5 * k))
    write_radar_plots_csv(folder / "plots.csv", scans)


def reports(*, off_m: float = 0.0, late_s: float = 0.0, faster: float = 1.0) -> list[tuple[float, ...]]:
    """What all five tell: the second beside its place, the third late, the fourth too fast."""
    rng, rows = np.random.default_rng(2), []
    for time_s in np.arange(1.3, 120.0, 6.0):
        for ship, (place, velocity) in enumerate(WAYS):
            late, beside = late_s * (ship == 2), off_m * (ship == 1)
            told = np.array(place) + np.array(velocity) * (time_s - late) + [beside, 0.0] + rng.normal(0, 5, 2)
            lon, lat = FRAME.to_lonlat(told[None])[0].tolist()
            speed = float(np.hypot(*velocity)) * (faster if ship == 3 else 1.0)
            rows.append((time_s, 211000001 + ship, lon, lat, speed, np.degrees(np.arctan2(*velocity)) % 360))
    return rows


def table(folder: Path, rows: list[tuple[float, ...]], head: str = HEAD) -> None:
    lines = [
        f"{t:.2f},{mmsi},{lon:.7f},{lat:.7f},{speed:.2f},{course:.1f}" for t, mmsi, lon, lat, speed, course in rows
    ]
    (folder / "ais.csv").write_text("\n".join([head, *lines]))


def last(folder: Path) -> tuple[Array, Array]:
    """Places and MMSI of the confirmed tracks of the last scan."""
    log = read_tracks_csv(folder / "out/tracks.csv")
    rows = log.rows[(log.rows["time_s"] == log.times_s[-1]) & (log.rows["status"] == STATUSES.index("confirmed"))]
    return rows["position"], rows["added"][:, log.columns.added.index("mmsi")]


ENDS = np.array([np.array(place) + 117.5 * np.array(velocity) for place, velocity in WAYS])


def named(folder: Path) -> dict[int, float]:
    """Error of each ship's track by its name; of one without a name, by its number."""
    places, names = last(folder)
    found = {}
    for place, name in zip(places, names, strict=True):
        off = np.hypot(*(ENDS - place).T)
        found[int(off.argmin()) if np.isnan(name) else int(name)] = float(off.min())
    return found


def test_right_reports_name_tracks_and_show_who_is_out_of_view(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path)
    table(tmp_path, reports())
    code, said = elusive_in(*TRACK, "--ais", "ais.csv", "--strict")
    assert code == 0, said
    assert failing(tmp_path) == set()
    assert "5 ships, 100 reports, 9" in said
    found = named(tmp_path)
    assert set(found) == {211000001 + ship for ship in range(5)}
    assert max(found.values()) < 40
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    assert set(named(tmp_path)) == {0, 1, 2, 3}


@pytest.mark.thorough
def test_a_ship_beside_its_place_one_that_is_late_and_one_too_fast_are_named(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path)
    table(tmp_path, reports(off_m=500.0, late_s=60.0, faster=2.0))
    code, said = elusive_in(*TRACK, "--ais", "ais.csv", "--strict")
    assert code == 3, said
    assert failing(tmp_path) == {"radar.ais"}
    (finding,) = (one for one in json.loads((tmp_path / "out/checks.json").read_text()) if one["name"] == "radar.ais")
    beside, late, fast = finding["sentence"].split("; ")
    assert "211000002" in beside
    assert "m east" in beside
    assert "211000003" in late
    assert "s old" in late
    assert "211000004 tells 10.8 m/s" in fast
    found = named(tmp_path)
    assert set(found) == {211000001, 1, 2, 211000004, 211000005}
    assert max(found.values()) < 40  # of none the track follows what it told


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("time_s,mmsi,lat_deg,lon_deg,sog_mps,cog_deg", "lon_deg and lat_deg look exchanged"),
        ("time_s,name,lon_deg,lat_deg,sog_mps,cog_deg", "mmsi"),
        ("time,mmsi,lon_deg,lat_deg,sog_mps,cog_deg", "2026-05-01T12:00:00Z"),
        ("time_s,lon_deg,lat_deg,mmsi,sog_mps,cog_deg", "mmsi"),
    ],
)
def test_columns_that_are_not_what_they_say(elusive_in: Run, tmp_path: Path, head: str, said: str) -> None:
    (tmp_path / "plots.csv").write_text("time_s,range_m,bearing_deg\n0,3000,10\n2,3000,10\n")
    table(tmp_path, reports()[:20], head)
    code, told = elusive_in(*TRACK, "--ais", "ais.csv")
    assert code != 0
    assert said in told


def sentences(folder: Path, later_s: float = 0.0) -> None:
    lines = []
    for time_s, mmsi, lon, lat, speed, course in reports():
        message = {"type": 1, "mmsi": int(mmsi), "lon": lon, "lat": lat, "speed": speed / 0.514444, "course": course}
        told = encode_dict(message, talker_id="AI", sentence_type="VDM")
        lines += [f"{FIRST_S + time_s + later_s:.0f} {one}" for one in told]
    (folder / "ais.nmea").write_text("\n".join(lines))


@pytest.mark.thorough
def test_sentences_have_times_of_day(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path)
    sentences(tmp_path)
    code, said = elusive_in(*TRACK, "--ais", "ais.nmea")
    assert code != 0
    assert "tells times of day" in said
    head, *rows = (tmp_path / "plots.csv").read_text().splitlines()
    parts = (row.split(",", 1) for row in rows)
    dated = [f"{datetime.fromtimestamp(FIRST_S + float(time_s), UTC).isoformat()},{rest}" for time_s, rest in parts]
    (tmp_path / "plots.csv").write_text("\n".join([head.replace("time_s", "time"), *dated]))
    code, said = elusive_in(*TRACK, "--ais", "ais.nmea", "--strict")
    assert code == 0, said
    assert set(named(tmp_path)) == {211000001 + ship for ship in range(5)}
    sentences(tmp_path, later_s=3600.0)
    code, said = elusive_in(*TRACK, "--ais", "ais.nmea", "--strict")
    assert code == 3, said
    assert "the clocks differ" in said


@pytest.mark.thorough
def test_live_reports_are_taken_as_those_of_a_recording(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path)
    table(tmp_path, reports(off_m=500.0))
    with (tmp_path / "ais.csv").open("a") as file:
        file.write("\nnonsense\n")
    (tmp_path / "even.yaml").write_text(EVEN)
    limits = ["--max-doppler-mps", "60", "--ais", "ais.csv", "--config", "even.yaml"]
    code, said = elusive_in(*TRACK, *limits, "--follow", "--idle-s", "0", "--out", "live")
    assert code == 0, said
    assert "1 spoilt" in said
    assert "211000002" in said
    (tmp_path / "ais.csv").write_text((tmp_path / "ais.csv").read_text().replace("nonsense\n", ""))
    code, again = elusive_in(*TRACK, *limits, "--out", "whole")
    assert code == 0, again
    assert (tmp_path / "live/tracks.csv").read_text() == (tmp_path / "whole/tracks.csv").read_text()
