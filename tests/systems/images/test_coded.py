"""Video whose coder repeats blocks while the camera pans, drawn."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from elusive.systems.images.checks import FrameChecks
from elusive.systems.images.track import ImageTracking, track_images

FRAMES, ROWS, COLUMNS, BLOCK, PAN = 50, 96, 128, 16, 0.7


def panned(rng: np.random.Generator, repeated: float) -> np.ndarray:
    """Clouds that go by, of whose blocks so many are left as they were, for four frames in a row at most."""
    clouds = ndimage.gaussian_filter(rng.normal(size=(ROWS, COLUMNS + 60)), 3)
    clouds = ndimage.spline_filter(100 + 12 * clouds / clouds.std())
    rows, columns = np.indices((ROWS, COLUMNS), dtype=float)
    frames, age = [], np.zeros((ROWS // BLOCK, COLUMNS // BLOCK), np.int64)
    for k in range(FRAMES):
        seen = ndimage.map_coordinates(clouds, [rows, columns + PAN * k], prefilter=False, mode="nearest")
        frame = np.round(seen + rng.normal(0, 1.5, seen.shape)).astype(np.uint8)
        kept = (rng.random(age.shape) < repeated) & (age < 4) & (k > 0)
        age = np.where(kept, age + 1, 0)
        frames.append(np.where(np.kron(kept, np.ones((BLOCK, BLOCK), bool)), frames[-1], frame) if k else frame)
    return np.array(frames)


@pytest.mark.parametrize("repeated", [0.0, 0.5])
def test_repeated_blocks_are_named_and_make_nothing_move(repeated: float) -> None:
    frames = panned(np.random.default_rng(1), repeated)
    parameters = ImageTracking().bind((ROWS, COLUMNS))
    checks, wrong = FrameChecks(parameters), 0
    for step in track_images(frames, parameters):
        checks.take(step)
        wrong += sum(
            track.extra["shown"] and track.status == "confirmed" and track.existence > 0.9 for track in step.tracks
        )
    holds = {finding.name: finding.holds for finding in checks.findings()}
    assert holds["images.coded"] == (repeated == 0)
    assert wrong <= 2  # of fifty frames
