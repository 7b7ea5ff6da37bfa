"""The command line as a new user meets it: in an empty folder, with files of every kind and with every mistake."""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numba
import numpy as np
import pytest
import tifffile
import xarray as xr
import yaml
from numpy.typing import NDArray
from PIL import Image
from rich.console import Console

import elusive
from elusive.cli import main
from elusive.cli.terminal import bar, say
from elusive.experiments.amrouche2018.scenario import WeakTarget
from elusive.results import read_tracks_csv
from elusive.sensors.image import ImageSensor
from tests.longer import longer

ROOT = Path(__file__).parents[2]
PROGRAM = [sys.executable, "-c", "from elusive.cli import main; main()"]
HEADER = "time_s,track,status,existence,x_px,y_px,vx_pxps,vy_pxps,sd_x_px,sd_y_px,correlation_xy,intensity,snr_db"
WRITTEN = ["checks.json", "config.yaml", "report.html", "report.png", "result.nc", "tracks.csv", "tracks_mot.csv"]
WHITE = ["--noise-sigma", "3", "--snr-db", "12"]
ENVELOPE = ["--noise", "rayleigh", "--noise-sigma", "14", "--snr-db", "16", "--dx", "1"]


class Ran:
    """A command's exit code and what it said."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err

    @property
    def said(self) -> str:
        """All of it on one line, without the frames round it."""
        return " ".join((self.out + self.err).translate(str.maketrans("│╭╮╰╯─", "      ")).split())


@pytest.fixture
def elusive_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Any:
    """Run a command in an empty folder, in this process."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")

    def run(*arguments: object) -> Ran:
        code: Any = 0
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = end.code or 0
        return Ran(code, *capfd.readouterr())

    return run


def everything_in(folder: Path) -> dict[str, bytes | None]:
    """Every file with its bytes and every folder, the hidden too."""
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None for p in folder.rglob("*")}


@pytest.fixture(scope="module")
def weak() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A recording of the paper's scenario at 12 dB, and the path."""
    recording = WeakTarget(snr_db=12.0).simulate(np.random.default_rng(3))
    return recording.frames, recording.truth[:, [0, 2]]


@pytest.fixture(scope="module")
def grey() -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """An envelope's recording in 8 bits, not square, and the path: what an image file can hold."""
    rng = np.random.default_rng(8)
    sensor = ImageSensor(rows=24, columns=32, noise="rayleigh", noise_sigma=14.0)
    intensity = sensor.intensity_of(16.0)
    path = np.full((22, 2), np.nan)
    path[6:18] = np.array([9.0, 8.0]) + np.arange(12)[:, None] * [0.6, 0.4]
    frames = [
        sensor.simulate(np.array([[x, 0, y, 0, intensity]]) if np.isfinite(x) else np.empty((0, 5)), rng)
        for x, y in path
    ]
    return np.clip(np.round(frames), 0, 255).astype(np.uint8), path


def save_images(folder: Path, frames: NDArray[Any], suffix: str = ".png") -> Path:
    folder.mkdir()
    for number, frame in enumerate(frames):
        Image.fromarray(frame).save(folder / f"frame{number}{suffix}")
    return folder


def save_truth(path: Path, truth: NDArray[np.float64]) -> Path:
    np.savetxt(path, truth, fmt="%.3f")
    return path


def check_written(out: Path, frames: int) -> None:
    assert sorted(file.name for file in out.iterdir()) == WRITTEN
    lines = (out / "tracks.csv").read_text().splitlines()
    assert lines[0] == HEADER
    assert len(read_tracks_csv(out / "tracks.csv").rows) == len(lines) - 1
    with xr.open_dataset(out / "result.nc", engine="h5netcdf") as dataset:
        assert (dataset.sizes["step"], dataset.sizes["obs"]) == (frames, len(lines) - 1)
        assert {"existence", "x", "vx", "position_covariance", "row_size", "status"} <= set(dataset.data_vars)
    with Image.open(out / "report.png") as image:
        assert image.size[0] > 800
    assert (out / "report.html").stat().st_size > 10_000
    assert yaml.safe_load((out / "config.yaml").read_text())["seed"] == 0


