"""Recordings of cameras that are not what they are taken for, told nothing: named, or tracked all the same."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy import ndimage

from elusive.contracts import Array
from tests.cli.test_radar import Run
from tests.longer import longer

FRAMES, ROWS, COLUMNS, NOISE = 70, 128, 160, 2.0
SETTLED, DUE, NEAR_PX = 10, 40, 4.0  # frames from which a target is to be followed, and shown; its track's distance
TRACK = ["track", "images", "frames.npy", "--out", "out"]
WAY = np.array([12.0, 40.0]) + np.arange(FRAMES)[:, None] * np.array([1.7, 0.6])  # the target's, in the frame


def seen(
    rng: np.random.Generator,
    pan: tuple[float, float] = (0.0, 0.0),
    *,
    target: bool = True,
    roll: float = 0.0,
    soft_px: float = 5.0,
) -> Array:
    """Clouds with little fine detail, over which a camera pans or rolls, and a target of ten deviations; grey levels.

    ``roll`` is in radians a frame, about the middle.
    """
    scene = ndimage.gaussian_filter(rng.standard_normal((400, 400)), soft_px)
    scene *= 9 / scene.std()
    row, column = np.indices((ROWS, COLUMNS))
    frames = []
    for k, (x, y) in enumerate(WAY):
        dx, dy = k * np.array(pan)
        u, v, turn = column - COLUMNS / 2 - dx, row - ROWS / 2 - dy, k * roll
        at = [
            np.cos(turn) * v - np.sin(turn) * u + 120 + ROWS / 2,
            np.cos(turn) * u + np.sin(turn) * v + 120 + COLUMNS / 2,
        ]
        view = 120 + ndimage.map_coordinates(scene, at, order=3)
        if target:
            view += 10 * NOISE * np.exp(-((column - x) ** 2 + (row - y) ** 2) / (2 * 1.2**2))
        frames.append(view + rng.normal(0, NOISE, view.shape))
    return np.array(frames)


def grey(frames: Array) -> np.ndarray:
    return np.clip(np.round(frames), 0, 255).astype(np.uint8)


def as_jpeg(frame: Array) -> np.ndarray:
    """A frame as a camera compresses it."""
    file = io.BytesIO()
    Image.fromarray(grey(frame)).save(file, "JPEG", quality=60)
    return np.array(Image.open(file))


def deep(frames: Array) -> np.ndarray:
    """Fourteen bits in sixteen."""
    return np.round(7000 + 12 * (frames - 120)).astype(np.uint16)


def other_octet_first(rng: np.random.Generator) -> np.ndarray:
    return deep(seen(rng)).byteswap()


def each_twice(rng: np.random.Generator) -> np.ndarray:
    return np.repeat(grey(seen(rng))[::2], 2, axis=0)


def every_fifth_twice(rng: np.random.Generator) -> np.ndarray:
    """Film at 24 frames a second, written at 30."""
    return grey(seen(rng, (-0.2, -0.2)))[np.arange(FRAMES) - np.arange(FRAMES) // 5]


def black_hot(rng: np.random.Generator) -> np.ndarray:
    """White is hot, and from the middle on black."""
    frames = seen(rng)
    frames[FRAMES // 2 :] = 240 - frames[FRAMES // 2 :]
    return grey(frames)


def wrapped(rng: np.random.Generator) -> np.ndarray:
    """Twelve bits that do not hold the brightest twentieth, which goes on from 0."""
    frames = seen(rng)
    low, high = np.quantile(frames, [0.0, 0.95])
    return np.round((frames - low) / (high - low) * 4095).astype(np.uint16) & 4095


def shutter(rng: np.random.Generator) -> np.ndarray:
    """Twice the shutter is before the sensor for five frames."""
    frames = seen(rng)
    for at in (25, 50):
        frames[at : at + 5] = 128 + rng.normal(0, NOISE, (5, ROWS, COLUMNS))
    return grey(frames)


ODD: dict[str, tuple[Callable[[np.random.Generator], np.ndarray], str, str]] = {
    "other octet first": (other_octet_first, "frames.octets", "with the other octet first"),
    "each twice": (each_twice, "frames.repeated", "35 of 69 frames are copies"),
    "every fifth twice": (every_fifth_twice, "frames.repeated", "13 of 69 frames are copies"),
    "black hot": (black_hot, "frames.cut", "Frame 35 shows another scene"),
    "shutter": (shutter, "frames.cut", "shows another scene"),
    "wrapped": (wrapped, "frames.folded", "as if 12 bits did not hold them"),
}


def failing(folder: Path) -> set[str]:
    return {one["name"] for one in json.loads((folder / "out/checks.json").read_text()) if not one["holds"]}


def rows_of(folder: Path) -> np.ndarray:
    """Rows of what is confirmed, from the frame on at which a target is to be followed."""
    table = np.genfromtxt(folder / "out/tracks.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    return table[(table["status"] == "confirmed") & (table["time_s"] >= SETTLED)]


def off_target(rows: np.ndarray) -> Array:
    place = WAY[rows["time_s"].astype(int)]
    return np.hypot(rows["x_px"] - place[:, 0], rows["y_px"] - place[:, 1])


@pytest.mark.parametrize(
    "name", longer(ODD, "every fifth twice", "black hot", "wrapped", "shutter", "other octet first")
)
def test_it_is_named(elusive_in: Run, tmp_path: Path, name: str) -> None:
    draw, finding, sentence = ODD[name]
    np.save(tmp_path / "frames.npy", draw(np.random.default_rng([6, list(ODD).index(name)])))
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    assert finding in failing(tmp_path), said
    assert sentence in " ".join(said.split())


RIGHT: dict[str, Callable[[np.random.Generator], np.ndarray]] = {
    "still": lambda rng: grey(seen(rng)),
    "pan": lambda rng: grey(seen(rng, (-0.85, 0.2))),
    "slow pan": lambda rng: grey(seen(rng, (0.15, 0.4))),
    "deep": lambda rng: deep(seen(rng)),
}


@pytest.mark.parametrize("name", longer(RIGHT, "deep", "slow pan", "pan"))
def test_a_target_is_shown_and_nothing_else(elusive_in: Run, tmp_path: Path, name: str) -> None:
    """Panned over soft clouds, their parts were shown as movers."""
    np.save(tmp_path / "frames.npy", RIGHT[name](np.random.default_rng([6, 20 + list(RIGHT).index(name)])))
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    assert failing(tmp_path) == set(), said
    rows = rows_of(tmp_path)
    off = off_target(rows)
    due = (rows["time_s"] >= DUE) & (off < NEAR_PX)
    assert len(np.unique(rows["time_s"][off < NEAR_PX])) > 0.9 * (FRAMES - SETTLED)
    assert len(np.unique(rows["time_s"][due & (rows["shown"] == 1)])) > 0.9 * (FRAMES - DUE)
    assert np.count_nonzero((rows["shown"] == 1) & (off > 2 * NEAR_PX)) < 0.1 * FRAMES


def test_where_nothing_is_nothing_is_shown(elusive_in: Run, tmp_path: Path) -> None:
    np.save(tmp_path / "frames.npy", grey(seen(np.random.default_rng([6, 30]), (-0.85, 0.2), target=False)))
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    assert failing(tmp_path) == set(), said
    assert np.count_nonzero(rows_of(tmp_path)["shown"] == 1) < 0.1 * FRAMES


@pytest.mark.thorough
@pytest.mark.parametrize("target", [True, False])
def test_a_camera_that_rolls_shows_no_part_of_its_scene(elusive_in: Run, tmp_path: Path, *, target: bool) -> None:
    """So few of its parts were sure tracks that they did not tell how the camera turns, and were shown as movers."""
    rng = np.random.default_rng([6, 40, target])
    np.save(tmp_path / "frames.npy", grey(seen(rng, target=target, roll=0.014, soft_px=3.0)))
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    rows = rows_of(tmp_path)
    wrong = (rows["shown"] == 1) & ((off_target(rows) > 2 * NEAR_PX) | (not target))
    assert np.count_nonzero(wrong & (rows["existence"] > 0.9)) < 0.2 * FRAMES
    if target:
        due = (rows["time_s"] >= DUE) & (off_target(rows) < NEAR_PX) & (rows["shown"] == 1)
        assert len(np.unique(rows["time_s"][due])) > 0.9 * (FRAMES - DUE)


@pytest.mark.thorough
def test_a_blinking_mark_is_named_and_not_shown(elusive_in: Run, tmp_path: Path) -> None:
    """Its parts were sure tracks that moved, as it went and came, and nothing was said."""
    frames = grey(seen(np.random.default_rng([6, 50]), target=False))
    on = np.arange(FRAMES) // 9 % 2 == 0
    frames[on, 12:21, 20:22] = frames[on, 12:14, 20:27] = frames[on, 16:18, 20:27] = 255  # a letter
    np.save(tmp_path / "frames.npy", frames)
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    assert "images.written" in failing(tmp_path), said
    assert "is written into 27 of 70 frames" in " ".join(said.split())
    rows = rows_of(tmp_path)
    assert not np.count_nonzero((rows["shown"] == 1) & (rows["existence"] > 0.9))


@pytest.mark.thorough
@pytest.mark.parametrize("target", [True, False])
def test_a_clock_with_soft_edges_is_named_and_not_shown(elusive_in: Run, tmp_path: Path, *, target: bool) -> None:
    """Compressed, before a scene that goes by: its digits were taken for parts of that, and surely moved."""
    frames = seen(np.random.default_rng([6, 60, target]), (-0.85, 0.2), target=target)
    coded = []
    for k, frame in enumerate(frames):
        large = Image.new("L", (2 * COLUMNS, 2 * ROWS))
        ImageDraw.Draw(large).text((20, 216), f"12:04:{k // 10:02d}", fill=255, font_size=26)
        cover = np.asarray(large, float).reshape(ROWS, 2, COLUMNS, 2).mean(axis=(1, 3)) / 255
        coded.append(as_jpeg(frame + cover * (235 - frame)))
    np.save(tmp_path / "frames.npy", np.array(coded))
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    assert "images.written" in failing(tmp_path), said
    rows = rows_of(tmp_path)
    wrong = (rows["shown"] == 1) & ((off_target(rows) > 2 * NEAR_PX) | (not target))
    assert np.count_nonzero(wrong & (rows["existence"] > 0.9)) < 0.1 * FRAMES
    if target:
        due = (rows["time_s"] >= DUE) & (off_target(rows) < NEAR_PX) & (rows["shown"] == 1)
        assert len(np.unique(rows["time_s"][due])) > 0.9 * (FRAMES - DUE)


@pytest.mark.thorough
def test_a_gate_about_a_target_is_named_and_the_target_shown(elusive_in: Run, tmp_path: Path) -> None:
    """Its corners were shown, a few pixels beside the target, and hid it."""
    coded = []
    for frame, (x, y) in zip(seen(np.random.default_rng([6, 70])), np.round(WAY), strict=True):
        large = Image.new("L", (4 * COLUMNS, 4 * ROWS))
        pen = ImageDraw.Draw(large)
        for a, b in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            corner = 4 * (x + 8 * a) + 2, 4 * (y + 7 * b) + 2
            pen.line((*corner, corner[0] - 12 * a, corner[1]), fill=255, width=4)
            pen.line((*corner, corner[0], corner[1] - 12 * b), fill=255, width=4)
        cover = np.asarray(large, float).reshape(ROWS, 4, COLUMNS, 4).mean(axis=(1, 3)) / 255
        coded.append(as_jpeg(frame + cover * (255 - frame)))
    np.save(tmp_path / "frames.npy", np.array(coded))
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    assert "images.boxes" in failing(tmp_path), said
    rows = rows_of(tmp_path)
    shown = rows[(rows["shown"] == 1) & (rows["time_s"] >= DUE)]
    at = off_target(shown) < NEAR_PX
    assert len(np.unique(shown["time_s"][at])) > 0.9 * (FRAMES - DUE)
    assert np.count_nonzero(~at & (shown["existence"] > 0.9)) <= 0.1 * (FRAMES - DUE)
