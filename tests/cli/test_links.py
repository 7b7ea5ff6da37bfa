"""`elusive track links` as a user types it: a made-up network, live and from a file, and what cannot be used."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from elusive.results import STATUSES, read_tracks_csv
from tests.commands import ran
from tests.json_lines import json_lines
from tests.longer import longer
from tests.processes import HUNG_S, wait_until
from tests.walked_room import EMPTY, FRAMES, all_missing, changed, walker, write_room


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    return write_room(tmp_path_factory.mktemp("network"))


def run(capsys, *arguments):
    return ran(capsys, "track", "links", *arguments)


def usual(network, *more):
    return (network / "log.csv", "--nodes", network / "nodes.csv", "--calibration-frames", EMPTY, *more)


@pytest.mark.thorough
def test_rows_of_receivers_are_tracked_as_a_table_is(network, tmp_path, capsys):
    """One channel of the room, as nodes that pass a token write it: a row a receiver, its own level 127."""
    header, *lines = ([*line.split(",")] for line in (network / "log.csv").read_text().splitlines())
    kept = [0, *(k for k, name in enumerate(header) if name.endswith("-11"))]
    table = tmp_path / "table.csv"
    table.write_text("".join(",".join(cells[k] for k in kept) + "\n" for cells in (header, *lines)))
    names, column = [f"n{k}" for k in range(8)], {name: k for k, name in enumerate(header)}
    rows = tmp_path / "rows.csv"
    rows.write_text(
        "".join(
            ",".join([rx, *("127" if tx == rx else cells[column[f"{tx}-{rx}-11"]] for tx in names), cells[0]]) + "\n"
            for cells in lines
            for rx in names
        )
    )
    more = "--nodes", network / "nodes.csv", "--calibration-frames", EMPTY, "--fit-frames", 0, "--out"
    for log, out in ((table, "one"), (rows, "two")):
        layout = ("--layout", "receiver") if log is rows else ()
        code, said = run(capsys, log, *layout, *more, tmp_path / out)
        assert code == 0, said
    one, two = ((tmp_path / out / "tracks.csv").read_text() for out in ("one", "two"))
    assert one.count("confirmed") > 10
    assert one == two


@pytest.mark.thorough
def test_an_empty_room_recorded_at_another_time_calibrates(network, tmp_path, capsys):
    """The log cut in two, the first part's clock three hours off: the same tracks."""

    def later(line):
        time_s, _, rest = line.partition(",")
        return f"{float(time_s) + 10_800},{rest}"

    header, *lines = (network / "log.csv").read_text().splitlines()
    room, walk = tmp_path / "room.csv", tmp_path / "walk.csv"
    room.write_text("\n".join([header, *map(later, lines[:EMPTY])]) + "\n")
    walk.write_text("\n".join([header, *lines[EMPTY:]]) + "\n")
    code, said = run(capsys, *usual(network, "--fit-frames", 0, "--out", tmp_path / "one"))
    assert code == 0, said
    asked = walk, "--nodes", network / "nodes.csv", "--fit-frames", 0, "--out"
    code, said = run(capsys, *asked, tmp_path / "two", "--empty", room)
    assert code == 0, said
    one, two = ((tmp_path / out / "tracks.csv").read_text() for out in ("one", "two"))
    assert one.count("confirmed") > 10
    assert one == two
    room.write_text("\n".join([header, lines[0]]) + "\n")
    code, said = run(capsys, *asked, tmp_path / "three", "--empty", room)
    assert code == 2
    assert "record at least two of the empty room" in said
    code, said = run(capsys, *asked, tmp_path / "three", "--empty", room, "--follow")
    assert code == 2
    assert "--empty: calibrates a recorded log" in said


@pytest.mark.parametrize("method", ["links", "image"])
def test_somebody_crosses_the_room(network, tmp_path, capsys, method):
    out = tmp_path / "out"
    code, said = run(capsys, *usual(network, "--method", method, "--truth", network / "truth.csv", "--out", out))
    assert code == 0, said
    assert ("At most one person at a time, in one track" in said) or method == "image"  # an image has ghosts
    written = {
        "checks.json",
        "config.yaml",
        "events.csv",
        "report.html",
        "report.png",
        "result.nc",
        "tracks.csv",
        "scores.json",
        "scores.csv",
    }
    assert {path.name for path in out.iterdir()} == written
    rows = read_tracks_csv(out / "tracks.csv").rows
    assert rows["time_s"].min() >= 20
    assert np.isnan(rows["existence"]).all() == (method == "image")  # a tracker of heads knows a score alone
    errors = {}
    for row in rows[(rows["status"] == STATUSES.index("confirmed")) & (rows["time_s"] >= 23)]:
        error, time_s = np.hypot(*(row["position"] - walker(round(2 * row["time_s"])))), float(row["time_s"])
        errors[time_s] = min(error, errors.get(time_s, np.inf))
    assert len(errors) >= 0.9 * (FRAMES - 46)
    assert np.mean(list(errors.values())) < 1.0  # a third of the distance between nodes
    events = (out / "events.csv").read_text().splitlines()
    assert events[0] == "time_s,track,event,x_m,y_m"
    assert any(",confirmed," in line for line in events)
    assert "MOTA" in said


