"""`elusive track bearings` and `elusive locate` as a user types them: a made-up flight, live and from a file."""

from __future__ import annotations

import io
import json
import re
import signal
import sys
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
import xarray as xr

from elusive.geometry.local_frame import LocalFrame
from elusive.results import read_tracks_csv
from tests.bearing_flight import STEPS, path, write_flight
from tests.commands import ran
from tests.filters.gaussian.test_range_bank import past
from tests.json_lines import json_lines
from tests.longer import longer

TOLD = ("--q", "1", "--bias-sd-deg", "0.1")  # not sought, which takes most of a run
WRITTEN = {
    "checks.json",
    "config.yaml",
    "report.html",
    "report.png",
    "result.nc",
    "scores.csv",
    "scores.json",
    "tracks.csv",
}


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    return write_flight(tmp_path_factory.mktemp("flat"))


@pytest.fixture(scope="module")
def solid(tmp_path_factory):
    return write_flight(tmp_path_factory.mktemp("solid"), solid=True)


def run(capsys, *arguments, command=("track", "bearings")):
    return ran(capsys, *command, *arguments)


def usual(folder, *more):
    return (folder / "bearings.csv", "--sensors", folder / "sensors.csv", "--sigma-deg", "0.5", *more)


def test_a_recording_is_tracked_and_scored(flight, tmp_path, capsys):
    out = tmp_path / "out"
    code, said = run(capsys, *usual(flight, "--filter", "fg-ekf", "--truth", flight / "truth.csv", "--out", out))
    assert code == 0, said
    assert {file.name for file in out.iterdir()} == WRITTEN
    assert "RMSE from the truth" in said
    assert "fg-ekf is as its paper has it" in said
    log = read_tracks_csv(out / "tracks.csv")
    times, states = path()
    assert np.isin(log.rows["time_s"], times).all()
    off = log.rows["position"] - states[log.rows["step"] + STEPS - len(log.rows)][:, [0, 2]]
    assert np.hypot(*off.T).mean() < 3
    assert np.isnan(log.rows["existence"]).all()


def test_heights_from_elevations(solid, tmp_path, capsys):
    out = tmp_path / "out"
    code, said = run(capsys, *usual(solid, "--truth", solid / "truth.csv", "--out", out))
    assert code == 0, said
    assert {file.name for file in out.iterdir()} == WRITTEN
    assert "Error in space" in said
    heights = np.genfromtxt(out / "tracks.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    z = path(solid=True)[1][:, 4]
    assert np.sqrt(np.mean((heights["z_m"] - z) ** 2)) < 0.5
    assert (np.abs(heights["z_m"] - z) < 5 * heights["sd_z_m"]).all()
    with xr.open_dataset(out / "result.nc") as dataset:
        np.testing.assert_array_equal(dataset["z"], heights["z_m"])
        assert dataset.sizes["bearing"] == 3 * STEPS


def test_the_same_numbers_again_from_the_config(flight, tmp_path, capsys):
    first, again = tmp_path / "first", tmp_path / "again"
    assert run(capsys, *usual(flight, "--q", "3", "--loss", "huber", "--bias-sd-deg", "0.1", "--out", first))[0] == 0
    code, said = run(
        capsys, flight / "bearings.csv", "--sensors", flight / "sensors.csv", "--config", first / "config.yaml",
        "--out", again,
    )  # fmt: skip
    assert code == 0, said
    assert (first / "tracks.csv").read_bytes() == (again / "tracks.csv").read_bytes()


def test_live_from_standard_input_is_the_recording(flight, tmp_path, capsys, monkeypatch):
    whole, live = tmp_path / "whole", tmp_path / "live"
    told = ("--filter", "iekf", *TOLD)  # live nothing persists that is not told
    assert run(capsys, *usual(flight, *told, "--out", whole))[0] == 0
    text = (flight / "bearings.csv").read_bytes()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text)))
    code, said = run(capsys, "-", *usual(flight, *told, "--follow", "--out", live)[1:])
    assert code == 0, said
    lines, summary = json_lines(said)
    assert summary["steps"] == len(lines) == STEPS
    rows = [(line["time_s"], track["x_m"], track["sd_y_m"]) for line in lines for track in line["tracks"]]
    written = read_tracks_csv(live / "tracks.csv").rows
    deviation = np.sqrt(written["covariance"][:, 1, 1])
    np.testing.assert_allclose(rows, np.column_stack([written["time_s"], written["position"][:, 0], deviation]))
    told, known = ((folder / "tracks.csv").read_text().splitlines() for folder in (live, whole))
    # until it is checked nothing is told as sure
    assert [line.replace("candidate", "confirmed") for line in told] == known
    assert [number for number, line in enumerate(told) if "candidate" in line] == list(range(1, 15))
    assert {file.name for file in live.iterdir()} == {"checks.json", "config.yaml", "tracks.csv"}


