"""`elusive simulate radar` and `elusive track radar` as a new user meets them: in an empty folder, with mistakes."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

from elusive.geometry.local_frame import LocalFrame
from elusive.io import read_truth
from elusive.results import STATUSES, read_tracks_csv
from tests.charts.scenes import head
from tests.io.test_ship_truth import ais_line

WRITTEN = [
    "checks.json", "config.yaml", "report.html", "report.png", "result.nc", "scores.csv", "scores.json", "tracks.csv",
    "tracks.geojson",
]  # fmt: skip
FRAME = LocalFrame.at(4.0, 52.0)
RADAR = ["--radar-lat-deg", "52", "--radar-lon-deg", "4"]
TRACK = ["track", "radar", "plots.csv", "--chart", "coast.geojson", *RADAR, "--out", "deep/out"]
THESIS = ["--detection-probability", "1", "--false-alarms", "0", "--q", "2.7777777777777777"]
ERRORS = ["--range-sd-m", "10", "--bearing-sd-mrad", "1"]
Run = Callable[..., tuple[int, str]]


def lonlat(*places: tuple[float, float]) -> list[list[float]]:
    return np.round(FRAME.to_lonlat(np.array(places, dtype=float)), 7).tolist()


def coast(folder: Path, *, east: float = 3000.0, name: str = "coast.geojson") -> None:
    """Land east of a straight coast that runs north, with a chart of 8 by 8 km round the radar."""
    corners = [(-4000.0, -4000.0), (4000.0, 4000.0)]
    west, south, far_east, north = np.array(lonlat(*corners)).ravel().tolist()
    ring = lonlat((east, -3900), (3990, -3900), (3990, 3900), (east, 3900), (east, -3900))
    shape = {"type": "Polygon", "coordinates": [ring]}
    collection = {
        "type": "FeatureCollection",
        "bbox": [west, south, far_east, north],
        "features": [{"type": "Feature", "properties": {}, "geometry": shape}],
    }
    (folder / name).write_text(json.dumps(collection))


def route(folder: Path, *places: tuple[float, float]) -> None:
    rows = [f"{lon},{lat}" for lon, lat in lonlat(*places)]
    (folder / "route.csv").write_text("\n".join(["lon_deg,lat_deg", *rows]))


SAILED: dict[tuple[object, ...], dict[str, bytes]] = {}


def recording(run: Run, folder: Path, *options: object) -> None:
    """Simulate a ship north along the coast, 15 m off it, for 60 s; it leaves coast, route, plots and truth."""
    if options not in SAILED:
        coast(folder)
        route(folder, (2985.0, -200.0), (2985.0, 220.0))
        code, said = run("simulate", "radar", "--route", "route.csv", *RADAR, "--out", ".", *options)
        assert code == 0, said
        SAILED[options] = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    for name, content in SAILED[options].items():
        (folder / name).write_bytes(content)


@pytest.mark.thorough
def test_charts_after_one_option_or_each_after_its_own(elusive_in: Run, tmp_path: Path) -> None:
    recording(elusive_in, tmp_path)
    coast(tmp_path, east=3005.0, name="other.geojson")
    forms = {
        "one": ["--chart", "coast.geojson", "other.geojson", "plots.csv"],
        "each": ["plots.csv", "--chart", "coast.geojson", "--chart", "other.geojson"],
    }
    for out, form in forms.items():
        code, said = elusive_in("track", "radar", *form, *RADAR, "--knowledge", "hard", *THESIS, "--out", out)
        assert code == 0, said
        assert "coast, other" in said or "other, coast" in said
    assert (tmp_path / "one/tracks.csv").read_bytes() == (tmp_path / "each/tracks.csv").read_bytes()


@pytest.mark.thorough
def test_a_ship_at_anchor_is_told(elusive_in: Run, tmp_path: Path) -> None:
    """Plots of a ship that stays where it is; under way its speed would have to stay within a tenth of a metre."""
    rng = np.random.default_rng(3)
    distance, bearing = rng.normal(3000.0, 10.0, 120), rng.normal(1.0, 1e-3, 120)
    rows = (f"{k},{distance[k]},{np.degrees(bearing[k])},{rng.normal(0.0, 0.3)}" for k in range(120))
    (tmp_path / "plots.csv").write_text("\n".join(["time_s,range_m,bearing_deg,doppler_mps", *rows]))
    command = ["track", "radar", "plots.csv", *RADAR, "--knowledge", "none", "--doppler-sd-mps", "0.3", *THESIS]
    code, said = elusive_in(*command, "--motion", "anchoring", "--out", "anchored")
    assert code == 0, said
    share = re.search(r"Track 1: at anchor, more likely than not, in (\d+) % of its scans", said)
    assert share is not None
    assert int(share[1]) > 80
    with xr.open_dataset(tmp_path / "anchored/result.nc") as found:
        assert float(found.at_anchor[-1]) > 0.95
    code, said = elusive_in(*command, "--out", "moving")
    assert code == 0, said
    assert "at anchor" not in said


def test_a_simulated_ship_is_found_where_it_was(elusive_in: Run, tmp_path: Path) -> None:
    recording(elusive_in, tmp_path)
    code, said = elusive_in(*TRACK, "--coast-sigma-m", "7", "--truth", "truth.csv", *THESIS)
    assert code == 0, said
    assert "One ship was found, from 0 s to 60 s" in said
    written = "tracks.csv, tracks.geojson, result.nc, report.html, report.png, checks.json, config.yaml, scores.json"
    assert f"Written to deep/out: {written}" in said
    assert sorted(path.name for path in (tmp_path / "deep" / "out").iterdir()) == WRITTEN
    log = read_tracks_csv(tmp_path / "deep/out/tracks.csv")
    rows = log.rows
    sure = rows[rows["status"] == STATUSES.index("confirmed")]
    assert len(sure) == 59
    off = sure["position"] - read_truth(tmp_path / "truth.csv", "m").at(sure["time_s"])[:, 0]
    assert np.sqrt((off**2).sum(axis=1).mean()) < 10
    assert log.columns.added[:2] == ("lon_deg", "lat_deg")
    np.testing.assert_allclose(FRAME.to_local(sure["added"][:, :2]), sure["position"], atol=1e-3)
    lines = json.loads((tmp_path / "deep/out/tracks.geojson").read_text())["features"]
    assert lines[0]["geometry"]["coordinates"][5] == pytest.approx(rows["added"][5, :2])
    with (tmp_path / "deep/out/tracks.csv").open() as file:
        assert next(csv.reader(file)) == [
            "time_s", "track", "status", "existence", "x_m", "y_m", "vx_mps", "vy_mps", "sd_x_m", "sd_y_m",
            "correlation_xy", "lon_deg", "lat_deg", "log_odds", "allowed", "map_left_out", "plot_on_water",
            "at_anchor", "length_m", "sd_length_m", "breadth_m", "mmsi", "moves", "stands",
        ]  # fmt: skip


@pytest.mark.thorough
def test_the_configuration_written_repeats_the_run(elusive_in: Run, tmp_path: Path) -> None:
    recording(elusive_in, tmp_path, "--detection-probability", "0.8")
    unusual = ["--coast-error", "persistent", "--estimate", "map", "--seed", "3", "--coast-sigma-m", "9"]
    assert elusive_in(*TRACK, *unusual, "--particles", "200")[0] == 0
    again = ["track", "radar", "plots.csv", "--chart", "coast.geojson", *RADAR, "--out", "again"]
    assert elusive_in(*again, "--config", "deep/out/config.yaml")[0] == 0
    for name in ("tracks.csv", "config.yaml"):
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "deep/out" / name).read_bytes()
    config = yaml.safe_load((tmp_path / "again/config.yaml").read_text())
    assert (config["knowledge"]["kind"], config["charted"]["imprecision"]["coast_sigma_m"]) == ("field", 9)


def test_a_map_that_leaves_no_room_is_said(elusive_in: Run, tmp_path: Path) -> None:
    coast(tmp_path)
    route(tmp_path, (2960.0, -200.0), (3150.0, -50.0), (3150.0, 220.0))  # 150 m inland, by a chart taken as exact
    code, said = elusive_in(
        "simulate", "radar", "--route", "route.csv", *RADAR, "--out", ".", "--chart", "coast.geojson"
    )
    assert code == 0
    assert re.search(r"On charted land \d\d\.\d % of the scans", said)
    code, said = elusive_in(*TRACK, "--knowledge", "hard", *THESIS, *ERRORS)
    assert code == 0
    assert re.search(r"Track 1: the map left it no room in \d\d of \d\d scans, first at \d\d s, and was not used", said)
    assert "Track 1: chart and radar contradict each other" in said
    assert said.count("ship was found") == 1
    recording(elusive_in, tmp_path)
    code, said = elusive_in(*TRACK, "--knowledge", "hard", *THESIS, *ERRORS)
    assert code == 0
    assert "no room" not in said
    assert "contradict" not in said


@pytest.mark.thorough
def test_ais_positions_as_truth(elusive_in: Run, tmp_path: Path) -> None:
    recording(elusive_in, tmp_path)
    start = 1_700_000_000  # the plots' clock and the log's
    lines = [line.split(",") for line in (tmp_path / "plots.csv").read_text().splitlines()]
    shifted = [",".join([f"{start + float(time_s):.0f}", *rest]) for time_s, *rest in lines[1:]]
    (tmp_path / "plots.csv").write_text("\n".join([",".join(lines[0]), *shifted]))
    (truth,) = read_truth(tmp_path / "truth.csv", "m").paths
    places = zip(truth[::5, 0], FRAME.to_lonlat(truth[::5, 1:]).tolist(), strict=True)
    reports = [ais_line(start + time_s, place, mmsi) for time_s, place in places for mmsi in (7, 8)]
    (tmp_path / "ais.log").write_text("\n".join(reports))
    code, said = elusive_in(*TRACK, "--coast-sigma-m", "7", "--truth", "ais.log", "--truth-mmsi", "8")
    assert code == 0
    assert float(re.search(r"the end ([\d. ]+)", said)[1].split()[-1]) < 12  # the error, last on the track's line


@pytest.mark.thorough
def test_a_radar_off_the_chart_is_said(elusive_in: Run, tmp_path: Path) -> None:
    recording(elusive_in, tmp_path)
    west, south, east, north = np.array(lonlat((1000, -4000), (4000, 4000))).ravel().tolist()
    chart = json.loads((tmp_path / "coast.geojson").read_text()) | {"bbox": [west, south, east, north]}
    (tmp_path / "coast.geojson").write_text(json.dumps(chart))
    code, said = elusive_in(*TRACK, "--coast-sigma-m", "20")
    assert code == 0
    assert "The radar itself stands off the charts" in said
    assert "Plots on a chart 61 of 61, of them" in said


def plots(*lines: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        (folder / "plots.csv").write_text("\n".join(["time_s,range_m,bearing_deg,doppler_mps", *lines]))

    return spoil


def chart(text: str | bytes, name: str = "coast.geojson") -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        (folder / name).write_bytes(text.encode() if isinstance(text, str) else text)

    return spoil


def test_a_recording_without_ships(elusive_in: Run, tmp_path: Path) -> None:
    coast(tmp_path)
    plots("0,2000,40,1", "1,,,", "2,1500,200,")(tmp_path)
    code, said = elusive_in(*TRACK)
    assert code == 0
    assert "No ship was found" in said
    assert {path.name for path in (tmp_path / "deep/out").iterdir()} == {*WRITTEN} - {"scores.csv", "scores.json"}
    assert not len(read_tracks_csv(tmp_path / "deep/out/tracks.csv").rows)  # times without a track have no row
    assert json.loads((tmp_path / "deep/out/tracks.geojson").read_text())["features"] == []


def crossing(folder: Path) -> None:
    ring = lonlat((0, 0), (1000, 1000), (1000, 0), (0, 1000), (0, 0))
    (folder / "coast.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))


def missing_update(folder: Path) -> None:
    (folder / "AA5TEST.000").write_bytes(head())
    (folder / "AA5TEST.002").write_bytes(head(update=2, purpose=2))


def nothing(folder: Path) -> None:
    pass


CELL = ["--chart", "AA5TEST.000"]


@pytest.mark.parametrize(
    ("spoil", "options", "sentence"),
    [
        (chart("not a chart at all, " * 20, "AA5TEST.000"), CELL, "AA5TEST.000: is not an S-57 file"),
        (chart(head(records=9), "AA5TEST.000"), CELL, "AA5TEST.000: is cut short"),
        (missing_update, CELL, "update .001 is missing, .002 is there"),
        (crossing, [], "is no valid polygon (Self-intersection"),
        (chart("{}"), [], "coast.geojson"),
        (nothing, ["--chart", "none.000"], "none.000"),
        (nothing, ["--chart", "coast.geojson"], "coast.geojson: is given twice"),
        (nothing, ["--radar-lat-deg", "12"], "none of its 61 plots falls on a chart, seen from a radar at longitude 4"),
        (nothing, ["--radar-lat-deg", "95"], "(4, 95): is no longitude and latitude in degrees"),
        (nothing, ["--radar-lon-deg", "nan"], "(nan, 52): is no longitude and latitude in degrees"),
        (plots("0,3000,400,1"), [], "plots.csv, line 2, column bearing_deg: 400 is not from 0 to 360 degrees"),
        (plots("5,3000,40,1", "4,3000,40,1"), [], "plots.csv, line 3, column time_s: 4 comes after 5"),
        (plots("0,-3,40,1"), [], "column range_m: -3 is below 0"),
        (plots("0,3000,forty,1"), [], "column bearing_deg: 'forty' is no number"),
        (plots("0,3000,40"), [], "line 2: has 3 cells for 4 columns"),
        (plots(), [], "plots.csv: holds no plot"),
        (chart("", "plots.csv"), [], "plots.csv: is empty"),
        (chart("time,range\n1,2\n", "plots.csv"), [], "name them time_s,range_m,bearing_deg"),
        (nothing, ["--knowledge", "hard", "--tolerance", "0.01"], "--tolerance: has no meaning for knowledge 'hard'"),
        (nothing, ["--truth-mmsi", "4"], "--truth-mmsi: has no meaning without --truth"),
        (
            nothing,
            ["--coast-error", "fresh", "--coast-correlation-m", "9"],
            "coast_correlation_m: has no meaning for coast_error 'fresh'",
        ),
        (
            nothing,
            ["--coast-error", "bias", "--coast-share", ".5"],
            "coast_share: has no meaning for coast_error 'bias'",
        ),
        (
            nothing,
            ["--coast-error", "persistent", "--bias-sd-m", "9"],
            "bias_sd_m: has no meaning for coast_error 'persistent'",
        ),
        (
            nothing,
            ["--knowledge", "none", "--coast-error", "bias"],
            "coast_error: has no meaning for knowledge 'none'",
        ),
        (nothing, ["--particles", "3"], "particles: must be greater than or equal to 100"),
        (nothing, ["--coast-sigma-m", "0"], "coast_sigma_m: must be greater than 0"),
        (nothing, ["--rotation-s", "0"], "an antenna turns once in a positive number of seconds"),
        (nothing, ["--radar-code", "1", "2"], "chooses in an ASTERIX file"),
        (nothing, ["--truth", "none.csv"], "none.csv: cannot be read"),
        (chart("time_s,lon_deg,lat_deg\n0,4,95\n", "t.csv"), ["--truth", "t.csv"], "t.csv, 0 s: (4, 95)"),
        (chart("knowlege: field\n", "c.yaml"), ["--config", "c.yaml"], "did you mean 'knowledge'"),
        (nothing, ["--partikels", "5"], "No such option"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_nothing(
    elusive_in: Run, tmp_path: Path, spoil: Callable[[Path], None], options: list[str], sentence: str
) -> None:
    recording(elusive_in, tmp_path)
    spoil(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    code, said = elusive_in(*TRACK, *options)
    assert code == 2, said
    assert sentence in said
    assert "Traceback" not in said
    assert said.count("Error") == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_neither_a_chart_nor_the_radars_place_is_needed(elusive_in: Run, tmp_path: Path) -> None:
    """Then ships may be anywhere, and are in metres from the radar alone; what needs either says so."""
    recording(elusive_in, tmp_path)
    command = ["track", "radar", "plots.csv", "--truth", "truth.csv"]
    for out, more in (("out", []), ("placed", RADAR)):
        code, said = elusive_in(*command, *more, "--out", out)
        assert code == 0, said
        assert "One ship was found" in said
        assert "none, without a chart" in said
        assert ("tracks.geojson" in said) == (tmp_path / out / "tracks.geojson").exists() == (out == "placed")
    alone, placed = (read_tracks_csv(tmp_path / out / "tracks.csv").rows for out in ("out", "placed"))
    np.testing.assert_array_equal(alone["position"], placed["position"])
    ship = (tmp_path / "truth.csv").read_text().splitlines()
    (tmp_path / "degrees.csv").write_text("\n".join(["time_s,track,lon_deg,lat_deg", *ship[1:]]))
    for more, sentence in (
        (["--chart", "coast.geojson"], "--chart: plots.csv does not say where the radar is; give --radar-lat-deg"),
        (["--truth", "degrees.csv"], "degrees.csv: tells places in degrees, and not known is where the radar is"),
        (["--coast-sigma-m", "7"], "coast_sigma_m: says how a chart is used, and no chart is given; give --chart"),
    ):
        code, said = elusive_in("track", "radar", "plots.csv", *more, "--out", "refused")
        assert code == 2
        assert sentence in said
        assert not (tmp_path / "refused").exists()


@pytest.mark.parametrize(
    ("text", "options", "sentence"),
    [
        ("lon_deg,lat_deg\n4,52\n", [], "route.csv: holds 1 waypoints; a route needs two at least"),
        ("lon_deg,lat_deg\n4,52\n4,95\n", [], "route.csv, waypoint 2: (4, 95) is no longitude and latitude"),
        ("lon_deg,lat_deg,speed_mps\n4,52,-1\n4,53,2\n", [], "waypoint 1: its speed, -1 m/s, is not positive"),
        ("lon_deg,lat_deg\n4,52\n4,x\n", [], "route.csv, line 3, column lat_deg: 'x' is no number"),
        ("x,y\n4,52\n4,53\n", [], "name them lon_deg,lat_deg"),
        ("lon_deg,lat_deg\n4,52\n4,70\n", [], "route: reaches 2006 km from the radar"),
        ("lon_deg,lat_deg\n4,52\n4,52\n", [], "route: is sailed in 0 s"),
        ("lon_deg,lat_deg\n4,52\n4,53\n", ["--interval-s", "0.001"], "more than 1000000; give a greater speed"),
        ("lon_deg,lat_deg\n4,52\n4,52.01\n", ["--false-alarms", "2"], "max_range_m: is not given"),
        ("lon_deg,lat_deg\n4,52\n4,52.01\n", ["--radar-lat-deg", "-91"], "is no longitude and latitude in degrees"),
        ("lon_deg,lat_deg\n4,52\n4,52.01\n", ["--chart", "none.000"], "none.000"),
        ("lon_deg,lat_deg\n4,52\n4,52.01\n", ["--out", "route.csv"], "is a file; give the name of a folder"),
    ],
)
def test_a_bad_route_is_one_sentence_and_leaves_nothing(
    elusive_in: Run, tmp_path: Path, text: str, options: list[str], sentence: str
) -> None:
    (tmp_path / "route.csv").write_text(text)
    code, said = elusive_in("simulate", "radar", "--route", "route.csv", *RADAR, "--out", "made", *options)
    assert code == 2, said
    assert sentence in said
    assert said.count("Error") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["route.csv"]


def test_simulation_is_the_same_for_the_same_seed(elusive_in: Run, tmp_path: Path) -> None:
    found = []
    for seed in (5, 5, 6):
        SAILED.clear()
        recording(elusive_in, tmp_path, "--seed", seed)
        found.append((tmp_path / "plots.csv").read_bytes())
    assert found[0] == found[1] != found[2]


def test_ctrl_c_leaves_nothing(elusive_in: Run, ctrl_c: Callable[[int], list[int]], tmp_path: Path) -> None:
    coast(tmp_path)
    plots(*[f"{k},3000,40,0" for k in range(20)])(tmp_path)
    before, scans = sorted(tmp_path.iterdir()), ctrl_c(10)
    code, said = elusive_in(*TRACK)
    assert code == 130
    assert len(scans) == 10  # in the middle of it
    assert "Traceback" not in said
    assert "Written" not in said
    assert sorted(tmp_path.iterdir()) == before


def test_help_names_what_the_documentation_names(elusive_in: Run) -> None:
    said = " ".join(
        elusive_in(*command, "--help")[1] for command in (("track", "radar"), ("simulate", "radar"), ("chart",))
    )
    page = (Path(__file__).parents[2] / "docs" / "radar.md").read_text(encoding="utf-8")
    named = {*re.findall(r"--[a-z][a-z0-9-]+", page)}
    assert {"--knowledge", "--coast-error", "--rotation-s", "--truth-mmsi"} < named
    for flag in named:
        assert re.search(rf"{flag}\b", said), flag
