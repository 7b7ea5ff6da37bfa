"""`elusive track radar` on a ship: its own places in columns or a log, plots in degrees; the wrong ones named."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from elusive.contracts import Array
from elusive.geometry.local_frame import LocalFrame
from elusive.io import RadarScan
from elusive.io._own_way import north_at
from elusive.io.nmea import checksum
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import OwnShip
from tests.cli.test_radar import Run

FRAME = LocalFrame.at(10.2, 53.9)
START_S = 1_777_636_800.0  # 2026-05-01T12:00:00Z
SENSOR = RadarSensor(
    bearing_sd_mrad=3.0, detection_probability=0.95, false_alarms=1.0, max_range_m=5000.0, max_doppler_mps=40.0
)
WAYS = [((-1500.0, 2500.0), (6.0, -2.0)), ((1500.0, 500.0), (0.0, 0.0)), ((2500.0, 3000.0), (-5.0, -4.0))]
TURN_S, PERIOD_S = 60.0, 2.5
TRACK = ["track", "radar", "plots.csv", "--knowledge", "none", "--truth", "truth.csv", "--out", "out"]
TRACK += ["--bearing-sd-mrad", "3", "--max-range-m", "5000", "--particles", "500", "--strict"]


def own_state(time_s: float) -> OwnShip:
    """East at 10 m/s, then a turn to the north-west of 1 degree a second, for a minute."""
    rate, speed = math.radians(1.0), 10.0
    turned = rate * min(max(time_s - TURN_S, 0.0), 120.0)
    x, y = speed * min(time_s, TURN_S), 0.0
    x, y = x + speed / rate * math.sin(turned), y + speed / rate * (1 - math.cos(turned))
    vx, vy = speed * math.cos(turned), speed * math.sin(turned)
    after = max(time_s - TURN_S - 120.0, 0.0)
    return OwnShip(x + after * vx, vx, y + after * vy, vy)


def ship(number: int, time_s: float) -> Array:
    (x, y), (vx, vy) = WAYS[number]
    return np.array([x + time_s * vx, vx, y + time_s * vy, vy])


def recorded() -> list[RadarScan]:
    """Three ships, one at rest, for three minutes."""
    rng, scans = np.random.default_rng(5), []
    for k in range(72):
        time_s = PERIOD_S * k
        own = own_state(time_s)
        ships = np.array([ship(number, time_s) for number in range(len(WAYS))])
        scans.append(SENSOR.simulate(ships - np.array(own), rng, time_s)._replace(own=own))
    return scans


def truth(folder: Path, origin_s: float = 0.0) -> None:
    rows = ["time_s,track,lon_deg,lat_deg"]
    for number, ((x, y), (vx, vy)) in enumerate(WAYS):
        for k in range(72):
            (lon, lat), *_ = FRAME.to_lonlat([[x + PERIOD_S * k * vx, y + PERIOD_S * k * vy]]).tolist()
            rows.append(f"{origin_s + PERIOD_S * k},{number},{lon!r},{lat!r}")
    (folder / "truth.csv").write_text("\n".join(rows))


def lonlat(x: float, y: float) -> tuple[float, float]:
    (lon, lat), *_ = FRAME.to_lonlat([[x, y]]).tolist()
    return lon, lat


def table(folder: Path, header: str, rows: list[tuple[object, ...]]) -> None:
    (folder / "plots.csv").write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]))


def each_plot() -> list[tuple[float, float, float, float, OwnShip]]:
    """Time, range, bearing from true north and Doppler of each plot, and where the radar is."""
    found = []
    for scan in recorded():
        north = north_at(FRAME, scan.own.x_m, scan.own.y_m)
        for _, range_m, bearing, doppler in zip(*scan.plots, strict=True):
            found.append((scan.time_s, range_m, math.degrees(bearing - north) % 360, doppler, scan.own))
    return found


def columns_m(folder: Path) -> list[str]:
    rows = [(t, r, (b + math.degrees(north_at(FRAME, own.x_m, own.y_m))) % 360, d, own.x_m, own.y_m)
            for t, r, b, d, own in each_plot()]  # fmt: skip
    table(folder, "time_s,range_m,bearing_deg,doppler_mps,x_m,y_m", rows)
    truth(folder)
    return ["--radar-lat-deg", "53.9", "--radar-lon-deg", "10.2"]


def columns_deg(folder: Path) -> list[str]:
    rows = [(t, r, b, d, *lonlat(own.x_m, own.y_m)) for t, r, b, d, own in each_plot()]
    table(folder, "time_s,range_m,bearing_deg,doppler_mps,own_lon_deg,own_lat_deg", rows)
    truth(folder)
    return []


def places_deg(folder: Path) -> list[str]:
    """Plots in degrees, as a chart plotter exports them."""
    rows = []
    for t, r, b, d, own in each_plot():
        angle = math.radians(b) + north_at(FRAME, own.x_m, own.y_m)
        place = lonlat(own.x_m + r * math.sin(angle), own.y_m + r * math.cos(angle))
        rows.append((t, *place, d, *lonlat(own.x_m, own.y_m)))
    table(folder, "time_s,lon_deg,lat_deg,doppler_mps,own_lon_deg,own_lat_deg", rows)
    truth(folder)
    return []


@pytest.mark.thorough
def test_a_log_that_freezes_is_named(elusive_in: Run, tmp_path: Path) -> None:
    columns_m(tmp_path)
    head, *lines = (tmp_path / "plots.csv").read_text().splitlines()
    rows = [line.split(",") for line in lines]
    last = next(row for row in rows if float(row[0]) >= 90)
    frozen = [",".join([*row[:4], *(last[4:] if float(row[0]) >= 90 else row[4:])]) for row in rows]
    (tmp_path / "plots.csv").write_text("\n".join([head, *frozen]))
    code, said = elusive_in(*TRACK, "--radar-lat-deg", "53.9", "--radar-lon-deg", "10.2")
    assert code == 3, said
    assert "its log is frozen" in said


def sentence(body: str) -> str:
    return f"${body}*{checksum(body):02X}"


def log(folder: Path, headed: bool = True) -> None:
    lines = []
    for k in range(-2, 190):
        own, moment = own_state(float(k)), datetime.fromtimestamp(START_S + k, UTC)
        lon, lat = lonlat(own.x_m, own.y_m)
        place = f"{int(lat):02d}{60 * (lat % 1):08.5f},N,{int(lon):03d}{60 * (lon % 1):08.5f},E"
        lines.append(sentence(f"GPRMC,{moment:%H%M%S}.00,A,{place},,,{moment:%d%m%y},,"))
        if headed:
            lines.append(sentence(f"HEHDT,{math.degrees(math.atan2(own.vx_mps, own.vy_mps)) % 360:.2f},T"))
    (folder / "own.log").write_text("\n".join(lines))


def relative(folder: Path) -> list[str]:
    """Bearings from the bow, and the ship's own instruments beside them."""
    rows = []
    for t, r, b, d, own in each_plot():
        bow = math.degrees(math.atan2(own.vx_mps, own.vy_mps) - north_at(FRAME, own.x_m, own.y_m))
        moment = datetime.fromtimestamp(START_S + t, UTC).isoformat()
        rows.append((moment, r, (b - bow) % 360, d))
    table(folder, "time,range_m,relative_bearing_deg,doppler_mps", rows)
    log(folder)
    truth(folder, START_S)
    return ["--own-ship", "own.log"]