@pytest.mark.thorough
def test_the_same_numbers_again_from_the_config(network, tmp_path, capsys):
    first, again = tmp_path / "first", tmp_path / "again"
    assert run(capsys, *usual(network, "--seed", 7, "--out", first))[0] == 0
    code, said = run(
        capsys, network / "log.csv", "--nodes", network / "nodes.csv", "--config", first / "config.yaml", "--out", again
    )
    assert code == 0, said
    assert (first / "tracks.csv").read_bytes() == (again / "tracks.csv").read_bytes()


def test_live_from_standard_input_is_the_same(network, tmp_path, capsys, monkeypatch):
    whole, live = tmp_path / "whole", tmp_path / "live"
    assert run(capsys, *usual(network, "--fit-frames", 0, "--out", whole))[0] == 0  # live, nothing can be fitted first
    octets = io.TextIOWrapper(io.BytesIO((network / "log.csv").read_bytes()))
    monkeypatch.setattr(sys, "stdin", octets)
    code, said = run(
        capsys, "-", "--nodes", network / "nodes.csv", "--calibration-frames", EMPTY, "--follow", "--out", live
    )
    assert code == 0, said
    assert "Calibrating on the first 30 frames, with nobody inside" in said
    lines, summary = json_lines(said)
    assert [line["calibrating"] for line in lines] == [True] * EMPTY + [False] * (FRAMES - EMPTY)
    assert summary["steps"] == len(lines) == FRAMES
    assert summary["ended"] == "source ended"
    events = (live / "events.csv").read_text().splitlines()[1:]
    told = [(line["time_s"], event) for line in lines for event in line["events"]]
    assert [f"{t!r},{e['track']},{e['event']},{e['x_m']!r},{e['y_m']!r}" for t, e in told] == events
    assert (live / "tracks.csv").read_bytes() == (whole / "tracks.csv").read_bytes()
    assert (live / "events.csv").read_bytes() == (whole / "events.csv").read_bytes()


@pytest.mark.thorough
def test_a_growing_file_is_followed_and_ctrl_c_ends_it(network, tmp_path):
    lines = (network / "log.csv").read_text().splitlines(keepends=True)
    log, out = tmp_path / "log.csv", tmp_path / "out"
    log.write_text("".join(lines[: EMPTY + 20]))
    process = subprocess.Popen(
        [sys.executable, "-m", "elusive", "track", "links", str(log), "--nodes", str(network / "nodes.csv"),
         "--calibration-frames", str(EMPTY), "--follow", "--out", str(out)],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip

    def tracked(frame):
        """Whether the row of a frame, a half second each, is written."""
        return (out / "tracks.csv").exists() and f"\n{frame / 2!r}," in (out / "tracks.csv").read_text()

    try:
        wait_until(lambda: tracked(EMPTY + 18), process)
        with log.open("a") as file:
            file.write("".join(lines[EMPTY + 20 : EMPTY + 30]))
        wait_until(lambda: tracked(EMPTY + 28), process)
        os.kill(process.pid, signal.SIGINT)
        _, said = process.communicate(timeout=HUNG_S)
    finally:
        process.kill()
    assert process.returncode == 0
    assert f"{EMPTY + 29} tracked; from its coming to its tracks" in said
    assert "Traceback" not in said


def test_an_earlier_runs_tracks_are_not_overwritten_live(network, tmp_path, capsys):
    (tmp_path / "tracks.csv").write_text("precious")
    code, said = run(capsys, *usual(network, "--follow", "--idle-s", 0.1, "--out", tmp_path))
    assert code == 2
    assert "is there already, of an earlier run; name another folder" in said
    assert (tmp_path / "tracks.csv").read_text() == "precious"


def without_a_column(lines):
    return [lines[0], lines[1].rsplit(",", 1)[0], *lines[2:]]


def with_text(lines):
    return [*lines[:5], "oops" + lines[5][lines[5].index(",") :], *lines[6:]]


def backwards(lines):
    return [*lines[:5], lines[9], lines[6], *lines[7:]]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (without_a_column, "changed.csv, line 2"),
        (with_text, "changed.csv, line 6"),
        (backwards, "times must go forwards"),
        (all_missing, "has no reading"),
        (lambda lines: lines[:EMPTY], "all of them taken for calibration; take fewer"),
        (lambda lines: [""], "is empty"),
        (lambda lines: [lines[0].replace("n0-", "nobody-"), *lines[1:]], "nobody"),
    ],
    ids=["column", "text", "backwards", "missing", "calibration", "empty", "unknown-node"],
)
def test_a_log_that_cannot_be_used(network, tmp_path, capsys, change, sentence):
    out = tmp_path / "out"
    log = changed(network, tmp_path, change)
    code, said = run(capsys, log, "--nodes", network / "nodes.csv", "--calibration-frames", EMPTY, "--out", out)
    assert code == 2
    assert sentence in said
    assert not out.exists()


