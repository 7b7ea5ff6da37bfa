"""Bearings that are not what they are taken for: a finding that names it."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from elusive.contracts import Array
from tests.cli.test_bearings import run
from tests.commands import ran
from tests.longer import longer

SITES = np.array([(-60.0, -35.0, 1.0), (75.0, -20.0, 2.0), (10.0, 90.0, 3.0)])
WIDE = np.array([(-400.0, -350.0, 0.0), (450.0, -300.0, 0.0), (380.0, 420.0, 0.0), (-420.0, 380.0, 0.0)])
FAR = np.array([1200.0, 900.0])
SIGMA_DEG = 1.0
PLACES = ("x_m", "y_m", "sd_x_m", "sd_y_m", "correlation_xy")
Row = tuple[float, int, float, float]  # time, sensor, azimuth and elevation [s, deg]


def circling(rng: np.random.Generator, centre: Array, radius_m: float, times: int = 80) -> Array:
    """Places of an emitter that flies round a place, 30 m above the ground, ``(times, 3)`` [m]."""
    angle = rng.uniform(0, 2 * np.pi) + 0.08 * np.arange(times)
    off = radius_m * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.column_stack([centre + off, np.full(times, 30.0)])


def heard(rng: np.random.Generator, way: Array, sites: Array, north_deg: Array | float = 0.0) -> list[Row]:
    rows = []
    for time_s, place in enumerate(way):
        off = place - sites
        azimuth = np.degrees(np.arctan2(off[:, 0], off[:, 1])) + rng.normal(0, SIGMA_DEG, len(sites)) + north_deg
        up = np.degrees(np.arctan2(off[:, 2], np.hypot(*off[:, :2].T))) + rng.normal(0, SIGMA_DEG, len(sites))
        rows += [(float(time_s), k, a, e) for k, (a, e) in enumerate(zip(azimuth.tolist(), up.tolist(), strict=True))]
    return rows


def told(folder: Path, rows: list[Row], sites: Array, *, elevations: bool = False) -> list[str]:
    """Write a recording; return what the command takes."""
    with (folder / "bearings.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time_s", "sensor", "azimuth_deg", *(["elevation_deg"] if elevations else [])])
        for time_s, sensor, azimuth, up in sorted(rows, key=lambda row: row[0]):
            writer.writerow([time_s, sensor, f"{azimuth % 360:.3f}", *([f"{up:.3f}"] if elevations else [])])
    lines = [f"{number},{x},{y},{z}" for number, (x, y, z) in enumerate(sites.tolist())]
    (folder / "sensors.csv").write_text("\n".join(["sensor,x_m,y_m,z_m", *lines]))
    return [str(folder / "bearings.csv"), "--sensors", str(folder / "sensors.csv"), "--out", str(folder / "out")]


def failing(folder: Path) -> dict[str, str]:
    rows = json.loads((folder / "out/checks.json").read_text())
    return {row["name"]: row["sentence"] for row in rows if not row["holds"]}


def right(rng: np.random.Generator) -> tuple[list[Row], Array]:
    return heard(rng, circling(rng, np.array([10.0, 15.0]), 40.0), SITES), SITES


def off_a_wall(rng: np.random.Generator) -> tuple[list[Row], Array]:
    """A wall in the east lets the emitter be heard a second time."""
    way = circling(rng, np.array([0.0, 0.0]), 250.0)
    return heard(rng, way, WIDE) + heard(rng, way * [-1, 1, 1] + [800, 0, 0], WIDE), WIDE


def far_away(rng: np.random.Generator, radius_m: float = 40.0) -> tuple[list[Row], Array]:
    """Each north is off by half a degree and more."""
    return heard(rng, circling(rng, FAR, radius_m), SITES, np.array([0.6, -0.7, 0.5])), SITES


def mirrored_past_a_line(rng: np.random.Generator) -> tuple[list[Row], Array]:
    """Anticlockwise azimuths of sensors nearly in a line to the north: an emitter in the west fits nearly as well."""
    sites = np.array([(0.0, 0.0, 0.0), (5.0, 100.0, 0.0), (-4.0, 210.0, 0.0)])
    rows = heard(rng, circling(rng, np.array([120.0, 100.0]), 40.0), sites)
    return [(t, k, -a, e) for t, k, a, e in rows], sites


def a_drifting_north(rng: np.random.Generator) -> tuple[list[Row], Array]:
    rows, sites = right(rng)
    return [(t, k, a + 0.1 * t * (k == 1), e) for t, k, a, e in rows], sites


def one_clock_late(rng: np.random.Generator) -> tuple[list[Row], Array]:
    """Two emitters, unlabelled; one sensor's bearings are of two seconds before."""
    rows = list[Row]()
    for middle in ([-150.0, -100.0], [160.0, 120.0]):
        way = circling(rng, np.array(middle), 150.0, 62)
        late = heard(rng, way[:-2], WIDE)
        rows += [row for row in heard(rng, way[2:], WIDE) if row[1] != 1] + [row for row in late if row[1] == 1]
    return rows, WIDE