def failing(folder: Path) -> set[str]:
    return {one["name"] for one in json.loads((folder / "out/checks.json").read_text()) if not one["holds"]}


def turning(folder: Path) -> list[str]:
    """An antenna that turns on the ship's deck, each plot at its own time and with its own place and heading."""
    rng, rows = np.random.default_rng(8), []
    for k in range(72):
        for number in range(len(WAYS) + rng.poisson(1.0)):
            time_s, far = PERIOD_S * (k + rng.random()), SENSOR.max_range_m * rng.random()
            if number < len(WAYS):
                for _ in range(20):  # when the beam meets the ship
                    own = own_state(time_s)
                    seen = ship(number, time_s) - np.array(own)
                    bow = math.atan2(own.vx_mps, own.vy_mps)
                    time_s = PERIOD_S * (k + (math.atan2(seen[0], seen[2]) - bow) / (2 * math.pi) % 1)
                far = math.hypot(seen[0], seen[2]) + rng.normal(0, 10)
                if rng.random() > 0.95:
                    continue
            own = own_state(time_s)
            bow = math.degrees(math.atan2(own.vx_mps, own.vy_mps) - north_at(FRAME, own.x_m, own.y_m))
            angle = 360 * (time_s / PERIOD_S % 1) + bow + rng.normal(0, math.degrees(0.003))
            rows.append((time_s, far, angle % 360, *lonlat(own.x_m, own.y_m), bow % 360))
    table(folder, "time_s,range_m,bearing_deg,lon_deg,lat_deg,heading_deg", sorted(rows))
    truth(folder)
    return []


def tracks(folder: Path) -> Array:
    return np.genfromtxt(folder / "out/tracks.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")