@pytest.mark.thorough
def test_live_heights_and_an_earlier_run(solid, tmp_path, capsys, monkeypatch):
    out = tmp_path / "live"
    text = (solid / "bearings.csv").read_bytes()
    for code_expected in (0, 2):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text)))
        code, said = run(capsys, "-", *usual(solid, "--follow", "--out", out)[1:])
        assert code == code_expected, said
    assert "of an earlier run; name another folder" in said
    assert "filter: fixed-lag" in " ".join((out / "config.yaml").read_text().split()).replace("kind: ", "filter: ")
    lines = (out / "tracks.csv").read_text().splitlines()
    assert lines[0].endswith(",z_m,vz_mps,sd_z_m")
    assert len(lines) == STEPS + 1


class Interrupting(io.BytesIO):
    """Standard input during which Ctrl-C is pressed, once all lines are read."""

    def readinto(self, buffer):
        read = super().readinto(buffer)
        if not read:
            signal.raise_signal(signal.SIGINT)
        return read


@pytest.mark.thorough
def test_interrupted_while_it_follows_it_leaves_whole_files(flight, tmp_path, capsys, monkeypatch):
    out = tmp_path / "live"
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(Interrupting((flight / "bearings.csv").read_bytes())))
    code, said = run(capsys, "-", *usual(flight, "--filter", "iekf", *TOLD, "--follow", "--out", out)[1:])
    assert code == 0, said
    assert "Interrupted." in said
    # the last time is whole once the lines end, which the signal may come before or after
    assert len(read_tracks_csv(out / "tracks.csv").rows) in (STEPS - 1, STEPS)


def changed(flight, tmp_path, change):
    lines = (flight / "bearings.csv").read_text().splitlines()
    file = tmp_path / "spoilt.csv"
    file.write_text("\n".join(change(lines)) + "\n")
    return file


SPOILT = {
    "unknown sensor": (lambda lines: [*lines, "99,rof,12"], "line 122: there is no sensor 'rof'; did you mean 'roof'?"),
    "missing column": (lambda lines: ["time_s,azimuth_deg", *lines[1:]], "line 1: the columns are"),
    "too large": (lambda lines: [*lines, "99,roof,412"], "line 122, column azimuth_deg: 412 is not from -360 to 360"),
    "back in time": (lambda lines: [*lines, "3,roof,12"], "line 122, column time_s: 3 comes after 19.5"),
    "empty": (lambda lines: [], "is empty; write time_s,sensor,azimuth_deg"),
    "no bearing": (lambda lines: lines[:1], "holds no bearing"),
    "no number": (lambda lines: [*lines, "99,roof,north"], "column azimuth_deg: 'north' is no number"),
    "text": (lambda lines: ["Dear all,", "the bearings are attached."], "line 1: the columns are"),
}


@pytest.mark.parametrize("name", SPOILT)
def test_spoilt_bearings_are_one_sentence(flight, tmp_path, capsys, name):
    change, sentence = SPOILT[name]
    file, out = changed(flight, tmp_path, change), tmp_path / "out"
    code, said = run(capsys, file, "--sensors", flight / "sensors.csv", "--out", out)
    assert code == 2
    assert sentence in said
    assert said.count("Error:") == 1
    assert not out.exists()


