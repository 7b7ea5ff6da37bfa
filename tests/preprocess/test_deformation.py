"""A frame that is deformed against the last one: against the map it was drawn with, and against chance."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import ndimage

from elusive.preprocess import scales
from elusive.preprocess.deformation import Deforming, deformation
from tests.longer import longer

ROWS, COLUMNS = 144, 176
STILL = np.zeros((2, 2))


def views(
    seed: int, linear: np.ndarray, step: tuple[float, float], depth: float = 10.0, frames: int = 2
) -> list[np.ndarray]:
    """Views of a soft scene, each so deformed about its middle and shifted again, in noise of two grey levels."""
    rng = np.random.default_rng(seed)
    scene = ndimage.gaussian_filter(rng.standard_normal((400, 400)), 4)
    scene *= depth / scene.std()
    row, column = np.indices((ROWS, COLUMNS)).astype(float)
    seen = []
    for k in range(frames):
        moved, shift = np.linalg.matrix_power(np.eye(2) + linear, k), k * np.array(step)
        place = np.stack([column - COLUMNS / 2 - shift[0], row - ROWS / 2 - shift[1]], axis=-1) @ np.linalg.inv(moved)
        view = ndimage.map_coordinates(scene, [place[..., 1] + 200, place[..., 0] + 200], order=3)
        seen.append((view + rng.normal(0, 2.0, view.shape)).astype(np.float32))
    return seen


def found(frames: list[np.ndarray], step: tuple[float, float]) -> np.ndarray | None:
    return told(frames, step)[-1]


def told(frames: list[np.ndarray], step: tuple[float, float] = (0.0, 0.0)) -> list[np.ndarray | None]:
    """Say how each frame is deformed, of a scene that goes a step in each."""
    ways, known = [], Deforming()
    for frame in frames:
        way, known = deformation(scales.responses(frame - np.float32(100), 3)[1], np.array(step), 1, known)
        ways.append(way)
    return ways


@pytest.mark.parametrize(
    "linear", [[[0.02, 0.0], [0.0, 0.02]], [[0.0, 0.014], [-0.014, 0.0]], [[0.0, 0.0], [0.02, 0.0]]]
)
@pytest.mark.parametrize("step", [(0.0, 0.0), (1.4, -0.6)])
def test_zoom_roll_and_ground_are_found(linear: list[list[float]], step: tuple[float, float]) -> None:
    """Of eight scenes; in one at most two frames alone may not tell, as in clouds that are laid better by chance."""
    every = (found(views(seed, np.array(linear), step), step) for seed in range(8))
    ways = [way for way in every if way is not None]
    assert len(ways) >= 7
    linear_found = np.array(ways)[:, 1:]
    # the deviation of them is the error of each; their mean is off by less than a tenth of the map besides
    error = linear_found.std(axis=0, ddof=1) / np.sqrt(len(ways))
    assert np.all(np.abs(linear_found.mean(axis=0) - linear) < 4.5 * error + 0.1 * np.abs(linear).max())
    middle = np.array([COLUMNS, ROWS]) / 2
    assert np.abs([way[0] + middle @ way[1:] for way in ways]).max() < 0.5


@pytest.mark.parametrize("step", longer([[0.0, 0.0], [1.4, -0.6], [0.5, 0.0]], [0.0, 0.0], [0.5, 0.0]))
@pytest.mark.parametrize("depth", [0.0, 1.0, 10.0])
def test_what_is_only_shifted_or_noise_is_not_deformed(step: tuple[float, float], depth: float) -> None:
    for seed in range(30):
        frames = views(seed, STILL, step, depth or 1.0)
        if not depth:
            frames = [np.random.default_rng([seed, k]).normal(100, 2, frames[0].shape).astype("f4") for k in range(2)]
        assert found(frames, step) is None


def test_a_large_thing_that_moves_is_no_deformation() -> None:
    row, column = np.indices((ROWS, COLUMNS))
    for seed in range(10):
        frames = views(seed, STILL, (0.0, 0.0))
        for k, frame in enumerate(frames):
            frame += 40 * np.exp(-((((column - 40 - 3 * k) / 12) ** 2 + ((row - 50) / 8) ** 2) ** 2))
        assert found(frames, (0.0, 0.0)) is None


def test_what_is_little_from_frame_to_frame_adds_up() -> None:
    """A roll of .07 degrees moves the corner by an eighth of a pixel; no frame shows it against the one before."""
    roll = np.array([[0.0, 0.0012], [-0.0012, 0.0]])
    corner, off, alone = np.array([COLUMNS, ROWS]) / 2, [], 0
    for seed in range(3):
        frames = views(seed, roll, (0.0, 0.0), frames=26)
        alone += sum(found(list(pair), (0.0, 0.0)) is not None for pair in pairwise(frames))
        ways = told(frames)[12:]
        assert all(way is not None for way in ways)
        # where the corner of the frame before is now, less where it should be, summed
        off.append(sum(way[0] + 2 * corner @ way[1:] - corner @ roll for way in ways if way is not None))
    assert alone < 0.2 * 3 * 25
    # errors against one earlier frame do not add up; there are two of them, of a tenth of a pixel each
    assert np.abs(off).max() < 0.4


def test_a_scene_that_only_goes_by_is_never_deformed_however_long() -> None:
    for seed in range(3):
        assert all(way is None for way in told(views(seed, STILL, (0.7, -0.4), frames=30), (0.7, -0.4)))


def test_a_camera_that_turns_back_is_taken_to_go_on() -> None:
    there = views(2, np.array([[0.0, 0.003], [-0.003, 0.0]]), (0.0, 0.0), frames=12)
    ways = told(there + there[-2::-1])[6:]
    turns = [way[1, 1] - way[2, 0] for way in ways if way is not None]
    assert len(turns) == len(ways)
    assert min(turns[:5]) > 0.0 > max(turns[-5:])