def share_found(out: Path, path: NDArray[np.float64]) -> float:
    """Share of the frames with the target in which existence says so and the track is at most 2 px off."""
    with xr.open_dataset(out / "result.nc", engine="h5netcdf") as found:
        places = np.full(path.shape, np.nan)
        places[found["obs_step"].values] = np.column_stack([found["x"], found["y"]])
        near = (found["step_existence"].values > 0.5) & (np.hypot(*(places - path).T) < 2)
    return float(near[np.isfinite(path[:, 0])].mean())


# what a new user does


def test_help_and_version_are_there(elusive_in: Callable[..., Ran]) -> None:
    assert elusive_in("--version").out == f"elusive {elusive.__version__}\n"
    ran = elusive_in("--help")
    assert ran.code == 0
    for command in ("track", "demo", "reproduce", "campaign"):
        assert command in ran.out
    ran = elusive_in("track", "images", "--help")
    assert ran.code == 0
    for option in ("--config", "--truth", "--rate-hz", "--particles", "--psf-sigma", "--turn-rate-deg", "--seed"):
        assert option in ran.out


@pytest.mark.parametrize(
    ("arguments", "loaded"), [("--help", "[]"), ("track --help", "[]"), ("track images --help", "['numba']")]
)
def test_only_the_system_asked_for_is_loaded(arguments: str, loaded: str) -> None:
    asked = "import sys; from elusive.cli import main\ntry: main(sys.argv[1:])\n"
    told = "finally: print(sorted({'numba', 'xarray', 'shapely', 'matplotlib', 'scipy.stats'} & sys.modules.keys()))"
    command = [sys.executable, "-c", asked + told, *arguments.split()]
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    assert ran.stdout.splitlines()[-1] == loaded


@pytest.mark.parametrize(("typed", "nearest"), [("trakc", "track"), ("track image", "images"), ("fit lnks", "links")])
def test_the_nearest_command_is_suggested(elusive_in: Callable[..., Ran], typed: str, nearest: str) -> None:
    ran = elusive_in(*typed.split())
    assert ran.code == 2
    assert f"Did you mean '{nearest}'" in ran.err


@pytest.mark.parametrize("is_terminal", [True, False])
def test_a_compilation_is_announced_once_and_in_a_terminal_alone(
    monkeypatch: pytest.MonkeyPatch, is_terminal: bool
) -> None:
    written = io.StringIO()
    console = Console(file=written, force_terminal=is_terminal, width=200)
    monkeypatch.setattr("elusive.cli.terminal.console", console)
    with bar("frames", 2):
        for step in (1, 2):
            numba.njit(lambda x, step=step: x + step)(1.0)
    announced = "Compiling: the first run of a filter takes up to a minute longer.\n"
    assert written.getvalue().count(announced.rstrip()) == is_terminal
    with bar("frames", 2):
        pass
    assert written.getvalue().count("Compiling") == is_terminal


