"""`elusive serve` killed at any moment, of each system: the same numbers, nothing twice, gaps told; a full disk."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from itertools import pairwise

import pytest
import yaml

from tests.cli.test_serve import lines_of, started
from tests.live_sources import KINDS, played
from tests.processes import HUNG_S, wait_until

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no kill -9")
QUICK = ("images that go",)  # of the normal suite: what goes by the folder's names
OF_A_RUN = ("unix_s", "latency_ms", "dropped", "gap_s", "resumed")  # differ from run to run
FULL = """
import os, sys
flag, folder, write = sys.argv.pop(1), sys.argv.pop(1), os.write
def full(descriptor, octets):
    if os.path.exists(flag) and os.readlink(f"/proc/self/fd/{descriptor}").startswith(folder):
        raise OSError(28, "No space left on device")
    return write(descriptor, octets)
os.write = full
from elusive.cli import entry
entry()
"""


@contextmanager
def site(kind, folder):
    """A source that plays, and the configuration of who follows it."""
    source, over = played(kind, folder), threading.Event()
    config, told = folder / "site.yaml", folder / "told.ndjson"
    wanted = {
        "system": source.system, "source": source.source, "options": source.options, "parameters": source.parameters,
        "to": [f"ndjson:{told}"], "out": str(folder / "out"),
    }  # fmt: skip
    config.write_text(yaml.safe_dump(wanted))
    player = threading.Thread(target=source.play, args=(over,))
    player.start()
    try:
        yield source, config, told
    finally:
        over.set()
        player.join()


def killed(kind, folder, kills, seed=0):
    """Kill again and again, now and then before anything was told; return the source and what was told."""
    rng, began_s = random.Random(seed), time.monotonic()
    with site(kind, folder) as (source, config, told):
        for kill in range(kills + 1):
            known = len(lines_of(told))
            process = started(config)
            try:
                if kill % 4 == 3:
                    time.sleep(3 * rng.random())
                else:
                    more = 20 if kill == kills else rng.randint(1, source.most) if kills > 2 else 20
                    wait_until(lambda known=known, more=more: len(lines_of(told)) >= known + more, process)
            finally:
                process.send_signal(signal.SIGKILL)
                process.communicate()
    print(f"{kind}: {kills} kills in {time.monotonic() - began_s:.0f} s")
    return source, lines_of(told)


def check(source, lines, folder):
    times_s = [line["time_s"] for line in lines]
    assert times_s == sorted(set(times_s))  # nothing twice
    resumed = [k for k, line in enumerate(lines) if line.get("resumed")]
    assert resumed
    usual_s = min(later - earlier for earlier, later in pairwise(times_s))
    for k in resumed:
        # the last line before the kill may not be out
        assert lines[k]["gap_s"] == pytest.approx(times_s[k] - times_s[k - 1], abs=2.01 * usual_s)
    if source.same:
        check_the_same(source, lines, folder)
        return
    for k in (k for k in range(1, len(lines)) if times_s[k] - times_s[k - 1] > 3.5 * usual_s):
        assert "gap_s" in lines[k]  # a hole that nobody is told of
    sure = [{track["track"] for track in line["tracks"] if track["status"] == "confirmed"} for line in lines]
    if source.steady:
        before = set.intersection(*sure[resumed[0] - 5 : resumed[0]])
        assert len(before) == 2  # who are there all the time
        assert all(before <= found for found in sure[resumed[0] :])
    for k in resumed:
        known, later = ({track["track"]: track["age_s"] for track in line["tracks"]} for line in lines[k - 1 : k + 1])
        for number in sure[k - 1] - set(lines[k]["ended"]):
            assert later[number] - known[number] == pytest.approx(times_s[k] - times_s[k - 1])
    assert sum(len(sure[k - 1] & sure[k]) for k in resumed) >= len(resumed)  # so that there was what could be lost


def check_the_same(source, lines, folder):
    """What was told is what a run that is never killed tells of the same file."""
    words = ["track", source.system, source.source, "--follow", "--idle-s", "1", "--out", str(folder / "whole")]
    words += ["--config", str(folder / "out" / "parameters.yaml"), "--to", f"ndjson:{folder / 'whole.ndjson'}"]
    for name, value in source.options.items():
        words += [f"--{name.replace('_', '-')}", str(value)]
    subprocess.run(
        [sys.executable, "-c", "from elusive.cli import entry; entry()", *words], check=True, timeout=HUNG_S,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    whole = {line["time_s"]: line for line in lines_of(folder / "whole.ndjson") if "time_s" in line}
    for line in lines:
        expected = whole[line["time_s"]]
        for name in OF_A_RUN:
            line.pop(name, None)
            expected.pop(name, None)
        assert line == expected
    lost = [time_s for time_s in whole if time_s <= lines[-1]["time_s"]]
    assert len(lost) - len(lines) <= sum(1 for _ in folder.glob("out/run-*"))  # one that was not out at each kill


@pytest.mark.parametrize("kind", QUICK)
def test_killed_it_goes_on(tmp_path, kind):
    source, lines = killed(kind, tmp_path, 1)
    check(source, lines, tmp_path)


@pytest.mark.thorough
@pytest.mark.parametrize("kind", KINDS)
def test_killed_twenty_times_it_goes_on(tmp_path, kind):
    source, lines = killed(kind, tmp_path, 20)
    check(source, lines, tmp_path)


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="asks /proc which file is written to")
def test_a_full_disk_under_the_run_keeps_it_from_nothing_else(tmp_path):
    with site("bearings", tmp_path) as (_, config, told):
        flag, out = tmp_path / "full", tmp_path / "out"
        words = [sys.executable, "-c", FULL, str(flag), str(out), "serve", str(config)]
        with (tmp_path / "said").open("w") as said:
            process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=said, text=True)
        try:
            wait_until(lambda: len(lines_of(told)) > 20, process)
            flag.touch()
            wait_until(lambda: "tracks.csv: cannot be written to" in (tmp_path / "said").read_text(), process)
            known, size = len(lines_of(told)), (out / "run-0001" / "tracks.csv").stat().st_size
            wait_until(lambda: len(lines_of(told)) > known + 30, process)  # the other sink is told all the same
            assert (out / "run-0001" / "tracks.csv").stat().st_size == size
            flag.unlink()
            wait_until(lambda: "tracks.csv: is back after" in (tmp_path / "said").read_text(), process)
            known = lines_of(told)[-1]["time_s"]
            wait_until(lambda: lines_of(told)[-1]["time_s"] > known, process)
        finally:
            process.send_signal(signal.SIGKILL)
            process.communicate()
    lines = lines_of(told)
    header, *rows = (out / "run-0001" / "tracks.csv").read_text().splitlines()
    assert header.startswith("time_s,track")
    there = [(float(row.split(",")[0]), int(row.split(",")[1])) for row in rows]
    expected = [(line["time_s"], track["track"]) for line in lines for track in line["tracks"]]
    assert [one for one in there if one[0] <= known] == [one for one in expected if one[0] <= known]