@pytest.mark.parametrize(
    "write",
    [
        *(pytest.param(one, marks=pytest.mark.thorough) for one in (columns_m, columns_deg, relative, places_deg)),
        turning,
    ],
)
def test_ships_are_followed_from_a_ship_that_turns(elusive_in: Run, tmp_path: Path, write) -> None:
    code, said = elusive_in(*TRACK, *write(tmp_path))
    assert code == 0, said
    found = tracks(tmp_path)
    sure = found[found["status"] == "confirmed"]
    late = sure[sure["time_s"] > sure["time_s"].min() + 60]
    assert len(np.unique(sure["track"])) == 3
    places = FRAME.to_local(np.column_stack([late["lon_deg"], late["lat_deg"]]))
    then = late["time_s"] - (START_S if write is relative else 0.0)
    ships = np.array([[ship(number, t)[[0, 2]] for number in range(len(WAYS))] for t in then])
    off = np.hypot(*np.moveaxis(ships - places[:, None], -1, 0)).min(axis=1)
    # 10 m in range and 3 mrad at 3 km: a track is better than one plot
    assert math.sqrt((off**2).mean()) < 10.0
    assert "The radar's way" in said
    assert failing(tmp_path) == set()


def swapped(folder: Path) -> list[str]:
    turning(folder)
    text = (folder / "plots.csv").read_text()
    (folder / "plots.csv").write_text(text.replace("lon_deg,lat_deg", "lat_deg,lon_deg"))
    return []


def radians(folder: Path) -> list[str]:
    turning(folder)
    head, *lines = (folder / "plots.csv").read_text().splitlines()
    rows = [tuple(map(float, line.split(","))) for line in lines]
    table(folder, head, [(*row[:5], math.radians(row[5])) for row in rows])
    return ["--rotation-s", str(PERIOD_S)]


def degrees_as_metres(folder: Path) -> list[str]:
    columns_deg(folder)
    text = (folder / "plots.csv").read_text()
    (folder / "plots.csv").write_text(text.replace("own_lon_deg,own_lat_deg", "own_x_m,own_y_m"))
    return ["--radar-lat-deg", "53.9", "--radar-lon-deg", "10.2"]


def plots_as_metres(folder: Path) -> list[str]:
    rows = [(t, 10.2 + r * math.sin(b) / 65000, 53.9 + r * math.cos(b) / 111000) for t, r, b, _, _ in each_plot()]
    table(folder, "time_s,x_m,y_m", rows)
    truth(folder)
    return ["--radar-lat-deg", "53.9", "--radar-lon-deg", "10.2"]


@pytest.mark.parametrize(
    ("write", "finding"),
    [
        pytest.param(swapped, "radar.own-heading", marks=pytest.mark.thorough),
        pytest.param(radians, "radar.own-heading", marks=pytest.mark.thorough),
        pytest.param(degrees_as_metres, "radar.own-place", marks=pytest.mark.thorough),
        pytest.param(plots_as_metres, "radar.places", marks=pytest.mark.thorough),
    ],
)
def test_what_is_wrong_of_the_radars_way_is_named(elusive_in: Run, tmp_path: Path, write, finding: str) -> None:
    code, said = elusive_in(*TRACK, *write(tmp_path))
    assert code == 3, said
    assert finding in failing(tmp_path)


def plots_places(folder: Path) -> list[str]:
    """The plots' own places under the names of the radar's."""
    rows = [(t, r, b, r * math.sin(math.radians(b)), r * math.cos(math.radians(b))) for t, r, b, _, _ in each_plot()]
    table(folder, "time_s,range_m,bearing_deg,x_m,y_m", rows)
    truth(folder)
    return ["--radar-lat-deg", "53.9", "--radar-lon-deg", "10.2"]


def no_heading(folder: Path) -> list[str]:
    told = relative(folder)
    log(folder, headed=False)
    return told


def another_day(folder: Path) -> list[str]:
    told = relative(folder)
    text = (folder / "plots.csv").read_text()
    (folder / "plots.csv").write_text(text.replace("2026-05-01", "2026-05-02").replace("relative_bearing", "bearing"))
    return told


def no_day(folder: Path) -> list[str]:
    columns_deg(folder)
    text = (folder / "plots.csv").read_text()
    (folder / "plots.csv").write_text(text.replace("own_lon_deg,own_lat_deg", "a,b"))
    log(folder)
    return ["--own-ship", "own.log"]


def told_twice(folder: Path) -> list[str]:
    columns_deg(folder)
    log(folder)
    return ["--own-ship", "own.log"]


def far_away(folder: Path) -> list[str]:
    places_deg(folder)
    text = (folder / "plots.csv").read_text()
    (folder / "plots.csv").write_text(text.replace("time_s,lon_deg,lat_deg", "time_s,lat_deg,lon_deg"))
    return []


