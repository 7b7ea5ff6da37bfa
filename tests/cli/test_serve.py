"""`elusive serve`: killed again and again, it goes on with its tracks; its health page is for who has the token."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from contextlib import ExitStack, suppress

import numpy as np
import pytest
import yaml

from elusive.cli import main
from elusive.cli.health import MOST, health_page
from tests.processes import HUNG_S, wait_until

SENSORS = {"west": (-400.0, 0.0), "south": (0.0, -400.0), "east": (420.0, 60.0)}
EVERY_S = 0.05


def heard(k):
    """Lines of two emitters that circle far apart, at the time of the k-th."""
    lines = []
    rng = np.random.default_rng(k)
    for phase, (cx, cy) in ((0.0, (-150.0, 200.0)), (2.0, (200.0, 250.0))):
        x, y = cx + 30 * np.cos(phase + k / 400), cy + 30 * np.sin(phase + k / 400)
        for name, (sx, sy) in SENSORS.items():
            azimuth = np.degrees(np.arctan2(x - sx, y - sy)) + rng.normal(0, 0.2)
            lines.append(f"{EVERY_S * k:.2f},{name},{azimuth:.3f}\n")
    return "".join(lines).encode()


class Emitters(threading.Thread):
    """Serves what is heard as time passes; where nobody listens it passes for a second, however long a start takes."""

    def __init__(self):
        super().__init__(daemon=True)
        self.server = socket.create_server(("127.0.0.1", 0))
        self.server.setblocking(False)
        self.port, self.over = self.server.getsockname()[1], threading.Event()

    def run(self):
        listeners, k, alone = [], 0, 0
        while not self.over.wait(EVERY_S):
            with suppress(BlockingIOError):
                listener = self.server.accept()[0]
                listener.setblocking(True)
                listener.sendall(b"time_s,sensor,azimuth_deg\n")
                listeners.append(listener)
            for listener in list(listeners):
                try:
                    listener.sendall(heard(k))
                except OSError:
                    listeners.remove(listener)
                    listener.close()
            alone = 0 if listeners else alone + 1
            k += alone * EVERY_S <= 1.0
        for each in (*listeners, self.server):
            each.close()


@pytest.fixture
def emitters():
    thread = Emitters()
    thread.start()
    yield thread
    thread.over.set()
    thread.join()


def configured(folder, port, **more):
    sensors = folder / "sensors.csv"
    sensors.write_text("sensor,x_m,y_m\n" + "".join(f"{name},{x},{y}\n" for name, (x, y) in SENSORS.items()))
    config = {
        "system": "bearings",
        "source": f"tcp://127.0.0.1:{port}",
        "options": {"sensors": str(sensors)},
        "parameters": {"sigma_deg": 0.2, "emitters": {"kind": "several"}},
        "to": [f"ndjson:{folder / 'told.ndjson'}"],
        "out": str(folder / "out"),
        **more,
    }
    path = folder / "site.yaml"
    path.write_text(yaml.safe_dump(config))
    return path


def lines_of(path):
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().splitlines() if line.endswith("}")]


def started(config):
    words = [sys.executable, "-c", "from elusive.cli import entry; entry()", "serve", str(config)]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def settled(told, since):
    """Whether two are followed for a while since a time."""
    new = [line for line in told if line["time_s"] > since]
    return len(new) > 15 and sum(t["status"] == "confirmed" for t in new[-1]["tracks"]) == 2


def killed(tmp_path, emitters, times):
    """Start and kill; return what was told."""
    config, told, numbers = configured(tmp_path, emitters.port), tmp_path / "told.ndjson", []
    for kill in range(times + 1):
        since = max((line["time_s"] for line in lines_of(told)), default=-1.0)
        process = started(config)
        try:
            wait_until(lambda since=since: settled(lines_of(told), since), process)
            numbers.append({t["track"] for t in lines_of(told)[-1]["tracks"] if t["status"] == "confirmed"})
            if kill == times:
                check_health(tmp_path / "out", lines_of(told)[-1]["time_s"])
        finally:
            process.send_signal(signal.SIGKILL)
            process.communicate()
    check_told(lines_of(told), numbers, times)


def check_told(lines, numbers, times):
    times_s = [line["time_s"] for line in lines]
    assert times_s == sorted(set(times_s))  # nothing twice
    assert all(found == numbers[0] for found in numbers), numbers  # the same two
    resumed = [k for k, line in enumerate(lines) if line.get("resumed")]
    assert len(resumed) == times
    for k in resumed:
        # the last line before the kill may not be out
        assert lines[k]["gap_s"] == pytest.approx(times_s[k] - times_s[k - 1], abs=2.01 * EVERY_S)
        ages = {t["track"]: t["age_s"] for t in lines[k - 1]["tracks"] if t["track"] in numbers[0]}
        later = {t["track"]: t["age_s"] for t in lines[k]["tracks"]}
        for number, age_s in ages.items():
            assert later[number] == pytest.approx(age_s + times_s[k] - times_s[k - 1])


def check_health(out, latest_s):
    where, token = (out / "health.url").read_text().strip(), (out / "token").read_text()
    assert (out / "token").stat().st_mode & 0o077 == 0
    for given in ("", "?token=wrong"):
        with pytest.raises(urllib.error.HTTPError, match="401") as refused:
            urllib.request.urlopen(f"{where}health.json{given}", timeout=HUNG_S)
        refused.value.close()
    request = urllib.request.Request(f"{where}health.json", headers={"Authorization": f"Bearer {token}"})
    with urllib.request.urlopen(request, timeout=HUNG_S) as answer:
        health = json.load(answer)
    assert health["steps"] > 15
    assert health["tracks"] == 2
    assert health["dropped"] == 0
    assert health["memory_mb"] > 10
    assert {"first", "median", "p95"} <= health["latency_ms"].keys()
    with urllib.request.urlopen(f"{where}?token={token}", timeout=HUNG_S) as answer:
        page = answer.read().decode()
    assert "latency ms" in page
    assert token not in page
    assert latest_s > 0


def test_the_health_page_answers_a_few_at_a_time_and_goes_on():
    with (
        health_page("127.0.0.1", 0, "0123456789abcdef", lambda: {"title": "x"}, lambda: iter(())) as port,
        ExitStack() as open_ones,
    ):
        idle = [open_ones.enter_context(socket.create_connection(("127.0.0.1", port))) for _ in range(MOST + 4)]
        for each in idle[MOST:]:
            each.settimeout(HUNG_S)
            assert each.recv(1) == b""  # hung up on
        open_ones.close()
        where = f"http://127.0.0.1:{port}/health.json?token=0123456789abcdef"
        until, said = time.monotonic() + HUNG_S, None
        while said is None:
            assert time.monotonic() < until
            with suppress(OSError), urllib.request.urlopen(where, timeout=HUNG_S) as answer:
                said = json.load(answer)
        assert said == {"title": "x"}


@pytest.mark.thorough
@pytest.mark.skipif(os.name == "nt", reason="Windows has no kill -9")
def test_killed_it_goes_on_with_the_numbers_of_its_tracks(tmp_path, emitters):
    killed(tmp_path, emitters, 2)


@pytest.mark.thorough
@pytest.mark.skipif(os.name == "nt", reason="Windows has no kill -9")
def test_killed_twenty_times_it_goes_on_with_the_numbers_of_its_tracks(tmp_path, emitters):
    began_s = time.monotonic()
    killed(tmp_path, emitters, 20)
    print(f"20 kills in {time.monotonic() - began_s:.0f} s")


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ({"system": "sonar"}, "system: is 'sonar'; it must be one of links"),
        ({"sinks": ["ndjson:x"]}, "there is no such field"),
        ({"health": {"token": "short"}}, "Health.token: String should have at least 16"),
    ],
)
def test_a_configuration_without_meaning_is_refused(tmp_path, capsys, more, sentence):
    with pytest.raises(SystemExit) as ended:
        main(["serve", str(configured(tmp_path, 1, **more))])
    assert ended.value.code == 2
    assert sentence in " ".join(capsys.readouterr().err.split())


def test_a_token_that_anybody_guesses_is_refused(tmp_path, capsys):
    """A full disk left an empty one, which every request has."""
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "token").write_text("")
    with pytest.raises(SystemExit) as ended:
        main(["serve", str(configured(tmp_path, 1))])
    assert ended.value.code == 2
    assert "has fewer than 16 letters; remove it" in " ".join(capsys.readouterr().err.split())


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such locks")
def test_one_folder_serves_one_run_at_a_time(tmp_path, capsys, emitters):
    config = configured(tmp_path, emitters.port)
    process = started(config)
    try:
        wait_until(lambda: bool(lines_of(tmp_path / "told.ndjson")), process)
        with pytest.raises(SystemExit) as ended:
            main(["serve", str(config)])
    finally:
        process.kill()
        process.communicate()
    assert ended.value.code == 2
    assert "another run is going on from it" in " ".join(capsys.readouterr().err.split())


@pytest.mark.skipif(os.name == "nt", reason="others' rights are of POSIX")
def test_a_checkpoint_that_others_may_have_written_is_not_read(tmp_path, capsys):
    state = tmp_path / "out" / "checkpoint" / "state.bin"
    state.parent.mkdir(parents=True)
    state.write_bytes(b"?")
    for mode, sentence in ((0o666, "may be written by others"), (0o600, "is no checkpoint of this version")):
        state.chmod(mode)
        with pytest.raises(SystemExit):
            main(["serve", str(configured(tmp_path, 1))])
        assert sentence in " ".join(capsys.readouterr().err.split())