@pytest.mark.parametrize("name", longer(SPOILT, "too large", "no number", "unknown sensor"))
def test_live_a_spoilt_line_is_left_out_and_a_spoilt_table_refused(flight, tmp_path, capsys, name):
    change, sentence = SPOILT[name]
    file, out = changed(flight, tmp_path, change), tmp_path / "out"
    live = ("--follow", "--idle-s", "0", "--filter", "iekf", *TOLD)
    code, said = run(capsys, file, *usual(flight, *live, "--out", out)[1:])
    late = "A measurement of 3 s comes after 19.5 s. It is left out."
    assert (late if name == "back in time" else sentence) in said
    whole = name in ("missing column", "empty", "no bearing", "text")
    assert code == (2 if whole else 0), said
    if not whole:
        summary = json_lines(said)[1]
        assert (summary["steps"], summary.get("late", 0) + summary.get("spoilt", 0)) == (STEPS, 1)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--filter", "map", "--follow"), "--filter map: needs all bearings; live, take fixed-lag or iekf"),
        (("--filter", "rts", "--motion", "imm"), "--motion imm: is filtered, and rts does not take it"),
        (
            ("--filter", "fg-eks", "--bias-sd-deg", "1"),
            "--bias-sd-deg: has no meaning for filter 'fg-eks', only for map",
        ),
        (("--motion", "ctrv", "--q", "1"), "--q: has no meaning for motion 'ctrv', only for cv, ca, ct"),
        (("--motion", "cv", "--q-turn", "1"), "--q-turn: has no meaning for motion 'cv', only for ctrv"),
        (("--filter", "map", "--lag-s", "1"), "--lag-s: has no meaning for filter 'map', only for fixed-lag"),
        (("--elevations", "ignore", "--q-vertical", "1"), "--q-vertical: has no meaning for elevations 'ignore'"),
        (("--idle-s", "3"), "--idle-s: has no meaning without --follow"),
        (("--follow", "--truth", "t.csv"), "--truth: has no meaning with --follow"),
        (("--truth", "nowhere.csv"), "nowhere.csv: cannot be read"),
    ],
)
def test_what_cannot_be_done_is_said(flight, tmp_path, capsys, arguments, sentence):
    out = tmp_path / "out"
    code, said = run(capsys, *usual(flight, *arguments, "--out", out))
    assert code == 2
    assert sentence in said
    assert not out.exists()


def test_one_sensor_alone_is_warned_of(flight, tmp_path, capsys):
    alone = changed(
        flight, tmp_path, lambda lines: [line for line in lines if "roof" not in line and "van" not in line]
    )
    code, said = run(capsys, alone, "--sensors", flight / "sensors.csv", "--out", tmp_path / "alone")
    assert code == 0
    assert "all bearings are of sensor 'mast'; one sensor gives no distance" in said
    assert "sure to" not in said
    assert "one sensor gives no distance" in (tmp_path / "alone" / "report.html").read_text()


def test_an_emitter_is_located(flight, tmp_path, capsys):
    bearings = tmp_path / "still.csv"
    lines = (flight / "bearings.csv").read_text().splitlines()
    bearings.write_text("\n".join(lines[:4]) + "\n")
    out, sensors = tmp_path / "out", flight / "sensors.csv"
    code, said = run(capsys, bearings, "--sensors", sensors, "--out", out, "--sigma-deg", "0.5", command=("locate",))
    assert code == 0, said
    written = {"checks.json", "config.yaml", "emitter.csv", "emitter.geojson", "emitter.png"}
    assert {file.name for file in out.iterdir()} == written
    table = np.genfromtxt(out / "emitter.csv", delimiter=",", names=True)
    assert np.hypot(table["x_m"] - 20, table["y_m"] - 30) < 4 * np.hypot(table["sd_x_m"], table["sd_y_m"])
    local = json.loads((out / "emitter.geojson").read_text())
    point, ellipse = local["features"]
    assert local["coordinate_system"] == "local metres: x east, y north"
    assert point["geometry"]["coordinates"] == [table["x_m"], table["y_m"]]
    ring = np.array(ellipse["geometry"]["coordinates"][0])
    assert (ring[0] == ring[-1]).all()
    half = np.hypot(*(ring - ring[:-1].mean(axis=0)).T)
    assert half.max() == pytest.approx(table["semi_major_m"], rel=1e-2)
    pytest.importorskip("pyproj")
    code, said = run(
        capsys,
        bearings,
        "--sensors",
        sensors,
        "--out",
        out,
        "--origin-lat-deg",
        60,
        "--origin-lon-deg",
        10,
        command=("locate",),
    )
    assert code == 0, said
    placed = json.loads((out / "emitter.geojson").read_text())
    assert "coordinate_system" not in placed
    lon, lat = placed["features"][0]["geometry"]["coordinates"]
    table = np.genfromtxt(out / "emitter.csv", delimiter=",", names=True)
    assert (lat - 60) * 111_412 == pytest.approx(table["y_m"], rel=1e-3)
    assert (lon - 10) * 55_800 == pytest.approx(table["x_m"], rel=1e-3)
    x, y = table["x_m"], table["y_m"]
    assert f"{x:.2f} m east, {y:.2f} m north" in said