@pytest.mark.parametrize(
    ("write", "told"),
    [
        (plots_places, "the radar would move"),
        (no_heading, "its bearing is from the bow, and no heading is told"),
        (another_day, "says nothing of the radar's place within 30 s"),
        (no_day, "its times count from a moment that it does not say"),
        (told_twice, "tells in its own columns where the radar was"),
        (far_away, "km from the radar; check the radar's place"),
    ],
)
def test_what_cannot_be_is_refused(elusive_in: Run, tmp_path: Path, write, told: str) -> None:
    code, said = elusive_in(*TRACK, *write(tmp_path))
    assert code == 2, said
    assert told in said


@pytest.mark.thorough
def test_a_radar_that_sails_under_a_chart_tells_ships_from_the_coast(elusive_in: Run, tmp_path: Path) -> None:
    """Twelve echoes of a shore 3 km off, one ship 20 m before it and one at sea; the radar turns on its way."""

    def lonlat(*places: tuple[float, float]) -> list[list[float]]:
        return FRAME.to_lonlat(np.array(places, dtype=float)).tolist()  # type: ignore[no-any-return]

    ways = {
        "own": ((-1500, 0), (0, 0), (600, 300)),
        "near": ((-700, 2980), (500, 2980)),
        "sea": ((1500, 1500), (500, 700)),
    }
    for name, way in ways.items():
        rows = [f"{lon},{lat}" for lon, lat in lonlat(*way)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["lon_deg,lat_deg", *rows]))
    ring = lonlat((-6000, 3000), (6000, 3000), (6000, 9000), (-6000, 9000), (-6000, 3000))
    shape = {"type": "Polygon", "coordinates": [ring]}
    box = [number for corner in lonlat((-6500, -6500), (6500, 9500)) for number in corner]
    land = {
        "type": "FeatureCollection",
        "bbox": box,
        "features": [{"type": "Feature", "properties": {}, "geometry": shape}],
    }
    (tmp_path / "coast.geojson").write_text(json.dumps(land))
    place = ["--radar-lat-deg", "53.9", "--radar-lon-deg", "10.2", "--max-range-m", "5000", "--bearing-sd-mrad", "3"]
    sailed = ["--own-route", "own.csv", "--coast-echoes", "12", "--interval-s", "3", "--doppler-probability", "0"]
    code, said = elusive_in(
        "simulate", "radar", "--route", "near.csv", "--route", "sea.csv", "--chart", "coast.geojson", *sailed, *place,
        "--detection-probability", ".9", "--false-alarms", "1", "--out", "sailed",
    )  # fmt: skip
    assert code == 0, said
    command = ["track", "radar", "sailed/plots.csv", "--truth", "sailed/truth.csv", "--chart", "coast.geojson", *place]
    code, said = elusive_in(*command, "--coast-sigma-m", "10", "--particles", "500", "--strict", "--out", "out")
    assert code == 0, said
    assert not [one for one in json.loads((tmp_path / "out/checks.json").read_text()) if not one["holds"]]
    assert "At most 2 ships at a time, in 2 tracks." in said
    assert "The radar's way" in said


@pytest.mark.thorough
@pytest.mark.parametrize("reversed_doppler", [False, True])
def test_a_north_that_is_off_and_a_doppler_that_is_reversed_are_named_without_a_chart(
    elusive_in: Run, tmp_path: Path, reversed_doppler: bool
) -> None:
    """Twenty buoys and a ship, seen from a ship that turns: right, and with what the command is told spoilt."""
    rng, rows = np.random.default_rng(8), list[tuple[object, ...]]()
    buoys = np.zeros((20, 4))
    buoys[:, [0, 2]] = np.array([900.0, 600.0]) + rng.uniform(-2500, 2500, (20, 2))
    for k in range(72):
        own = own_state(PERIOD_S * k)
        scan = SENSOR.simulate(np.concatenate([buoys, ship(0, PERIOD_S * k)[None]]) - np.array(own), rng, 0.0)
        for _, far, bearing, doppler in zip(*scan.plots, strict=True):
            north = north_at(FRAME, own.x_m, own.y_m)
            turned = math.degrees(bearing - north) + (0.0 if reversed_doppler else 2.5)
            rate = -doppler if reversed_doppler else doppler
            rows.append((PERIOD_S * k, far, turned % 360, rate, *lonlat(own.x_m, own.y_m)))
    table(tmp_path, "time_s,range_m,bearing_deg,doppler_mps,own_lon_deg,own_lat_deg", rows)
    told = ["--bearing-sd-mrad", "3", "--max-range-m", "5000", "--particles", "200", "--strict", "--out", "out"]
    code, said = elusive_in("track", "radar", "plots.csv", "--knowledge", "none", *told)
    assert code == 3, said
    assert ("radar.doppler" if reversed_doppler else "radar.still") in failing(tmp_path)
    assert ("counts towards the radar" if reversed_doppler else "bearings are 2.5 degrees too large") in said
