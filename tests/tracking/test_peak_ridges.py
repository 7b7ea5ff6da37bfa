"""Sharp edges that a camera pans over are nothing that moves; what goes along a road is."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from scipy.special import ndtr

from elusive.systems.images.track import ImageTracking, track_images
from tests.longer import longer

SIZE = 96
Y, X = np.mgrid[:SIZE, :SIZE].astype(float)


def shown(scenes: Iterable[np.ndarray], rng: np.random.Generator) -> list[np.ndarray]:
    """Places and existence of what is shown in each of some scenes, in noise of one grey level, ``(n, 3)``."""
    frames = (np.round(1000 + 3 * (scene + rng.normal(size=scene.shape))) for scene in scenes)
    return [
        np.array(
            [[*t.mean[[0, 2]], t.existence] for t in step.tracks if t.status == "confirmed" and t.extra["shown"]]
        ).reshape(-1, 3)
        for step in track_images(frames, ImageTracking().bind((SIZE, SIZE)))
    ]


def test_what_slides_along_an_edge_is_not_shown() -> None:
    rng = np.random.default_rng(28)
    lines = [(rng.uniform(0, np.pi), rng.uniform(-40, 40), rng.normal(0, 40)) for _ in range(4)]
    pan = rng.normal(0, 0.35, 2) * np.arange(90)[:, None] + np.cumsum(rng.normal(0, 0.05, (90, 2)), 0)
    # half planes through optics and pixels of .4 px
    scenes = (
        sum(
            height * ndtr(((X - 48 + x) * np.cos(angle) + (Y - 48 + y) * np.sin(angle) - off) / 0.4)
            for angle, off, height in lines
        )
        for x, y in pan
    )
    found = shown((np.asarray(scene) for scene in scenes), rng)
    # in 19 frames, one a frame, were what is on an edge shown
    assert sum((one[:, 2] > 0.9).sum() for one in found) <= 3


@pytest.mark.parametrize(("pan", "height"), longer([(0.0, 9.0), (0.3, 15.0)], (0.0, 9.0)))
def test_what_goes_along_a_road_is_shown(pan: float, height: float) -> None:
    rng = np.random.default_rng(3)
    way = np.column_stack([6 + 1.3 * np.arange(60), 50.3 + pan * np.arange(60)])
    scenes = (
        20 * np.exp(-((Y - y) ** 2) / 2)
        + 8 * np.sin(X / 9) * np.cos((Y - y) / 7)
        + height * np.exp(-((X - x) ** 2 + (Y - y) ** 2) / 2)
        for x, y in way
    )
    found = [np.hypot(*(one[:, :2] - place).T) < 4 for one, place in zip(shown(scenes, rng), way, strict=True)]
    assert np.mean([near.any() for near in found[30:]]) >= 0.9