def test_two_bearings_without_a_noise_have_no_ellipse(flight, tmp_path, capsys):
    two, out = tmp_path / "two.csv", tmp_path / "out"
    two.write_text("\n".join((flight / "bearings.csv").read_text().splitlines()[:3]) + "\n")
    code, said = run(capsys, two, "--sensors", flight / "sensors.csv", "--out", out, command=("locate",))
    assert code == 0
    assert "Two bearings always cross" in said
    assert len(json.loads((out / "emitter.geojson").read_text())["features"]) == 1
    assert ",,," in (out / "emitter.csv").read_text()


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        (["0,mast,30", "1,mast,31"], "all are taken at one place, which gives a direction and no distance"),
        (["0,mast,30", "0,roof,30"], "are parallel, and parallel lines cross nowhere"),
        (["0,mast,300", "0,roof,60"], "diverge"),
        (["0,mast,.3", "0,roof,6", "0,van,2"], ""),
    ],
)
def test_what_tells_no_place_is_said(flight, tmp_path, capsys, rows, sentence):
    file, out = tmp_path / "few.csv", tmp_path / "out"
    file.write_text("\n".join(["time_s,sensor,azimuth_deg", *rows]) + "\n")
    code, said = run(capsys, file, "--sensors", flight / "sensors.csv", "--out", out, command=("locate",))
    if sentence:
        assert code == 2
        assert sentence in said
        assert not out.exists()
    else:
        assert "look like radians" in said or code == 2
    code, said = run(
        capsys, file, "--sensors", flight / "sensors.csv", "--origin-lat-deg", "3", "--out", out, command=("locate",)
    )
    assert code == 2
    assert "one is missing; give both or none" in said


@pytest.mark.thorough
def test_simulated_emitters_are_tracked_as_the_command_says(flight, tmp_path, capsys, monkeypatch):
    ways = [tmp_path / f"way{k}.csv" for k in range(2)]
    for way, corners in zip(ways, ("-50,20\n60,60", "60,-40\n-40,40"), strict=True):
        way.write_text(f"x_m,y_m\n{corners}\n")
    out, sensors = tmp_path / "made", flight / "sensors.csv"
    paths = ("--path", ways[0], "--path", ways[1], "--speed-mps", "10", "--outlier-probability", "0")
    heard = ("--sigma-deg", "0.5", "--detection-probability", "0.9", "--false-bearings", "1")
    code, said = run(capsys, "--sensors", sensors, *paths, *heard, "--out", out, command=("simulate", "bearings"))
    assert code == 0, said
    assert {file.name for file in out.iterdir()} == {"bearings.csv", "truth.csv", "sensors.csv", "simulation.yaml"}
    assert (out / "truth.csv").read_text().startswith("time_s,track,x_m,y_m")
    command = re.search(r"To track: elusive (track bearings .*? --out )tracks", said)[1].split()
    code, said = run(capsys, *command[2:], tmp_path / "tracked")
    assert code == 0, said
    assert "2 emitters found" in said
    assert "several: a sensor has up to" in said
    assert {file.name for file in (tmp_path / "tracked").iterdir()} == WRITTEN | {"scores.json", "scores.csv"}
    log = read_tracks_csv(tmp_path / "tracked" / "tracks.csv")
    assert np.median(log.rows["existence"][log.rows["step"] > 10]) > 0.99
    assert "detection_probability: 0." in (tmp_path / "tracked" / "config.yaml").read_text()  # as it was found
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO((out / "bearings.csv").read_bytes())))
    live = ("--sensors", sensors, "--sigma-deg", "0.5", "--follow", "--out", tmp_path / "live")
    code, said = run(capsys, "-", *live)
    assert code == 0, said
    assert "Emitters: several" in said
    assert len(np.unique(read_tracks_csv(tmp_path / "live" / "tracks.csv").rows["track"])) >= 2
    again = tmp_path / "again"
    code, said = run(capsys, "--config", out / "simulation.yaml", "--out", again, command=("simulate", "bearings"))
    assert code == 0, said
    assert (again / "bearings.csv").read_bytes() == (out / "bearings.csv").read_bytes()
    for more, sentence in (
        (("--emitters", "several", "--filter", "iekf"), "--filter iekf: is of one emitter"),
        (("--emitters", "several", "--motion", "imm"), "--motion imm: is of one emitter"),
        (("--particles", "100", "--emitters", "one"), "--particles: has no meaning for emitters 'one'"),
    ):
        code, said = run(capsys, out / "bearings.csv", "--sensors", sensors, *more, "--out", tmp_path / "none")
        assert code == 2
        assert sentence in said
    averaged = ("--sensors", sensors, "--sigma-deg", "0.5", "--emitters", "one", "--out", tmp_path / "one")
    code, said = run(capsys, out / "bearings.csv", *averaged)
    assert code == 0, said
    assert "which is not to be relied on" in said
    assert "sure to" not in said