def test_a_subprocess_finds_it_too(tmp_path: Path) -> None:
    for arguments, code in ((["--version"], 0), (["track", "images", "nothing.npy", "--out", "out"], 2)):
        ran = subprocess.run([*PROGRAM, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert ran.returncode == code
        assert "Traceback" not in ran.stderr
    assert ran.stderr == "Error: nothing.npy: there is no such file or folder; check the path.\n"
    assert list(tmp_path.iterdir()) == []


def test_what_is_said_of_a_path_stands_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    path = f"runs [red]/2026 :x: {'deep/' * 40}tracks.csv"
    say(f"Written to {path}")
    assert f"Written to {path}" in capsys.readouterr().err


@pytest.mark.thorough
@pytest.mark.usefixtures("painted")
def test_the_demo_is_the_same_for_the_same_seed_and_another_for_another(
    elusive_in: Callable[..., Ran], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("elusive.experiments.demo.TRIALS", 6)
    ran = elusive_in("demo", "--seed", "4")
    assert ran.code == 0, ran.err
    assert "track-before-detect" in ran.out
    assert "threshold" in ran.out
    assert elusive_in("demo", "--seed", "4", "--out", "again/deep").code == 0
    assert elusive_in("demo", "--seed", "5", "--out", "another").code == 0
    first, again = everything_in(tmp_path / "demo"), everything_in(tmp_path / "again" / "deep")
    assert sorted(first) == ["report.html", "report.png", "result.nc", "tracks.csv"]
    assert first == again
    assert first["tracks.csv"] != everything_in(tmp_path / "another")["tracks.csv"]
    assert first["tracks.csv"].decode().splitlines()[0] == HEADER  # type: ignore[union-attr]
    with xr.open_dataset(tmp_path / "demo" / "result.nc", engine="h5netcdf") as dataset:
        truth = dataset["truth"].values[:, [0, 2]]
        assert dataset["frames"].shape == (30, 20, 20)
        assert dataset.sizes["step"] == 30
    assert share_found(tmp_path / "demo", truth) >= 0.6


def test_the_demo_finds_what_a_threshold_loses() -> None:
    from elusive.experiments.demo import Comparison, compare
    from elusive.filters import BernoulliFilter, MeasurementBirth
    from elusive.systems.images.track import ImageTracking

    scenario = WeakTarget()
    model = BernoulliFilter(
        motion=scenario.target_motion, sensor=scenario.sensor, birth=MeasurementBirth(snr_db=scenario.snr_db)
    )
    found: Comparison = compare(scenario, ImageTracking(filter=model), 9, lambda done: None)
    # 60 trials of 19 frames; a trial's share spreads by at most one half, so two means differ by chance by .13 at most
    assert found.filter_found > found.threshold_found + 0.3
    assert 0 < found.false_alarms < 0.1


def test_a_weak_target_in_an_array_is_found(
    elusive_in: Callable[..., Ran], weak: tuple[NDArray[Any], NDArray[Any]], tmp_path: Path
) -> None:
    frames, path = weak
    np.save("weak.npy", frames)
    ran = elusive_in("track", "images", "weak.npy", "--out", "new/out", *WHITE)
    assert ran.code == 0, ran.err
    check_written(tmp_path / "new" / "out", 30)
    assert share_found(tmp_path / "new" / "out", path) >= 0.8
    assert "P above .5 in" in ran.out
    assert "Written to new/out" in ran.said
    before = {name: (tmp_path / "new" / "out" / name).read_bytes() for name in WRITTEN}
    # the same again over it, and its own config.yaml alone, repeat it to the byte
    assert elusive_in("track", "images", "weak.npy", "--out", "new/out", *WHITE).code == 0
    assert {name: (tmp_path / "new" / "out" / name).read_bytes() for name in WRITTEN} == before
    ran = elusive_in("track", "images", "weak.npy", "--out", "repeated", "--config", "new/out/config.yaml")
    assert ran.code == 0, ran.err
    assert {name: (tmp_path / "repeated" / name).read_bytes() for name in WRITTEN} == before
    assert elusive_in("track", "images", "weak.npy", "--out", "other", *WHITE, "--seed", "1").code == 0
    assert (tmp_path / "other" / "tracks.csv").read_bytes() != before["tracks.csv"]


FORMS = {
    "npy": "a.npy",
    "npz": "b.npz",
    "h5": "c.h5",
    "h5-named": "c.h5::/camera/frames",
    "png": "d",
    "glob": "d/*.png",
    "tiff": "e.tif",
    "gif": "f.gif",
}


@pytest.mark.parametrize("forms", longer([["npy", "h5-named", "png", "gif"], [*FORMS]], [*FORMS]), ids=["some", "all"])
def test_every_form_of_a_recording_gives_the_same_tracks(
    elusive_in: Callable[..., Ran], grey: tuple[NDArray[np.uint8], NDArray[Any]], tmp_path: Path, forms: list[str]
) -> None:
    frames, path = grey
    np.save("a.npy", frames)
    np.savez("b.npz", frames)
    with h5py.File("c.h5", "w") as file:
        file["camera/frames"] = frames
    save_images(tmp_path / "d", frames)
    tifffile.imwrite("e.tif", frames)
    pages = [Image.fromarray(frame) for frame in frames]
    pages[0].save("f.gif", save_all=True, append_images=pages[1:], duration=100)
    for name in forms:
        rate = ["--rate-hz", "10"]  # which the GIF says itself
        ran = elusive_in("track", "images", FORMS[name], "--out", name, *ENVELOPE, *(rate if name != "gif" else []))
        assert ran.code == 0, ran.err
        check_written(tmp_path / name, 22)
        assert (tmp_path / name / "tracks.csv").read_bytes() == (tmp_path / "npy" / "tracks.csv").read_bytes()
    assert share_found(tmp_path / "npy", path) >= 0.6
    with xr.open_dataset(tmp_path / "gif" / "result.nc", engine="h5netcdf") as dataset:
        np.testing.assert_allclose(dataset["step_time"], np.arange(22) / 10)


def test_a_truth_only_scores(
    elusive_in: Callable[..., Ran], weak: tuple[NDArray[Any], NDArray[Any]], tmp_path: Path
) -> None:
    frames, path = weak
    path = np.round(8 * path) / 8  # so that one more and one less is the same number
    np.save("weak.npy", frames)
    save_truth(tmp_path / "truth.txt", path)
    save_truth(tmp_path / "ones.txt", path + 1)
    assert elusive_in("track", "images", "weak.npy", "--out", "blind", *WHITE).code == 0
    ran = elusive_in("track", "images", "weak.npy", "--out", "scored", *WHITE, "--truth", "truth.txt")
    assert ran.code == 0, ran.err
    assert "Targets found within 4 px" in ran.out
    ones = elusive_in("track", "images", "weak.npy", "--out", "o", *WHITE, "--truth", "ones.txt", "--truth-one-based")
    assert ones.out == ran.out
    for name in ("tracks.csv", "result.nc", "config.yaml"):
        assert (tmp_path / "blind" / name).read_bytes() == (tmp_path / "scored" / name).read_bytes()
    assert (tmp_path / "o" / "report.html").read_bytes() == (tmp_path / "scored" / "report.html").read_bytes()
    assert (tmp_path / "blind" / "report.html").read_bytes() != (tmp_path / "scored" / "report.html").read_bytes()


def test_part_of_a_recording_keeps_its_frames_numbers(
    elusive_in: Callable[..., Ran], weak: tuple[NDArray[Any], NDArray[Any]], tmp_path: Path
) -> None:
    frames, path = weak
    np.save("weak.npy", frames)
    np.save("part.npy", frames[4:20])
    save_truth(tmp_path / "truth.txt", path)
    save_truth(tmp_path / "part.txt", path[4:20])
    part = ["--start", "4", "--stop", "20"]
    ran = elusive_in("track", "images", "weak.npy", "--out", "a", *WHITE, *part, "--truth", "truth.txt")
    assert ran.code == 0, ran.err
    assert elusive_in("track", "images", "part.npy", "--out", "b", *WHITE, "--truth", "part.txt").code == 0
    a, b = (xr.load_dataset(tmp_path / name / "result.nc", engine="h5netcdf") for name in "ab")
    assert a["step_time"].values.tolist() == list(range(4, 20))
    np.testing.assert_array_equal(a["step_existence"], b["step_existence"])
    texts = [(tmp_path / name / "tracks_mot.csv").read_text().splitlines() for name in "ab"]
    numbers = [[int(line.split(",")[0]) for line in lines] for lines in texts]
    assert [number - 4 for number in numbers[0]] == numbers[1]  # of the file's frames


def test_options_go_before_the_configuration_and_that_before_the_defaults(
    elusive_in: Callable[..., Ran], weak: tuple[NDArray[Any], NDArray[Any]], tmp_path: Path
) -> None:
    np.save("weak.npy", weak[0])
    given = {"seed": 7, "filter": {"particles": 300, "birth": {"snr_db": 9.0}}, "tracks": {"confirm_frames": 5}}
    (tmp_path / "c.yaml").write_text(yaml.safe_dump(given))
    arguments = ["--config", "c.yaml", "--noise-sigma", "3", "--particles", "400", "--turn-rate-deg", "2"]
    ran = elusive_in("track", "images", "weak.npy", "--out", "out", *arguments)
    assert ran.code == 0, ran.err
    used = yaml.safe_load((tmp_path / "out" / "config.yaml").read_text())
    assert (used["seed"], used["filter"]["particles"], used["tracks"]["confirm_frames"]) == (7, 400, 5)
    assert used["filter"]["birth"]["snr_db"] == 9.0
    assert (used["filter"]["sensor"]["kind"], used["filter"]["sensor"]["noise_sigma"]) == ("white", 3.0)
    assert used["filter"]["sensor"]["rows"] == 20
    with xr.open_dataset(tmp_path / "out" / "result.nc", engine="h5netcdf") as dataset:
        assert yaml.safe_load(dataset.attrs["config"]) == used
    text = (tmp_path / "out" / "config.yaml").read_text()
    assert "kind: ct" in text
    assert "turn_rate_deg: 2.0" in text


def test_a_few_masked_pixels_do_not_matter(
    elusive_in: Callable[..., Ran], weak: tuple[NDArray[Any], NDArray[Any]], tmp_path: Path
) -> None:
    frames, path = weak[0].copy(), weak[1]
    frames[:, 3, 15], frames[:, 17, 2], frames[9, :, 0] = np.nan, np.inf, -np.inf
    np.save("weak.npy", frames)
    ran = elusive_in("track", "images", "weak.npy", "--out", "out", *WHITE)
    assert ran.code == 0, ran.err
    check_written(tmp_path / "out", 30)
    assert share_found(tmp_path / "out", path) >= 0.8


@pytest.mark.parametrize(
    "shape", [(20, 20), (9, 70), (120, 33), pytest.param((768, 1024), marks=pytest.mark.thorough)], ids=str
)
def test_recordings_of_any_shape(elusive_in: Callable[..., Ran], tmp_path: Path, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(2)
    np.save("frames.npy", 3 * rng.standard_normal((4, *shape)))
    ran = elusive_in("track", "images", "frames.npy", "--out", "out", *WHITE)
    assert ran.code == 0, ran.err
    check_written(tmp_path / "out", 4)


# what goes wrong


def empty_folder(folder: Path) -> list[object]:
    (folder / "images").mkdir()
    return ["images"]


def truncated_png(folder: Path) -> list[object]:
    rng = np.random.default_rng(5)
    save_images(folder / "images", rng.integers(0, 255, (5, 60, 50), dtype=np.uint8))
    broken = folder / "images" / "frame3.png"
    broken.write_bytes(broken.read_bytes()[:200])
    return ["images"]


def sizes_differ(folder: Path) -> list[object]:
    save_images(folder / "images", np.random.default_rng(5).integers(0, 255, (5, 60, 50), dtype=np.uint8))
    Image.fromarray(np.eye(61, dtype=np.uint8)).save(folder / "images" / "frame3.png")
    return ["images"]


def all_nan(folder: Path) -> list[object]:
    np.save(folder / "frames.npy", np.full((6, 60, 50), np.nan))
    return ["frames.npy"]


def constant(folder: Path) -> list[object]:
    np.save(folder / "frames.npy", np.full((6, 60, 50), 7.0))
    return ["frames.npy"]


def good(folder: Path, *arguments: object) -> list[object]:
    np.save(folder / "frames.npy", np.random.default_rng(5).standard_normal((6, 60, 50)))
    return ["frames.npy", *arguments]


def config(text: str) -> Callable[[Path], list[object]]:
    def prepare(folder: Path) -> list[object]:
        (folder / "c.yaml").write_text(text)
        return good(folder, "--config", "c.yaml")

    return prepare


def truth(text: str) -> Callable[[Path], list[object]]:
    def prepare(folder: Path) -> list[object]:
        (folder / "t.txt").write_text(text)
        return good(folder, "--truth", "t.txt")

    return prepare


def option(*arguments: object) -> Callable[[Path], list[object]]:
    return lambda folder: good(folder, *arguments)


@pytest.mark.parametrize(
    ("prepare", "sentence"),
    [
        (empty_folder, "images: holds no image"),
        (truncated_png, "frame3.png"),
        (sizes_differ, "frame3.png"),
        (all_nan, "frame 0: 3000 of 3000 pixels are NaN or infinite"),
        (constant, "frame 0: all its pixels are 7"),
        (lambda folder: ["absent"], "absent: there is no such file or folder; check the path."),
        (option("--psf-sigma=-1"), "psf_sigma: must be greater than 0 (got -1.0)."),
        (option("--noise-sigma", 0), "noise_sigma: must be greater than 0 (got 0.0)."),
        (option("--noise-sigma", "nan"), "noise_sigma: must be a finite number (got nan)."),
        (option("--amplitude-spread=-2"), "amplitude_spread: must be greater than or equal to 0 (got -2.0)."),
        (option("--particles", 0), "particles: must be greater than or equal to 10 (got 0)."),
        (option("--newborns=-3"), "newborns: must be greater than or equal to 10 (got -3)."),
        (option("--birth-probability", 1.5), "birth_probability: must be less than or equal to 1 (got 1.5)."),
        (option("--delete-below", 0.7), "the levels must be in order"),
        (
            option("--motion", "cv", "--turn-rate-deg", 3),
            "--turn-rate-deg: has no meaning for motion 'cv', only for ct",
        ),
        (option("--start", 6), "has 6 frames, numbered from 0; start=6 is past the last"),
        (option("--start=-1"), "choose 0 <= start < stop"),
        (option("--rate-hz", 0), "rate_hz=0.0: must be a positive number of frames a second."),
        (
            config("filter: {kind: single, particels: 3}"),
            "particels: there is no such field; did you mean 'particles'",
        ),
        (config("sead: 3"), "ImageTracking.sead: there is no such field; did you mean 'seed'?"),
        (config("a: [1, 2\nb: }"), "c.yaml, line 2: is not valid YAML"),
        (config("- 1\n- 2\n"), "c.yaml: must hold 'name: value' pairs, not list."),
        (config("seed: two"), "ImageTracking.seed: must be a valid integer"),
        (option("--config", "gone.yaml"), "gone.yaml: cannot be read (No such file or directory); check the path."),
        (truth("1 2\n1 2\nabout here\n" + "1 2\n" * 3), "t.txt, line 3: 'about here' is no pair of numbers"),
        (truth("1 2\n" * 5), "t.txt: has 5 rows for 6 frames"),
        (truth(""), "t.txt: holds no position"),
        (option("--truth", "gone.txt"), "gone.txt"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_nothing(
    elusive_in: Callable[..., Ran], tmp_path: Path, prepare: Callable[[Path], list[object]], sentence: str
) -> None:
    arguments = prepare(tmp_path)
    before = everything_in(tmp_path)
    ran = elusive_in("track", "images", *arguments, "--out", "deep/out")
    assert ran.code == 2, ran.said
    assert sentence in ran.err
    assert ran.err.startswith("Error: ")
    assert ran.err.count("\n") == 1
    assert ran.err.rstrip().endswith((".", "?"))
    assert ran.out == ""
    assert everything_in(tmp_path) == before


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["track", "images"], "Missing argument 'SOURCE'"),
        (["track", "images", "frames.npy"], "Missing option '--out'"),
        (["track", "images", "frames.npy", "--out", "out", "--particles", "many"], "Invalid value for '--particles'"),
        (["track", "images", "frames.npy", "--out", "out", "--birth", "odd"], "'odd' is not one of"),
        (["track", "images", "frames.npy", "--out", "out", "--partcles", "3"], "No such option: --partcles"),
        (["reproduce", "amrouche2018", "fig2", "--out", "out", "--workers", "0"], "Invalid value for '--workers'"),
        (["reproduce", "amrouche2018", "fig2", "--out", "out", "--trials", "1"], "Invalid value for '--trials'"),
        (
            ["reproduce", "amrouche2018", "fig9", "--out", "out"],
            "'fig9': amrouche2018 has no such figure; known are fig1",
        ),
        (["campaign", "c.yaml", "--out", "out", "--workers", "0"], "Invalid value for '--workers'"),
        (["campaign", "gone.yaml", "--out", "out"], "gone.yaml: cannot be read"),
        (["demo", "--seed=-1"], "Invalid value for '--seed'"),
    ],
)
def test_what_no_command_takes_is_said(
    elusive_in: Callable[..., Ran], tmp_path: Path, arguments: list[str], sentence: str
) -> None:
    good(tmp_path)
    before = everything_in(tmp_path)
    ran = elusive_in(*arguments)
    assert ran.code == 2
    assert sentence.lower() in ran.said.lower()
    assert "Traceback" not in ran.said
    assert everything_in(tmp_path) == before


@pytest.mark.parametrize("command", [["track", "images", "frames.npy"], ["demo"], ["reproduce", "amrouche2018"]])
def test_out_that_is_a_file_is_left_alone(
    elusive_in: Callable[..., Ran], tmp_path: Path, command: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("elusive.experiments.demo.TRIALS", 2)
    good(tmp_path)
    (tmp_path / "out").write_text("mine")
    before = everything_in(tmp_path)
    ran = elusive_in(*command, "--out", "out")
    assert ran.code == 2
    assert ran.err == "Error: out: is a file; give the name of a folder.\n"
    assert everything_in(tmp_path) == before


# interruptions and campaigns


def test_ctrl_c_leaves_nothing(
    elusive_in: Callable[..., Ran], ctrl_c: Callable[[int], list[int]], tmp_path: Path
) -> None:
    good(tmp_path)
    before, frames = everything_in(tmp_path), ctrl_c(4)
    ran = elusive_in("track", "images", "frames.npy", "--out", "deep/out", *WHITE)
    assert ran.code == 130
    assert len(frames) == 4  # of 6: in the middle of it
    assert "Traceback" not in ran.said
    assert "Written" not in ran.said
    assert everything_in(tmp_path) == before


CAMPAIGN = {
    "scenario": "tests.campaign_trials:noisy",
    "grid": {"birth.snr_db": [1.0, 2.5], "bias": [0, 1]},
    "trials": 8,
    "seed": 5,
    "chunk": 4,
}


def test_a_campaign_stopped_goes_on_to_the_same_bytes(
    elusive_in: Callable[..., Ran], ctrl_c: Callable[[int], list[int]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(ROOT)
    (tmp_path / "c.yaml").write_text(yaml.safe_dump(CAMPAIGN, sort_keys=False))
    ctrl_c(4)
    ran = elusive_in("campaign", "c.yaml", "--out", "stopped.zarr")
    assert ran.code == 130
    assert "Traceback" not in ran.err
    done = tmp_path / "stopped.zarr" / "done" / "c"
    assert sum(path.is_file() for path in done.rglob("*")) == 3  # of 8
    ran = elusive_in("campaign", "c.yaml", "--out", "stopped.zarr")
    assert ran.code == 0, ran.err
    assert elusive_in("campaign", "c.yaml", "--out", "whole.zarr").code == 0
    assert everything_in(tmp_path / "stopped.zarr") == everything_in(tmp_path / "whole.zarr")

    (tmp_path / "c.yaml").write_text(yaml.safe_dump(CAMPAIGN | {"seed": 6}, sort_keys=False))
    before = everything_in(tmp_path)
    ran = elusive_in("campaign", "c.yaml", "--out", "whole.zarr")
    assert ran.code == 2
    assert "whole.zarr" in ran.err
    assert "seed (5 there, 6 here)" in ran.err
    assert everything_in(tmp_path) == before


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"scenario": "amrouche2081"}, "did you mean 'amrouche2018'"),
        ({"trails": 3}, "did you mean 'trials'"),
        ({"scenario": "amrouche2018", "grid": {"snr": [1]}}, "did you mean 'snr_db'"),
        ({"scenario": "amrouche2018", "grid": {"filter": ["best"]}}, "filter: must be 'paper'"),
        ({"trials": 0}, "trials: must be greater than 0"),
    ],
)
def test_a_bad_campaign_is_one_sentence_and_leaves_nothing(
    elusive_in: Callable[..., Ran], tmp_path: Path, changes: dict[str, Any], sentence: str
) -> None:
    (tmp_path / "c.yaml").write_text(yaml.safe_dump(CAMPAIGN | changes))
    before = everything_in(tmp_path)
    ran = elusive_in("campaign", "c.yaml", "--out", "store.zarr")
    assert ran.code == 2
    assert ran.err.startswith("Error: ")
    assert sentence in ran.err
    assert everything_in(tmp_path) == before


@pytest.mark.thorough
def test_reproducing_a_figure_shows_its_table(elusive_in: Callable[..., Ran], tmp_path: Path) -> None:
    ran = elusive_in("reproduce", "amrouche2018", "fig5", "--trials", "2", "--out", "paper")
    assert ran.code == 0, ran.err
    assert "2 trials" in ran.out
    assert "ct 6.71 dB" in ran.out
    assert {"fig5.png", "summary.csv"} <= {path.name for path in (tmp_path / "paper").iterdir()}


def test_no_room_for_what_is_compiled_is_a_sentence(monkeypatch, capsys):
    def refuse(**_):
        raise OSError(28, "No space left on device", "/cache/kernel.nbc")

    monkeypatch.setattr("elusive.cli.app", refuse)
    with pytest.raises(SystemExit) as ended:
        main([])
    assert ended.value.code == 2
    assert "No space left on device: '/cache/kernel.nbc'; make room on that disk." in capsys.readouterr().err


@pytest.mark.parametrize(
    ("module", "extra"),
    [
        ("shapely", "charts"),
        ("nicegui.ui", "workbench"),
        ("paho", "live"),
        ("imageio_ffmpeg", "video"),
        ("stray", None),
    ],
)
def test_what_is_not_installed_is_named_with_the_extra_that_brings_it(monkeypatch, capsys, module, extra):
    def load(**_):
        raise ModuleNotFoundError(f"No module named '{module}'", name=module)

    monkeypatch.setattr("elusive.cli.app", load)
    with pytest.raises(SystemExit if extra else ModuleNotFoundError) as ended:
        main([])
    if extra:
        assert ended.value.code == 2
        assert f"{module} is not installed; run pip install 'elusive[{extra}]'." in capsys.readouterr().err


def test_a_simulation_that_needs_what_is_not_installed_leaves_nothing(elusive_in, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "shapely", None)
    ran = elusive_in("simulate", "video", "--turns", "2", "--out", "sea")
    assert (ran.code, list(tmp_path.iterdir())) == (2, [])
    assert "shapely is not installed; run pip install 'elusive[charts]'." in ran.err
