"""What is fast is followed; what goes by too fast for that is told, and nothing is said of what is followed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from scipy import ndimage

from elusive.checks import Finding
from elusive.systems.images.checks import FrameChecks
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.track import track_images
from tests.longer import longer

ROWS, COLUMNS, FRAMES, FIRST = 96, 160, 40, 15


class Seen(NamedTuple):
    told: Finding
    shown: float  # share of the frames from a spot's eighth with a shown track at it
    others: int  # other shown tracks that move


def seen(px: float) -> Seen:
    """A still scene of soft clouds, through which a spot goes again and again; 0: none does."""
    rng = np.random.default_rng(3)
    clouds = 10 * ndimage.gaussian_filter(rng.standard_normal((ROWS, COLUMNS)), 5)
    frames = 120 + clouds / clouds.std() + rng.normal(0, 2.0, (FRAMES, ROWS, COLUMNS))
    row, column = np.indices((ROWS, COLUMNS))
    place, age, due = np.full((FRAMES, 2), np.nan), 0, np.zeros(FRAMES, bool)
    x, y = 5.0, 20.0
    for k, frame in enumerate(frames[FIRST:] if px else (), FIRST):
        frame += 20 * np.exp(-((column - x) ** 2 + (row - y) ** 2) / (2 * 1.3**2))
        place[k], due[k], age = (x, y), age > 6, age + 1
        x, y = x + 0.95 * px, y + 0.3 * px
        if x > COLUMNS:
            x, y, age = rng.uniform(2, 20), rng.uniform(10, 40), 0
    parameters = ImageTracking().bind((ROWS, COLUMNS))
    checks, at, others = FrameChecks(parameters), np.zeros(FRAMES, bool), 0
    for k, step in enumerate(track_images(np.clip(np.round(frames), 0, 255).astype(np.uint8), parameters)):
        checks.take(step)
        for track in step.tracks:
            if track.extra["shown"] and track.status == "confirmed":
                near = np.hypot(*(track.mean[[0, 2]] - place[k])) < 4
                at[k], others = at[k] | near, others + (not near and track.extra["moves"] > 0.5)
    (told,) = [one for one in checks.findings() if one.name == "images.swift"]
    return Seen(told, float(at[due].mean()) if due.any() else np.nan, others)


def test_what_is_too_fast_to_be_followed_is_told() -> None:
    told = seen(30.0).told
    assert not told.holds
    assert not told.grave
    assert "by 30 px each" in told.sentence


@pytest.mark.parametrize("px", longer([0.0, 4.0, 18.0], 0.0))
def test_nothing_is_said_of_what_is_followed(px: float) -> None:
    found = seen(px)
    assert found.told.holds
    assert found.others <= 2
    if px > 4:
        assert found.shown > 0.5  # before, none
