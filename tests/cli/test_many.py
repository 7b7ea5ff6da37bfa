"""Many recordings: the same files from one process, from two, from a cluster, and after a kill."""

from __future__ import annotations

import csv
import os
import shutil
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from elusive.campaign import trials
from elusive.cli import main, many
from elusive.results import TrackLog
from elusive.tracking.track import Step, Track
from tests.bearing_flight import write_flight
from tests.processes import wait_until


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("flights"), 2)


def recorded(folder, count):
    """Flights that differ in their noise, one spoilt; and their sensors."""
    (folder / "heard").mkdir()
    for seed in range(count):
        flight = write_flight(folder / "one", seed=seed)
        shutil.copy(flight / "bearings.csv", folder / "heard" / f"flight{seed}.csv")
    shutil.copy(folder / "one" / "sensors.csv", folder / "sensors.csv")
    (folder / "heard" / f"flight{count}.csv").write_text("time_s,sensor,azimuth_deg\n0,nobody,1\n")
    return folder


def words(flights, out, *more):
    pattern = str(flights / "heard" / "*.csv")
    return ["track", "bearings", pattern, "--sensors", str(flights / "sensors.csv"), "--sigma-deg", "0.5",
            "--q", "1", "--bias-sd-deg", "0.1", "--out", str(out), *more]  # told, not sought  # fmt: skip


def track(*arguments):
    with pytest.raises(SystemExit) as ended:
        main(words(*arguments))
    return ended.value.code or 0


def files(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def alone(flights, tmp_path_factory):
    out = tmp_path_factory.mktemp("many") / "alone"
    assert track(flights, out, "--workers", "1") == 2  # one is spoilt
    return out


def test_the_table_has_a_line_for_each(flights, alone):
    rows = list(csv.DictReader((alone / "summary.csv").read_text().splitlines()))
    assert [row["folder"] for row in rows] == [*(f"flight{k}" for k in range(2)), ""]
    assert [row["outcome"] for row in rows] == ["tracked"] * 2 + ["refused"]
    assert {row["tracks"] for row in rows[:2]} == {"1"}
    assert "there is no sensor 'nobody'" in rows[2]["sentence"]
    single = alone.parent / "single"
    with pytest.raises(SystemExit):
        main(["track", "bearings", str(flights / "heard" / "flight1.csv"), *words(flights, single)[3:]])
    assert files(single) == files(alone / "flight1")


@contextmanager
def cluster():
    """Give the address of a scheduler with two workers."""
    distributed = pytest.importorskip("distributed", reason="needs elusive[cluster]")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None, host="127.0.0.1", protocol="tcp"
    ) as made:
        yield made.scheduler_address


@pytest.mark.thorough
def test_a_cluster_writes_the_same_bytes(flights, alone, tmp_path):
    with cluster() as address:
        assert track(flights, tmp_path / "out", "--scheduler", address) == 2
    assert files(tmp_path / "out") == files(alone)


def killed(flights, out, after, *where):
    """Kill a run once so many are done."""
    arguments = words(flights, out, *where)
    code = f"from elusive.cli import main; main({arguments!r})"
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
    try:
        wait_until(lambda: len(list(out.glob("flight*"))) >= after, process)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stderr.close()


@pytest.mark.thorough
@pytest.mark.skipif(os.name == "nt", reason="Windows has no kill -9")
def test_killed_and_resumed_by_two_processes_it_writes_the_same_bytes(flights, alone, tmp_path, capsys):
    out = tmp_path / "out"
    killed(flights, out, 1, "--workers", "1")
    assert not (out / "summary.csv").exists()
    assert track(flights, out, "--workers", "2") == 2
    assert "of 3 are there already" in capsys.readouterr().err
    assert files(out) == files(alone)


def pressed_twice(out):
    """A command amid which Ctrl-C is pressed, and then the pool closed."""
    signal.raise_signal(signal.SIGINT)
    STOPPED.append("pressed")
    trials.stopping.set()
    signal.raise_signal(signal.SIGINT)
    STOPPED.append("tracked")


STOPPED = []


def test_a_worker_lets_go_of_its_recording_when_its_pool_is_closed(tmp_path, monkeypatch):
    """It was tracked to its end, and the one after it, too: a minute until Ctrl-C was heeded."""
    monkeypatch.setattr(many.multiprocessing, "parent_process", lambda: "the pool's")
    monkeypatch.setattr(trials, "stopping", threading.Event())
    for known in (["pressed"], ["pressed"]):  # the next is not begun
        with pytest.raises(KeyboardInterrupt):
            many.track_one(f"{__name__}:pressed_twice", {"out": tmp_path / "one"})
        assert known == STOPPED


@pytest.mark.thorough
def test_twenty_recordings_are_equal_from_everywhere(tmp_path):
    flights = recorded(tmp_path, 20)
    assert track(flights, tmp_path / "one_by_one", "--workers", "1") == 2
    expected = files(tmp_path / "one_by_one")
    for count in ("1", "2"):
        out = tmp_path / f"in {count}"
        killed(flights, out, 7, "--workers", count)
        assert not (out / "summary.csv").exists()
        assert track(flights, out, "--workers", count) == 2
        assert files(out) == expected, count
    out = tmp_path / "on a cluster"
    with cluster() as address:
        killed(flights, out, 7, "--scheduler", address)
        assert not (out / "summary.csv").exists()
        assert track(flights, out, "--scheduler", address) == 2
    assert files(out) == expected


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (("--workers", "1", "--follow"), "--follow: is of one recording"),
        (("--workers", "1", "--to", "ndjson:x"), "--to: is of one recording"),
        (("--workers", "2", "--scheduler", "tcp://127.0.0.1:1"), "give one of them"),
        (("--workers", "1", "--q", "3"), "holds results of other settings"),
    ],
)
def test_what_has_no_meaning_is_said(flights, alone, capsys, more, sentence):
    before = files(alone)
    assert track(flights, alone, *more) == 2
    assert sentence in " ".join(capsys.readouterr().err.split())
    assert files(alone) == before


@pytest.mark.parametrize(("unit", "states", "tracks"), [("samples", ("x", "vx"), 1), ("px", ("x", "vx", "y", "vy"), 2)])
def test_a_track_counts_where_its_report_shows_it(tmp_path, unit, states, tracks):
    """Of images each row tells, of a signal a track's last."""
    folder, d = tmp_path / "one", len(states)
    folder.mkdir()
    with TrackLog(states, unit, ("shown",), path=folder / "tracks.csv") as log:
        for k, shown in enumerate(((1, 0), (0, 0), (0, 1))):
            numbered = enumerate((*shown, 0), 1)
            found = [
                Track(n, "confirmed", 0.9, np.zeros(d), np.eye(d), extra={"shown": float(each)}) for n, each in numbered
            ]
            log.append(Step(float(k), None, None, tuple(found)))
    assert many._row(tmp_path, many.Recording("one.csv", "one"), None)[3] == tracks
