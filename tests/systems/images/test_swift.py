"""What goes by too fast to be followed is told, and nothing is said of what is followed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from elusive.systems.images.checks import FrameChecks
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.track import track_images

ROWS, COLUMNS, FRAMES, FIRST = 96, 160, 40, 15


def said(px):
    """The finding of a still scene of soft clouds, through which a spot goes again and again; 0: none does."""
    rng = np.random.default_rng(3)
    clouds = 10 * ndimage.gaussian_filter(rng.standard_normal((ROWS, COLUMNS)), 5)
    frames = 120 + clouds / clouds.std() + rng.normal(0, 2.0, (FRAMES, ROWS, COLUMNS))
    row, column = np.indices((ROWS, COLUMNS))
    x, y = 5.0, 20.0
    for frame in frames[FIRST:] if px else ():
        frame += 20 * np.exp(-((column - x) ** 2 + (row - y) ** 2) / (2 * 1.3**2))
        x, y = x + 0.95 * px, y + 0.3 * px
        if x > COLUMNS:
            x, y = rng.uniform(2, 20), rng.uniform(10, 40)
    parameters = ImageTracking().bind((ROWS, COLUMNS))
    checks = FrameChecks(parameters)
    for step in track_images(np.clip(np.round(frames), 0, 255).astype(np.uint8), parameters):
        checks.take(step)
    (found,) = [one for one in checks.findings() if one.name == "images.swift"]
    return found


@pytest.mark.parametrize("px", [18.0, 30.0])
def test_a_spot_that_goes_by_is_told(px):
    found = said(px)
    assert not found.holds
    assert not found.grave
    assert f"by {px:.0f} px each" in found.sentence


@pytest.mark.parametrize("px", [0.0, 4.0])
def test_what_is_followed_or_is_not_there_is_not(px):
    assert said(px).holds
