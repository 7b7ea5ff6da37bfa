"""Scenes of several targets, tracked and scored: what the tests of several targets and their full grid share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import X, Y
from elusive.results.scores import score
from elusive.sensors import ImageSensor
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.results import ImageLog
from elusive.systems.images.simulate import ImageSimulation, draw_images
from elusive.systems.images.track import track_images

SIDE, FRAMES, NEAR_PX = 64, 60, 4.0
SENSOR = ImageSensor(rows=SIDE, columns=SIDE, psf_sigma=1.0, noise_sigma=1.0)
# the SNR is told as a range alone, and the top speed
KNOWN: dict[str, Any] = {
    "kind": "several", "sensor": SENSOR, "birth": {"snr_db_range": (5.0, 15.0), "max_speed": 1.0}
}  # fmt: skip


class Ran(NamedTuple):
    """A scene tracked: its scores, and each row of a track with what is true of it."""

    gospa: float  # mean over the frames [px]
    found: float
    switches: float  # of identity, a target
    rmse_px: float
    false: float  # tracks a frame
    rows: np.ndarray  # (n, 2) existence of a track in a frame, and whether a target is there
    squares: np.ndarray  # (m,) normalised squared errors of sure tracks away from others


def scene(targets: int, layout: str, snr_db: float, seed: int) -> ImageSimulation:
    """Targets that appear one after the other, meet in the middle of 64 x 64 pixels and leave."""
    stagger = 0 if targets == 2 else 3
    return ImageSimulation(
        targets=targets, layout=layout, snr_db=snr_db, stagger=stagger, frames=FRAMES, appears=2, leaves=57,
        rows=SIDE, columns=SIDE, velocity_x=0.6, velocity_y=0.1, start_x=10.0, start_y=28.0, sensor=SENSOR, seed=seed,
    )  # fmt: skip


def tracking(seed: int = 0, **known: Any) -> ImageTracking:
    return ImageTracking(filter=KNOWN | known, seed=seed)


def run(frames: Iterable[np.ndarray], truth: np.ndarray, parameters: ImageTracking) -> Ran:
    """Track frames and score them; ``truth`` is ``(T, targets, 2)``."""
    log = ImageLog(parameters)
    rows, squares = [], []
    for step, true in zip(track_images(frames, parameters), truth, strict=True):
        log.append(step)
        there = true[np.isfinite(true[:, 0])]
        for track in step.tracks:
            if track.status == "deleted":
                continue
            apart = np.hypot(*(there - track.mean[[X, Y]]).T)
            rows.append((track.existence, bool(len(apart)) and apart.min() < NEAR_PX))
            alone = len(there) == 1 or (len(there) > 1 and np.sort(apart)[1] > 8.0)
            if track.existence > 0.99 and alone and apart.min() < NEAR_PX:
                off = there[np.argmin(apart)] - track.mean[[X, Y]]
                squares.append(off @ np.linalg.solve(track.covariance[np.ix_([X, Y], [X, Y])], off))
    scores = score(log, truth, NEAR_PX, ("confirmed", "candidate"))
    targets = max(1, int(np.isfinite(truth[:, :, 0]).any(axis=0).sum()))
    return Ran(
        scores.mean_gospa, scores.found, scores.mismatches / targets, scores.rmse, scores.false / len(truth),
        np.array(rows).reshape(-1, 2), np.array(squares),
    )  # fmt: skip


def run_scene(targets: int, layout: str, snr_db: float, seed: int, **known: Any) -> Ran:
    drawn = draw_images(scene(targets, layout, snr_db, seed))
    return run(drawn.frames, drawn.truth, tracking(seed, **known))