def test_labelled_emitters_are_tracked_each_by_itself(flight, tmp_path, capsys):
    lines = (flight / "bearings.csv").read_text().splitlines()[1:]
    file = tmp_path / "labelled.csv"
    both = [f"{line},{name}" for line in lines for name in ("fox", "hare")]
    file.write_text("\n".join(["time_s,sensor,azimuth_deg,emitter", *both]) + "\n")
    alone, out = tmp_path / "alone", tmp_path / "out"
    assert run(capsys, *usual(flight, "--filter", "iekf", *TOLD, "--out", alone))[0] == 0
    known = ("--sensors", flight / "sensors.csv", "--sigma-deg", "0.5")
    code, said = run(capsys, file, *known, "--filter", "iekf", *TOLD, "--out", out)
    assert code == 0, said
    assert "2 emitters found" in said
    assert "Fox" in said
    rows, one = read_tracks_csv(out / "tracks.csv").rows, read_tracks_csv(alone / "tracks.csv").rows
    for number in (1, 2):
        np.testing.assert_array_equal(rows["position"][rows["track"] == number], one["position"])
    assert np.isnan(rows["existence"]).all()
    for more, sentence in (
        (("--emitters", "several"), "tells apart what the column emitter tells already"),
        (("--follow", "--idle-s", "0"), "names emitters in its column emitter; here one is needed"),
    ):
        code, said = run(capsys, file, *known, *more, "--out", tmp_path / "none")
        assert code == 2
        assert sentence in said
    file.write_text("\n".join(["time_s,sensor,azimuth_deg,emitter", *both, "99,mast,3,"]) + "\n")
    code, said = run(capsys, file, *known, "--out", tmp_path / "none")
    assert code == 2
    assert "column emitter: is empty; name the emitter, or drop the column" in said


@pytest.mark.thorough
def test_two_emitters_heard_one_at_a_time_are_not_taken_for_one_that_is_sure(flight, tmp_path, capsys):
    """No sensor has two bearings at a time: the residuals alone tell."""
    lines = (flight / "bearings.csv").read_text().splitlines()
    turned = [f"{t},{name},{(float(angle) + 70) % 360}" if k % 2 else f"{t},{name},{angle}"
              for k, (t, name, angle) in enumerate(line.split(",") for line in lines[1:])]  # fmt: skip
    file = tmp_path / "two.csv"
    file.write_text("\n".join([lines[0], *turned]) + "\n")
    code, said = run(capsys, file, "--sensors", flight / "sensors.csv", "--sigma-deg", "0.5", "--out", tmp_path / "out")
    assert code == 0, said
    assert "no sensor has two bearings at a time" in said
    assert "further than 5 deviations from the track" in said
    assert "sure to" not in said