@pytest.mark.parametrize(
    ("nodes", "more", "sentence"),
    [
        ("node,x_m,y_m\na,0,0\nb,0,0\n", (), "stand in one place"),
        ("node,x_m,y_m\na,0,0\n", (), "holds 1 nodes"),
        (None, ("--area", 1, 0, 0, 1), "give the lower bound first"),
        (None, ("--area", 0, 1, 0, 1, "--area-file", "x"), "give one of them"),
        (None, ("--area-file", "nowhere.csv"), "cannot be read"),
        (None, ("--idle-s", 3), "without --follow"),
        (None, ("--layout", "diagonal"), "diagonal"),
        (None, ("--follow", "--truth", "t.csv"), "no meaning with --follow"),
        (None, ("--truth", "nowhere.csv"), "cannot be read"),
        (None, ("--method", "links", "--voxel-m", 1.0), "--method image"),
    ],
)
def test_options_that_cannot_be_used(network, tmp_path, capsys, nodes, more, sentence):
    path = network / "nodes.csv"
    if nodes is not None:
        path = tmp_path / "nodes.csv"
        path.write_text(nodes)
    out = tmp_path / "out"
    code, said = run(capsys, network / "log.csv", "--nodes", path, "--calibration-frames", EMPTY, "--out", out, *more)
    assert code == 2
    assert sentence in said
    assert not out.exists()


def test_somebody_inside_while_calibrating_is_told(network, tmp_path, capsys):
    """The log's second half, in which somebody walks, taken for an empty room; too short to learn one from."""
    log, out = changed(network, tmp_path, lambda lines: [lines[0], *lines[42:]]), tmp_path / "o"
    nodes, busy = network / "nodes.csv", ("--busy-sd-db", 1)
    code, said = run(capsys, log, "--nodes", nodes, "--calibration-frames", 20, *busy, "--out", out, "--strict")
    assert code == 3, said
    assert "as if somebody were inside" in said
    assert "Somebody was there throughout the calibration" in said


@pytest.mark.parametrize("method", longer(["links", "image"], "links"))
def test_nodes_that_fail_one_after_another(network, tmp_path, capsys, method):
    """Half of the nodes fall silent during the walk: worse, but no crash."""

    def silent(lines):
        names = lines[0].split(",")
        changed_lines = [lines[0]]
        for number, line in enumerate(lines[1:]):
            dead = {f"n{k}" for k in range(4) if number > 45 + 6 * k}
            cells = line.split(",")
            changed_lines.append(
                ",".join(
                    "" if dead & set(name.split("-")[:2]) else cell for name, cell in zip(names, cells, strict=True)
                )
            )
        return changed_lines

    log = changed(network, tmp_path, silent)
    code, said = run(
        capsys,
        log,
        "--nodes",
        network / "nodes.csv",
        "--calibration-frames",
        EMPTY,
        "--method",
        method,
        "--out",
        tmp_path / "o",
    )
    assert code == 0, said
    with xr.open_dataset(tmp_path / "o" / "result.nc") as result:
        assert result["step_time"].values[-1] == 0.5 * (FRAMES - 1)


def test_truth_that_cannot_be_read(network, tmp_path, capsys):
    for text, sentence in (
        ("a,b\n1,2\n", "line 1: the columns are"),
        ("time_s,x_m,y_m\n1,2\n", "line 2: has 2 cells"),
        ("time_s,x_m,y_m\n1,2,here\n", "line 2, column y_m: 'here' is no number"),
        ("time_s,x_m,y_m\n1,2,3\n1,2,3\n", "line 3: target 1 is there twice at 1 s"),
        ("time_s,x_m,y_m\n", "holds no place"),
    ):
        path = tmp_path / "truth.csv"
        path.write_text(text)
        code, said = run(capsys, *usual(network, "--truth", path, "--out", tmp_path / "out"))
        assert code == 2
        assert sentence in said
        assert not (tmp_path / "out").exists()