ODD: dict[str, tuple[Callable[[np.random.Generator], tuple[list[Row], Array]], str, str]] = {
    "off a wall": (off_a_wall, "bearings.images", "are mirror images of each other"),
    "mirrored past a line": (mirrored_past_a_line, "bearings.sensors", "anticlockwise from north"),
    "a drifting north": (a_drifting_north, "bearings.norths", "errors wander by"),
    "one clock late": (one_clock_late, "bearings.sensors", "the bearings of sensor 1 come"),
}


@pytest.mark.parametrize("name", longer(ODD, "off a wall", "a drifting north", "one clock late"))
def test_it_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    draw, finding, sentence = ODD[name]
    rows, sites = draw(np.random.default_rng([3, list(ODD).index(name)]))
    code, said = run(capsys, *told(tmp_path, rows, sites), "--sigma-deg", SIGMA_DEG)
    assert code == 0, said
    assert sentence in failing(tmp_path)[finding]


def test_a_far_emitter_at_rest_is_located_with_a_remark(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows, sites = far_away(np.random.default_rng([3, 5]), radius_m=0.0)
    code, said = ran(capsys, "locate", *told(tmp_path, rows, sites), "--sigma-deg", SIGMA_DEG)
    assert code == 0, said
    assert "times as far as the sensors are apart" in failing(tmp_path)["bearings.remote"]


def test_a_far_emitter_is_no_surer_than_norths_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Taken for exact they allow 35 m."""
    rows, sites = far_away(np.random.default_rng([3, 5]))
    code, said = run(capsys, *told(tmp_path, rows, sites), "--sigma-deg", SIGMA_DEG)
    assert code == 0, said
    with (tmp_path / "out/tracks.csv").open(newline="") as file:
        found = [{name: float(row[name]) for name in PLACES} for row in csv.DictReader(file)]
    way = circling(np.random.default_rng([3, 5]), FAR, 40.0)
    spread = np.array([(row["sd_x_m"], row["sd_y_m"]) for row in found])
    x, y = ((way[:, :2] - [(row["x_m"], row["y_m"]) for row in found]) / spread).T
    across = np.array([row["correlation_xy"] for row in found])
    assert np.median(np.hypot(*spread.T)) > 100
    assert np.median((x**2 + y**2 - 2 * across * x * y) / (1 - across**2)) < 9.2  # of 99 %


@pytest.mark.thorough
def test_elevations_from_the_zenith_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows, sites = right(np.random.default_rng(4))
    given = told(tmp_path, [(t, k, a, min(90 - e, 90.0)) for t, k, a, e in rows], sites, elevations=True)
    code, said = run(capsys, *given, "--sigma-deg", SIGMA_DEG)
    assert code == 0, said
    assert "the elevations are read from the zenith" in " ".join(failing(tmp_path).values())


@pytest.mark.parametrize("elevations", longer([False, True], True))
def test_the_same_without_it_has_no_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], elevations: bool
) -> None:
    rows, sites = right(np.random.default_rng(4))
    code, said = run(capsys, *told(tmp_path, rows, sites, elevations=elevations), "--sigma-deg", SIGMA_DEG)
    assert code == 0, said
    assert failing(tmp_path) == {}


@pytest.mark.thorough
def test_elevations_that_are_positive_downwards_are_remarked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An emitter as far beneath the sensors fits as well; the right recording's test has no such remark."""
    rows, sites = right(np.random.default_rng(4))
    given = told(tmp_path, [(t, k, a, -e) for t, k, a, e in rows], sites, elevations=True)
    code, said = run(capsys, *given, "--sigma-deg", SIGMA_DEG)
    assert code == 0, said
    assert "bearings.beneath" in failing(tmp_path)


def test_times_that_run_backwards_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows, sites = right(np.random.default_rng(4))
    given = told(tmp_path, rows, sites)
    head, *lines = (tmp_path / "bearings.csv").read_text().splitlines()
    (tmp_path / "bearings.csv").write_text("\n".join([head, *reversed(lines)]))
    code, said = run(capsys, *given)
    assert code != 0
    assert "if times count down, subtract them from the first" in " ".join(said.split())


@pytest.mark.thorough
def test_four_sensors_that_agree_on_a_far_emitter_are_not_doubted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(6)
    way = circling(rng, np.array([5200.0, 4900.0]), 100.0)
    code, said = run(capsys, *told(tmp_path, heard(rng, way, WIDE), WIDE), "--sigma-deg", SIGMA_DEG)
    assert code == 0, said
    assert failing(tmp_path) == {}