def test_arrivals_are_tracked_and_located_from_a_table(flight, tmp_path, capsys):
    states, out = path()[1], tmp_path / "out"
    known = ("--sensors", flight / "sensors.csv", "--sigma-s", "1e-9", "--emission-known")
    code, said = run(capsys, flight / "arrivals.csv", *known, "--truth", flight / "truth.csv", "--out", out)
    assert code == 0, said
    assert {file.name for file in out.iterdir()} == WRITTEN
    assert float(re.search(r"; ([\d.]+) m RMSE from the truth", said)[1]) < 0.3
    first = tmp_path / "first.csv"
    first.write_text("\n".join((flight / "arrivals.csv").read_text().splitlines()[:4]) + "\n")
    code, said = run(capsys, first, *known[:-1], "--out", tmp_path / "place", command=("locate",))
    assert code == 0, said
    found = np.genfromtxt(tmp_path / "place" / "emitter.csv", delimiter=",", names=True)
    assert np.hypot(found["x_m"] - states[0, 0], found["y_m"] - states[0, 2]) < 0.2


@pytest.mark.thorough
def test_times_may_be_dates(flight, tmp_path, capsys):
    quick = ("--filter", "iekf", *TOLD)
    header, *rows = (flight / "bearings.csv").read_text().splitlines()
    begun = datetime(2026, 5, 1, 12, tzinfo=UTC)
    dated = [((begun + timedelta(seconds=float(t))).isoformat(), rest) for t, rest in (r.split(",", 1) for r in rows)]
    lines = [header.replace("time_s", "time"), *(",".join(cells) for cells in dated)]
    (tmp_path / "dated.csv").write_text("\n".join(lines) + "\n")
    code, said = run(capsys, tmp_path / "dated.csv", *usual(flight, *quick)[1:], "--out", tmp_path / "out")
    assert code == 0, said
    code, said = run(capsys, *usual(flight, *quick), "--out", tmp_path / "plain")
    assert code == 0, said
    found, plain = (read_tracks_csv(tmp_path / of / "tracks.csv").rows for of in ("out", "plain"))
    np.testing.assert_allclose(found["time_s"] - begun.timestamp(), plain["time_s"], atol=1e-5)
    np.testing.assert_allclose(found["position"], plain["position"], atol=1e-3)


@pytest.mark.parametrize("geographic", longer([False, True], True))
def test_a_sensor_that_moves_tells_its_places_in_its_lines(tmp_path, capsys, geographic):
    """One receiver that turns: the emitter is at its distance, in its ellipse, and not on the receiver."""
    _, places, truth, sets = past(1)
    frame = LocalFrame.at(5.0, 53.0)
    corners = frame.to_lonlat(places[:, :2]) if geographic else places[:, :2]
    rows = [f"{one.time_s},own,{np.rad2deg(one.azimuth_rad[0]) % 360:.6f},{x:.9f},{y:.9f}"
            for one, (x, y) in zip(sets, corners.tolist(), strict=True)]  # fmt: skip
    names = "lon_deg,lat_deg" if geographic else "x_m,y_m"
    file, out = tmp_path / "bearings.csv", tmp_path / "out"
    file.write_text("\n".join([f"time_s,sensor,azimuth_deg,{names}", *rows]) + "\n")
    code, said = run(capsys, file, "--sigma-deg", "0.5", "--out", out)
    assert code == 0, said
    assert "one sensor alone" not in said
    assert "were all azimuths 0.5 degrees off" in said
    log = read_tracks_csv(out / "tracks.csv")
    off = log.rows["position"][:, :2] - (truth - places[0, :2] * geographic)
    assert np.median(np.hypot(*off.T)) < 0.35 * 6000
    assert (out / "tracks.geojson").is_file() == geographic
    if geographic:
        drawn = json.loads((out / "tracks.geojson").read_text())["features"][0]["geometry"]["coordinates"]
        origin = LocalFrame.at(*corners[0])
        np.testing.assert_allclose(origin.to_local(np.array(drawn)), log.rows["position"][:, :2], atol=1.0)
    assert np.median(np.hypot(*(log.rows["position"][:, :2] - places[:, :2]).T)) > 3000
    code, said = run(capsys, file, "--sigma-deg", "0.5", "--filter", "iekf", "--out", tmp_path / "live")
    assert code == 0, said
    assert "bearings.alone" in said
    bare = tmp_path / "bare.csv"
    bare.write_text("time_s,sensor,azimuth_deg\n0,own,3\n")
    code, said = run(capsys, bare, "--out", tmp_path / "none")
    assert code == 2
    assert "--sensors: is missing" in said
