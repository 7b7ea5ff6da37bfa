"""Wrong inputs of `elusive track radar`: each ends in a finding that names it, or is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import yaml

from elusive.contracts import Array
from elusive.io import open_radar_plots, write_radar_plots_csv
from elusive.sensors.radar import RadarSensor
from tests.cli.test_radar import FRAME, RADAR, Run, coast
from tests.longer import longer

SENSOR = RadarSensor(detection_probability=0.9, false_alarms=1.0, max_range_m=3500.0, doppler_probability=0.0)
WAYS = [((-2500.0, -1000.0), (4.0, 3.0)), ((-500.0, 2500.0), (3.0, -5.0)), ((1500.0, -2000.0), (-3.0, 5.0))]
TRACK = ["track", "radar", "plots.csv", "--out", "out", "--strict"]
CHART = ["--chart", "coast.geojson", "--coast-sigma-m", "10"]


def plots(folder: Path, **fields: float) -> None:
    """Three ships west of the coast, for three minutes."""
    rng, sensor, scans = np.random.default_rng(2), SENSOR.replace(**fields), []
    for k in range(72):
        states = np.array([[x + 2.5 * k * vx, vx, y + 2.5 * k * vy, vy] for (x, y), (vx, vy) in WAYS])
        scans.append(sensor.simulate(states, rng, 2.5 * k))
    coast(folder)
    write_radar_plots_csv(folder / "plots.csv", scans)


def rewritten(folder: Path, column: int, factor: float) -> None:
    """Multiply a column of the plots."""
    head, *lines = (folder / "plots.csv").read_text().splitlines()
    rows = [line.split(",") for line in lines]
    for row in rows:
        row[column] = repr(float(row[column]) * factor) if row[column] else ""
    (folder / "plots.csv").write_text("\n".join([head, *map(",".join, rows)]))


def failing(folder: Path) -> set[str]:
    return {one["name"] for one in json.loads((folder / "out/checks.json").read_text()) if not one["holds"]}


def tracks(folder: Path) -> Array:
    """Times, tracks and places of what was found."""
    return np.genfromtxt(folder / "out/tracks.csv", delimiter=",", skip_header=1, usecols=(0, 1, 4, 5))


def test_what_is_right_is_not_remarked_on(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path)
    code, said = elusive_in(*TRACK, *RADAR, *CHART)
    assert code == 0, said
    assert failing(tmp_path) == set()


@pytest.mark.thorough
def test_errors_told_too_small_are_named_and_fitted(elusive_in: Run, tmp_path: Path) -> None:
    """25 m and 6 mrad, told as 10 and 1: five tracks for each ship, and more. Not told they are found."""
    plots(tmp_path, range_sd_m=25.0, bearing_sd_mrad=6.0)
    code, said = elusive_in(*TRACK, *RADAR, *CHART)
    assert code == 0, said
    assert "deviation of ranges, deviation of bearings, P_D, false alarms" in said
    found = yaml.safe_load((tmp_path / "out/config.yaml").read_text())["radar"]
    assert set(tracks(tmp_path)[:, 1]) == {1, 2, 3}
    code, said = elusive_in(*TRACK, *RADAR, *CHART, "--range-sd-m", "10", "--bearing-sd-mrad", "1")
    assert code == 3, said
    assert failing(tmp_path) >= {"radar.range-error", "radar.bearing-error"}
    assert "1 mrad was told" in said
    code, said = elusive_in("fit", "radar", "plots.csv", "--out", "fitted.yaml")
    assert code == 0, said
    radar = yaml.safe_load((tmp_path / "fitted.yaml").read_text())["radar"]
    assert radar["range_sd_m"] == pytest.approx(25.0, rel=0.3)
    assert radar["bearing_sd_mrad"] == pytest.approx(6.0, rel=0.3)
    assert {name: found[name] for name in radar if "_sd_" in name} == {
        name: radar[name] for name in radar if "_sd_" in name
    }
    code, said = elusive_in(*TRACK, *RADAR, *CHART, "--config", "fitted.yaml")
    assert code == 0, said


def test_ranges_in_nautical_miles_are_named(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path)
    rewritten(tmp_path, 1, 1 / 1852)
    code, said = elusive_in(*TRACK, *RADAR, "--knowledge", "none")
    assert code == 3, said
    assert failing(tmp_path) == {"radar.ranges"}
    assert "nautical miles" in said


@pytest.mark.thorough
def test_nautical_miles_iso_times_and_further_columns_give_the_same_tracks(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path)
    code, said = elusive_in(*TRACK, *RADAR, "--knowledge", "none")
    assert code == 0, said
    before = tracks(tmp_path)
    rewritten(tmp_path, 1, 1 / 1852)
    _, *lines = (tmp_path / "plots.csv").read_text().splitlines()
    rows = [
        f"{datetime.fromtimestamp(float(t), UTC).isoformat()},{rest},-31"
        for t, rest in (x.split(",", 1) for x in lines)
    ]
    (tmp_path / "plots.csv").write_text("\n".join(["time,range_nmi,bearing_deg,doppler_mps,echo_db", *rows]))
    code, said = elusive_in(*TRACK, *RADAR, "--knowledge", "none")
    assert code == 0, said
    assert failing(tmp_path) == {"radar.columns"}
    assert "echo_db" in said
    np.testing.assert_allclose(tracks(tmp_path), before, atol=1e-3)


@pytest.mark.thorough
def test_bearings_in_radians_are_named(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path)
    rewritten(tmp_path, 2, np.pi / 180)
    code, said = elusive_in(*TRACK, *RADAR, "--knowledge", "none")
    assert code == 3, said
    assert "radar.bearings" in failing(tmp_path)
    assert "look like radians" in said


@pytest.mark.thorough
def test_a_radar_put_where_its_ships_sail_over_land_is_named(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path, false_alarms=0.5)
    coast(tmp_path, east=-3800.0)  # nearly all of the chart is land
    code, said = elusive_in(*TRACK, *RADAR, *CHART)
    assert code == 3, said
    assert "radar.on-land" in failing(tmp_path)


def test_longitude_and_latitude_exchanged_are_refused(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path)
    code, said = elusive_in(*TRACK, "--radar-lat-deg", FRAME.lon_deg, "--radar-lon-deg", FRAME.lat_deg, *CHART)
    assert code != 0
    assert "exchange the two" in said
    assert not (tmp_path / "out").exists()


@pytest.mark.thorough
def test_seven_ships_of_a_turning_antenna_are_found(elusive_in: Run, tmp_path: Path) -> None:
    """Each plot has the time at which the antenna passes it."""
    rng, period, rows = np.random.default_rng(4), 2.4, []
    x, v = rng.uniform(-2500, 2500, (7, 2)), rng.normal(0, 5, (7, 2))
    for turn in range(60):
        for i in range(7):
            at = x[i] + turn * period * v[i]
            angle = np.arctan2(*at) % (2 * np.pi)
            time_s = (turn + angle / (2 * np.pi)) * period
            at = x[i] + time_s * v[i]
            bearing = np.degrees((np.arctan2(*at) + rng.normal(0, 1e-3)) % (2 * np.pi))
            if rng.random() < 0.9:
                rows.append((time_s, np.hypot(*at) + rng.normal(0, 10), bearing))
    lines = [f"{time_s:.4f},{far:.2f},{bearing:.4f}" for time_s, far, bearing in sorted(rows)]
    (tmp_path / "plots.csv").write_text("\n".join(["time_s,range_m,bearing_deg", *lines]))
    code, said = elusive_in(*TRACK, *RADAR, "--knowledge", "none")
    assert code == 0, said
    assert "At most 7 ships at a time" in said
    assert "turns in 2.400 s" in said
    assert len(list(open_radar_plots(tmp_path / "plots.csv"))) in (60, 61)


def inland(folder: Path, turned_deg: float) -> None:
    """Thirty buildings behind the coast, and a north that is wrong."""
    rng = np.random.default_rng(3)
    east, north = 3000.0 + rng.uniform(5, 60, 30), rng.uniform(-1500, 1500, 30)
    _, *lines = (folder / "plots.csv").read_text().splitlines()
    rows = [tuple(map(float, line.split(",")[:3])) for line in lines]
    for time_s in sorted({row[0] for row in rows}):
        seen = rng.random(30) < 0.7
        far = np.hypot(east, north)[seen] + rng.normal(0, 10, seen.sum())
        bearing = np.degrees(np.arctan2(east, north)[seen] + rng.normal(0, 1e-3, seen.sum())) % 360
        rows += [(time_s, *one) for one in zip(far.tolist(), bearing.tolist(), strict=True)]
    lines = [f"{t},{r},{(b + turned_deg) % 360}" for t, r, b in sorted(rows)]
    (folder / "plots.csv").write_text("\n".join(["time_s,range_m,bearing_deg", *lines]))


@pytest.mark.thorough
@pytest.mark.parametrize("turned_deg", longer([0.0, 6.0], 6.0))
def test_a_wrong_north_is_told_by_what_stands_on_land(elusive_in: Run, tmp_path: Path, turned_deg: float) -> None:
    plots(tmp_path, false_alarms=0.5)
    inland(tmp_path, turned_deg)
    code, said = elusive_in(*TRACK, *RADAR, *CHART, "--particles", "300")
    assert code == (3 if turned_deg else 0), said
    assert ("radar.fixed" in failing(tmp_path)) == bool(turned_deg)
    if turned_deg:
        assert "degrees too large" in said


def told_again(lines: list[str]) -> list[str]:
    """Each scan twice, half a second apart."""
    again = [",".join([f"{float(line.split(',')[0]) + 0.5:g}", *line.split(",")[1:]]) for line in lines]
    return sorted([*lines, *again], key=lambda line: float(line.split(",")[0]))


def coarse(lines: list[str]) -> list[str]:
    """Bearings to five degrees."""
    rows = [line.split(",") for line in lines]
    return [",".join([row[0], row[1], f"{5 * round(float(row[2]) / 5) % 360}", *row[3:]]) for row in rows]


def in_parts(lines: list[str]) -> list[str]:
    """Each turn of the antenna under three times."""
    rows = [line.split(",") for line in lines]
    return [",".join([f"{float(row[0]) + 0.8 * (float(row[2]) // 120):g}", *row[1:]]) for row in rows]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("change", "name", "told"),
    [
        (told_again, "radar.repeated", [("--detection-probability", "0.9"), ()]),
        (coarse, "radar.rounding", [("--bearing-sd-mrad", "2")]),  # untold it is that of the rounding
    ],
)
def test_what_is_not_measured_anew_is_named(
    elusive_in: Run,
    tmp_path: Path,
    change: Callable[[list[str]], list[str]],
    name: str,
    told: list[tuple[str, ...]],
) -> None:
    plots(tmp_path)
    head, *lines = (tmp_path / "plots.csv").read_text().splitlines()
    changed = sorted(change(lines), key=lambda line: float(line.split(",")[0]))
    (tmp_path / "plots.csv").write_text("\n".join([head, *changed]))
    for options in told:
        left, said = elusive_in(*TRACK, *RADAR, "--particles", "300", *options)
        assert left == 3, said
        assert name in failing(tmp_path)


@pytest.mark.thorough
def test_parts_of_a_turn_are_put_together(elusive_in: Run, tmp_path: Path) -> None:
    plots(tmp_path)
    head, *lines = (tmp_path / "plots.csv").read_text().splitlines()
    changed = sorted(in_parts(lines), key=lambda line: float(line.split(",")[0]))
    (tmp_path / "plots.csv").write_text("\n".join([head, *changed]))
    code, said = elusive_in(*TRACK, *RADAR, "--particles", "300")
    assert code == 0, said
    assert "turns in 2." in said, said
    assert failing(tmp_path) == set()
    assert len(set(tracks(tmp_path)[:, 1])) == len(WAYS)


@pytest.mark.thorough
def test_ships_that_break_a_constraint_are_told(elusive_in: Run, tmp_path: Path) -> None:
    """Of three ships one goes north-west, within the courses or outside of them."""
    plots(tmp_path)
    command = [*TRACK, "--config", "constraints.yaml", *RADAR, "--knowledge", "none"]
    broken = {"radar.constraints", "radar.again"}  # a ship that breaks one is lost, and begun anew
    for last_deg, code_expected, failing_expected in ((359.0, 0, set()), (200.0, 3, broken)):
        course = {"kind": "course", "from_deg": 10.0, "to_deg": last_deg}
        (tmp_path / "constraints.yaml").write_text(yaml.safe_dump({"constraints": [course]}))
        code, said = elusive_in(*command)
        assert code == code_expected, said
        assert failing(tmp_path) == failing_expected
    live = ["--follow", "--idle-s", "0", "--max-range-m", "3500", "--out", "out/live"]
    code, said = elusive_in(*[part for part in command if part != "--strict"], *live)
    assert code == 0, said
    assert "at the constraints' edge" in said
    (tmp_path / "constraints.yaml").write_text(yaml.safe_dump({"constraints": [{"kind": "speed", "upper_kn": 9}]}))
    code, said = elusive_in(*command)
    assert code != 0
    assert "upper_mps" in said
