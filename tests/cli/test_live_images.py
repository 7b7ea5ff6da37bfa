"""`elusive track images` of frames that come: the tracks of the recording, lines of JSON, how it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
from PIL import Image

from elusive.cli import main
from elusive.results import read_tracks_csv
from tests.json_lines import json_lines
from tests.processes import HUNG_S, wait_until

FRAMES = 24
WHITE = ("--sensor", "white", "--noise-sigma", 3, "--pedestal", 100, "--psf-sigma", 1, "--filter", "single")


def run(capsys, *arguments):
    """Run a command; its code, and what it said on each stream."""
    try:
        main(["track", "images", *map(str, arguments)])
    except SystemExit as ended:
        code = ended.code or 0
    said = capsys.readouterr()
    return code, said.out, said.err


@pytest.fixture(scope="module")
def movie():
    """A target of 20 dB that crosses white noise."""
    rows, columns = np.mgrid[:32, :40]
    spots = [30 * np.exp(-((rows - 12) ** 2 + (columns - 6 - k) ** 2) / 2) for k in range(FRAMES)]
    noise = np.random.default_rng(3).normal(100, 3, (FRAMES, 32, 40))
    return np.rint(noise + spots).astype(np.uint8)


def write(folder, movie, numbers):
    for k in numbers:
        beside = folder / f".{k}"
        Image.fromarray(movie[k]).save(beside, format="png")
        os.replace(beside, folder / f"f{k}.png")


def test_a_folder_that_grows_gives_the_tracks_of_the_recording(movie, tmp_path, capsys):
    frames, live, whole = tmp_path / "frames", tmp_path / "live", tmp_path / "whole"
    frames.mkdir()
    write(frames, movie, range(5))
    writer = threading.Thread(target=write, args=(frames, movie, range(5, FRAMES)))
    writer.start()
    code, out, err = run(capsys, frames, *WHITE, "--rate-hz", 10, "--follow", "--idle-s", 2, "--out", live)
    writer.join()
    assert code == 0, err
    assert run(capsys, frames, *WHITE, "--rate-hz", 10, "--out", whole)[0] == 0
    assert (live / "tracks.csv").read_bytes() == (whole / "tracks.csv").read_bytes()
    assert (live / "config.yaml").read_bytes() == (whole / "config.yaml").read_bytes()
    assert (live / "checks.json").read_bytes() == (whole / "checks.json").read_bytes()
    assert {file.name for file in live.iterdir()} == {"tracks.csv", "result.nc", "checks.json", "config.yaml"}
    lines, summary = json_lines(out)
    assert out.splitlines() == [json.dumps(line, separators=(",", ":")) for line in [*lines, {"summary": summary}]]
    np.testing.assert_allclose([line["time_s"] for line in lines], np.arange(FRAMES) / 10)
    rows = read_tracks_csv(live / "tracks.csv").rows
    told = [(line["time_s"], track["track"], track["x_px"]) for line in lines for track in line["tracks"]]
    assert told == list(
        zip(rows["time_s"].tolist(), rows["track"].tolist(), rows["position"][:, 0].tolist(), strict=True)
    )
    assert len(told) > FRAMES / 2
    assert summary["steps"] == FRAMES
    assert summary["dropped"] == summary["late"] == summary["unusable"] == 0
    assert summary["ended"] == "source ended"
    assert f"{FRAMES} tracked; from its coming to its tracks" in err


def started(frames, out, *more):
    return subprocess.Popen(
        [sys.executable, "-m", "elusive", "track", "images", str(frames), *map(str, WHITE), "--out", str(out), *more],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.PIPE,
    )  # fmt: skip


@pytest.fixture
def waiting(movie, tmp_path):
    """A run that has tracked five frames of a folder and waits for more."""
    frames, out = tmp_path / "frames", tmp_path / "out"
    frames.mkdir()
    write(frames, movie, range(5))
    process = started(frames, out, "--follow")
    told = [process.stdout.readline() for _ in range(5)]
    assert [json.loads(line)["time_s"] for line in told] == [0, 1, 2, 3, 4]
    yield process, frames, out
    process.kill()
    process.communicate()


def test_ctrl_c_ends_a_wait_with_the_results_written(waiting):
    process, _, out = waiting
    process.send_signal(signal.SIGINT)
    told, said = process.communicate(timeout=HUNG_S)
    assert process.returncode == 0
    summary = json.loads(told)["summary"]
    assert (summary["steps"], summary["ended"]) == (5, "interrupted")
    assert b"Interrupted." in said
    assert b"Traceback" not in said
    assert all((out / name).stat().st_size for name in summary["files"])


@pytest.mark.thorough
def test_when_nobody_reads_the_lines_any_more_it_ends(waiting, movie):
    process, frames, out = waiting
    process.stdout.close()
    write(frames, movie, [5])
    wait_until(lambda: (out / "result.nc").exists(), process)
    process.wait(timeout=HUNG_S)
    said = process.stderr.read()
    process.stdout = None
    assert process.returncode == 0, said
    assert b"Traceback" not in said


@pytest.mark.thorough
def test_a_folder_that_vanishes_is_told_and_the_results_stay(waiting):
    process, frames, out = waiting
    for file in frames.iterdir():
        file.unlink()
    frames.rmdir()
    told, said = process.communicate(timeout=HUNG_S)
    assert process.returncode == 2
    assert json.loads(told)["summary"]["ended"] == "source failed"
    assert b"cannot be read any more" in said
    assert (out / "result.nc").exists()


def test_frames_from_a_pipe_of_another_program(movie, tmp_path):
    process = started("-", tmp_path / "out")
    stream = b"YUV4MPEG2 W40 H32 F10:1 Cmono\n" + b"".join(b"FRAME\n" + frame.tobytes() for frame in movie)
    told, said = process.communicate(stream, timeout=HUNG_S)
    assert process.returncode == 0, said
    lines, summary = json_lines(told.decode())
    assert summary["steps"] == len(lines) == FRAMES
    np.testing.assert_allclose([line["time_s"] for line in lines], np.arange(FRAMES) / 10)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (("--idle-s", 3), "--idle-s: has no meaning without --follow"),
        (("--follow", "--truth", "t.csv"), "--truth: has no meaning with --follow"),
        (("--follow", "--start", 3), "--start: has no meaning for frames that are still to come"),
        (("--follow", "--times", "t.csv"), "--times: has no meaning for frames that are still to come"),
    ],
)
def test_what_means_nothing_is_refused(tmp_path, capsys, given, sentence):
    code, _, err = run(capsys, tmp_path, *given, "--out", tmp_path / "out")
    assert code == 2
    assert sentence in " ".join(err.split())


def test_an_earlier_runs_tracks_are_not_overwritten(movie, tmp_path, capsys):
    write(tmp_path, movie, range(2))
    (tmp_path / "tracks.csv").write_text("precious")
    code, _, err = run(capsys, tmp_path, *WHITE, "--follow", "--idle-s", 0.1, "--out", tmp_path)
    assert code == 2
    assert "of an earlier run; name another folder" in " ".join(err.split())
    assert (tmp_path / "tracks.csv").read_text() == "precious"
