"""A frame that is deformed against the last one: against the map it was drawn with, and against chance."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import ndimage

from elusive.preprocess import scales
from elusive.preprocess.deformation import UNKNOWN, deformation

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
    last, image = (scales.responses(frame - np.float32(100), 3)[1] for frame in frames)
    return deformation(image, last, np.array(step), 1, UNKNOWN)[0]


@pytest.mark.parametrize(
    "linear", [[[0.02, 0.0], [0.0, 0.02]], [[0.0, 0.014], [-0.014, 0.0]], [[0.0, 0.0], [0.02, 0.0]]]
)
@pytest.mark.parametrize("step", [(0.0, 0.0), (1.4, -0.6)])
def test_zoom_roll_and_ground_are_found(linear: list[list[float]], step: tuple[float, float]) -> None:
    ways = []
    for seed in range(8):
        way = found(views(seed, np.array(linear), step), step)
        assert way is not None
        ways.append(way)
    linear_found = np.array(ways)[:, 1:]
    # the deviation of the eight is the error of each; their mean is off by less than a tenth of the map besides
    error = linear_found.std(axis=0, ddof=1) / np.sqrt(8)
    assert np.all(np.abs(linear_found.mean(axis=0) - linear) < 4.5 * error + 0.1 * np.abs(linear).max())
    middle = np.array([COLUMNS, ROWS]) / 2
    assert np.abs([way[0] + middle @ way[1:] for way in ways]).max() < 0.5


@pytest.mark.parametrize("step", [(0.0, 0.0), (1.4, -0.6), (0.5, 0.0)])
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


def test_a_slow_roll_is_found_by_several_frames_together() -> None:
    """One frame lays most parts better, but not enough of them: what is far from the middle moved, and surely."""
    alone, together = [], []
    for seed in range(4):
        frames = views(seed, np.array([[0.0, 0.0025], [-0.0025, 0.0]]), (0.0, 0.0), frames=9)
        maps, better = [scales.responses(frame - np.float32(100), 3)[1] for frame in frames], UNKNOWN
        for k, (last, image) in enumerate(pairwise(maps)):
            way, better = deformation(image, last, np.zeros(2), 1, better)
            if k > 3:
                together.append(way is not None)
                alone.append(deformation(image, last, np.zeros(2), 1, UNKNOWN)[0] is not None)
    assert np.mean(alone) < 0.8 < 0.9 < np.mean(together)
