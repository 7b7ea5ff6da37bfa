"""`elusive track signal` as a new user meets it: in an empty folder, with files of every kind and every mistake."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import yaml
from scipy.io import wavfile

from elusive.results import read_tracks_csv
from elusive.sensors.waveform import NoiseObject, NoiseObjectPath
from tests.longer import longer

WRITTEN = ["checks.json", "config.yaml", "report.html", "report.png", "result.nc", "tracks.csv"]
FAST = ["--smoothing", "0.9", "--max-velocity", "30"]  # at 10 frames a second
QUICK = ["--smoothing", "0.9", "--max-velocity", "3"]  # a short memory: the law of noise is soon simulated
SAMPLES, FRAMES = 300, 60
Run = Callable[..., tuple[int, str]]


def noise_object() -> tuple[np.ndarray, np.ndarray]:
    scene = NoiseObject(shape=(SAMPLES,), background_deviation=0.5)
    path = NoiseObjectPath(start=(100.0,), velocity=(2.0,), appears=10)
    drawn = scene.simulate_sequence(FRAMES, [path], np.random.default_rng(1))
    return drawn.frames, drawn.truth[:, 0, 0]


def save(folder: Path, form: str) -> list[object]:
    """Save the signal in a form; the arguments that read it."""
    frames, _ = noise_object()
    path = folder / f"signal.{form.partition('-')[0]}"
    if form == "npy":
        np.save(path, frames)
    elif form == "npy-long":
        np.save(path, frames.ravel())
        return ["signal.npy", "--frame-samples", SAMPLES]
    elif form == "csv":
        header = ",".join(["time_s", *(f"s{k}" for k in range(SAMPLES))])
        table = np.column_stack([np.arange(FRAMES) / 10, frames])
        np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.17g")
    elif form == "txt-long":
        np.savetxt(path, frames.ravel(), fmt="%.17g")
        return ["signal.txt", "--frame-samples", SAMPLES]
    else:
        both = np.column_stack([np.zeros(frames.size), frames.ravel() / 8])
        wavfile.write(path, 10 * SAMPLES, (2**15 * both).astype(np.int16))
        return ["signal.wav", "--frame-samples", SAMPLES, "--channel", "1"]
    return [path.name]


@pytest.mark.parametrize(
    "form", longer(["npy", "npy-long", "csv", "txt-long", "wav"], "npy", "npy-long", "csv", "txt-long")
)
def test_every_form_of_a_signal_gives_the_same_tracks(elusive_in: Run, tmp_path: Path, form: str) -> None:
    timed = form in ("csv", "wav")
    code, said = elusive_in(
        "track", "signal", *save(tmp_path, form), "--out", "out", *FAST, *([] if timed else ["--rate-hz", "10"])
    )
    assert code == 0, said
    assert "One object was found" in said
    assert "Written to out: tracks.csv, result.nc, report.html, report.png, checks.json, config.yaml" in said
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == WRITTEN
    rows = read_tracks_csv(tmp_path / "out" / "tracks.csv").rows
    truth = noise_object()[1]
    sure = rows[rows["status"] == 1]
    assert len(sure) > 25
    off = sure["position"][:, 0] - truth[np.round(10 * sure["time_s"]).astype(int)]
    assert np.abs((off + 150) % 300 - 150).max() <= 5
    assert sure["velocity"].mean() == pytest.approx(20.0, abs=2.0)


def test_options_go_before_the_configuration_and_that_before_the_defaults(elusive_in: Run, tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text("object_size: 7\nfilter: {smoothing: 0.8, max_velocity: 2}\nseed: 4\n")
    code, said = elusive_in(
        "track", "signal", *save(tmp_path, "npy"), "--out", "out", "--config", "c.yaml", "--smoothing", "0.9",
        "--statistic", "std", "--border", "bounded", "--probability", "0.01",
    )  # fmt: skip
    assert code == 0, said
    config = yaml.safe_load((tmp_path / "out" / "config.yaml").read_text())
    assert config["filter"]["smoothing"] == 0.9
    assert config["filter"]["max_velocity"] == 2
    assert config["statistic"] == {"kind": "std", "window": 7, "border": "cut"}
    assert (config["seed"], config["false_alarm"]["probability"]) == (4, 0.01)


def disturbed(kind: str) -> np.ndarray:
    """The signal with something that is no end of it."""
    frames = noise_object()[0]
    if kind == "gaps":
        frames[30], frames[35:38] = 2.0, np.nan
    elif kind == "samples missing":
        frames[20:, ::17], frames[:, 200:250] = np.nan, 0.0
    elif kind == "offset":
        frames += 50
    elif kind == "complex":
        scene = NoiseObject(shape=(SAMPLES,), background_deviation=0.5)
        path = NoiseObjectPath(start=(100.0,), velocity=(2.0,), appears=10)
        imaginary = scene.simulate_sequence(FRAMES, [path], np.random.default_rng(2)).frames
        frames = frames + 1j * imaginary
    elif kind == "loud stretch":
        frames[:, 150:] *= 3
    return frames


@pytest.mark.parametrize(
    "kind",
    longer(
        ["gaps", "samples missing", "offset", "complex", "loud stretch"], "samples missing", "offset", "loud stretch"
    ),
)
def test_a_disturbed_signal_is_tracked_all_the_same(elusive_in: Run, tmp_path: Path, kind: str) -> None:
    np.save(tmp_path / "signal.npy", disturbed(kind))
    code, said = elusive_in("track", "signal", "signal.npy", "--out", "out", *QUICK)
    assert code == 0, said
    assert "One object was found" in said
    rows = read_tracks_csv(tmp_path / "out" / "tracks.csv").rows
    sure = rows[rows["status"] == 1]
    assert len(sure) > 20
    off = sure["position"][:, 0] - noise_object()[1][np.round(sure["time_s"]).astype(int)]
    assert np.abs((off + 150) % 300 - 150).max() <= 5


def test_calibration_is_of_real_samples(elusive_in: Run, tmp_path: Path) -> None:
    np.save(tmp_path / "signal.npy", disturbed("complex"))
    code, said = elusive_in("track", "signal", "signal.npy", "--out", "out", "--calibration-frames", 10, *QUICK)
    assert code == 2
    assert "these are complex (I and Q)" in said
    assert not (tmp_path / "out").exists()


def test_an_object_is_found_in_frames_that_overlap(elusive_in: Run, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    recording, hop = rng.standard_normal(150 * 60 + 300), 150
    for number in range(60):  # at 20 + 2 k of frame k, and so at 170 + 2 k of the frame before
        place = number * hop + 20 + 2 * number + np.arange(5)
        recording[place] += 2 * rng.standard_normal(5)
    np.save(tmp_path / "signal.npy", recording)
    arguments = ("--frame-samples", 300, "--hop-samples", hop, "--border", "bounded", *QUICK)
    code, said = elusive_in("track", "signal", "signal.npy", "--out", "out", *arguments)
    assert code == 0, said
    assert "2 tracks were found" in said


@pytest.mark.thorough
def test_the_size_of_an_object_is_fitted(elusive_in: Run, tmp_path: Path) -> None:
    size = 11
    scene = NoiseObject(shape=(SAMPLES,), background_deviation=0.4, object_size=size)
    path = NoiseObjectPath(start=(100.0,), velocity=(1.0,))
    np.save(tmp_path / "signal.npy", scene.simulate_sequence(25, [path], np.random.default_rng(1)).frames)
    code, said = elusive_in("fit", "signal", "signal.npy", "--out", "fitted.yaml")
    assert code == 0, said
    fitted = yaml.safe_load((tmp_path / "fitted.yaml").read_text())
    assert fitted["noise"] in ("white", "estimated")
    assert abs(fitted["object_size"] - size) <= 0.4 * size
    code, said = elusive_in("track", "signal", "signal.npy", "--config", "fitted.yaml", "--out", "out", *QUICK)
    assert "One object was found" in said


@pytest.mark.thorough
def test_of_noise_alone_no_size_is_fitted(elusive_in: Run, tmp_path: Path) -> None:
    np.save(tmp_path / "signal.npy", np.random.default_rng(2).standard_normal((20, SAMPLES)))
    code, said = elusive_in("fit", "signal", "signal.npy", "--out", "fitted.yaml")
    assert code == 0, said
    assert "nothing stands out at any size" in said
    assert "object_size" not in yaml.safe_load((tmp_path / "fitted.yaml").read_text())


def good(folder: Path, *arguments: object) -> list[object]:
    return [*save(folder, "npy"), *arguments]


def option(*arguments: object) -> Callable[[Path], list[object]]:
    return lambda folder: good(folder, *arguments)


def array(values: Any, *arguments: object) -> Callable[[Path], list[object]]:
    def make(folder: Path) -> list[object]:
        np.save(folder / "signal.npy", values)
        return ["signal.npy", *arguments]

    return make


def text(content: str, *arguments: object) -> Callable[[Path], list[object]]:
    def make(folder: Path) -> list[object]:
        (folder / "signal.csv").write_text(content)
        return ["signal.csv", *arguments]

    return make


def truth(content: str) -> Callable[[Path], list[object]]:
    def make(folder: Path) -> list[object]:
        (folder / "truth.txt").write_text(content)
        return good(folder, "--truth", "truth.txt", *QUICK)

    return make


def put(place: tuple[int, ...], value: float) -> np.ndarray:
    frames = noise_object()[0].copy()
    frames[place] = value
    return frames


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (array(np.ones((20, 50))), "signal.npy: none of its 20 frames can be used"),
        (array(noise_object()[0][:1]), "signal.npy: gives one frame only"),
        (array(noise_object()[0][:, :4]), "signal.npy: frames of 4 samples are shorter than the window of 5"),
        (array(noise_object()[0][:, :, None]), "has shape (60, 300, 1); a signal is an array (time, sample)"),
        (array(noise_object()[0] + 50, "--noise", "white"), "signal.npy, frame 0: its mean, 49.9"),
        (
            array(noise_object()[0].ravel(), "--frame-samples", 300, "--hop-samples", 5, *QUICK),
            "signal.npy: hop_samples=5: frames share the samples of those before",
        ),
        (array(np.zeros(0)), "signal.npy"),
        (text("-3,2,-1,3,1,-2\n1,2\n"), "signal.csv, line 2: has 2 cells"),
        (text("-3,2,-1,3,1,-2\n1,two,3,4,5,6\n"), "signal.csv, line 2, field 2: 'two' is no number"),
        (text(""), "signal.csv: holds no line of numbers"),
        (lambda folder: ["none.npy"], "none.npy: there is no such file"),
        (lambda folder: ["."], "is a folder"),
        (option("--window", "4"), "must be odd"),
        (option("--window", "301"), "shorter than the window of 301"),
        (option("--smoothing", "1"), "smoothing: must be less than 1"),
        (option("--smoothing", "-0.5"), "smoothing: must be greater than or equal to 0"),
        (option("--statistic", "mean"), "'mean' is not one of"),
        (
            option("--statistic", "dot", "--mode", "replacing"),
            "--mode: has no meaning for statistic 'dot', only for llr",
        ),
        (option("--frame-samples", "50"), "holds frames already, of 300 samples"),
        (option("--channel", "0"), "chooses in a WAVE file, and this is none"),
        (option("--rate-hz", "0"), "must be a positive number of frames a second"),
        (option("--start", "60"), "start=60 is past the last"),
        (option("--max-velocity", "1e6"), "more than half of the machine's"),
        (option("--source", "frame"), "frames of 300 samples are too short to tell, each by itself, what noise does"),
        (option("--calibration-frames", "60"), "all of them taken for calibration"),
        (option("--object-sise", "5"), "No such option"),
        (truth("1\n2\n"), "truth.txt: has 2 rows for 60 frames"),
        (
            truth("frame,track,x_samples\n60,1,5\n"),
            "truth.txt: has a target in frame 60, and the recording's last is 59",
        ),
        (option("--truth-cutoff-samples", "3"), "--truth-cutoff: has no meaning without --truth"),
        (truth("1\nhere\n"), "truth.txt, line 2: 'here' is no place"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_nothing(
    elusive_in: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    make: Callable[[Path], list[object]],
    sentence: str,
) -> None:
    monkeypatch.setattr(psutil, "virtual_memory", lambda: type("Memory", (), {"total": 10**9}))
    arguments = make(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    code, said = elusive_in("track", "signal", *arguments, "--out", "deep/out")
    assert code == 2
    assert sentence in said
    assert "Traceback" not in said
    assert said.count("Error") == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_out_that_is_a_file_is_left_alone(elusive_in: Run, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("precious")
    code, said = elusive_in("track", "signal", *save(tmp_path, "npy"), "--out", "out")
    assert code == 2
    assert "out: is a file" in said
    assert (tmp_path / "out").read_text() == "precious"


def test_ctrl_c_leaves_nothing(elusive_in: Run, ctrl_c: Callable[[int], list[int]], tmp_path: Path) -> None:
    np.save(tmp_path / "signal.npy", np.random.default_rng(4).standard_normal((60, 300)))
    frames = ctrl_c(20)
    code, said = elusive_in("track", "signal", "signal.npy", "--out", "deep/out")
    assert code == 130
    assert len(frames) == 20  # in the middle of it
    assert "Traceback" not in said
    assert "Written" not in said
    assert [path.name for path in tmp_path.iterdir()] == ["signal.npy"]


def test_help_names_what_the_documentation_names(elusive_in: Run) -> None:
    code, said = elusive_in("track", "signal", "--help")
    assert code == 0
    page = (Path(__file__).parents[2] / "docs" / "signals.md").read_text(encoding="utf-8")
    for flag in {*re.findall(r"--[a-z][a-z-]+", page)} - {"--out"}:
        assert re.search(rf"{flag}\b", said), flag


def test_a_signal_that_is_followed_has_the_tracks_of_the_recording(elusive_in, tmp_path):
    frames, _ = noise_object()
    np.savetxt(tmp_path / "signal.csv", frames, delimiter=",", fmt="%.5f")
    code, said = elusive_in("track", "signal", "signal.csv", "--out", "whole", *QUICK)
    assert code == 0, said
    code, said = elusive_in("track", "signal", "signal.csv", "--follow", "--idle-s", 0, "--out", "live", *QUICK)
    assert code == 0, said
    assert f'"steps":{FRAMES}' in said
    for name in ("tracks.csv", "config.yaml", "checks.json"):
        assert (tmp_path / "live" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    told = [json.loads(line) for line in re.findall(r'\{"time_s".*?\]\}', said)]
    rows = read_tracks_csv(tmp_path / "whole" / "tracks.csv").rows
    assert sum(len(step["tracks"]) for step in told) == len(rows)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("-",), "standard input is tracked as it comes; add --follow"),
        (("signal.csv", "--follow", "--start", 3), "--start and --stop: have no meaning"),
        (("signal.csv", "--follow", "--truth", "truth.txt"), "--truth: has no meaning with --follow"),
        (("signal.csv", "--idle-s", 3), "--idle-s: has no meaning without --follow"),
    ],
)
def test_what_has_no_meaning_live_is_refused(elusive_in, arguments, sentence):
    code, said = elusive_in("track", "signal", *arguments, "--out", "out")
    assert code != 0
    assert sentence in said
