"""The trail of a target: evidence about its path in the latest frames, and the best path through it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.filters.accumulate._accumulated import most_of_square
from elusive.filters.accumulate.recurrent import Map
from elusive.tracking import _trail_kernels as kernels
from elusive.tracking.footprint import Border


class Seen(NamedTuple):
    """One of the latest frames. Places in the scene are places in the frame less ``scene_px``."""

    time_s: float
    scene_px: Array  # (2,) x, y
    evidence: Map  # (rows, columns) left over by the known targets; a signal has one row
    deviation: float  # of evidence without a target


class Trail(NamedTuple):
    """Evidence about the path of one target, frame by frame, the oldest first."""

    times_s: Array  # (K,)
    corners: Array  # (K, 2) place of each patch's first cell in the scene, x, y
    patches: Map  # (K, rows, columns)

    def ages(self, time_s: float) -> Array:
        """Return how long ago the frames were, ``(K,)``."""
        found: Array = time_s - self.times_s
        return found

    def values(self, time_s: float, path: Array) -> Array:
        """Return the evidence of each frame along a path that is at this time, ``(K,)``."""
        found: Array = kernels.values(self.patches, self.corners, self.ages(time_s), path)
        return found

    def places(self, time_s: float, path: Array, shape: tuple[int, ...], border: Border) -> Array:
        """Return where the path was in each frame of a resting scene, ``(K, ndim)``; NaN outside of a bounded one."""
        lengths = np.array(shape[::-1])
        found: Array = (path[:2] - self.ages(time_s)[:, None] * path[2:])[:, : len(lengths)]
        if border == "circular":
            return np.asarray(found % lengths)
        inside = ((found >= -0.5) & (found <= lengths - 0.5)).all(axis=1, keepdims=True)
        return np.where(inside, found, np.nan)

    def total(self, time_s: float, path: Array, smoothing: float) -> float:
        """Return the sum of the evidence along a path, faded by its age."""
        ages = self.ages(time_s)
        return float(kernels.total(self.patches, self.corners, ages, smoothing**ages, path))

    def climbed(self, time_s: float, path: Array, smoothing: float, step: float, frames: int | None = None) -> Array:
        """Return the path nearby along which most evidence of the latest frames lies."""
        ages = self.ages(time_s)[-(frames or 0) :]
        last = len(ages)
        found: Array = kernels.climb(
            self.patches[-last:], self.corners[-last:], ages, smoothing**ages, np.asarray(path, dtype=float), step
        )
        return found

    def after(self, other: Trail, most: int) -> Trail:
        """Return the trail with later frames."""
        return Trail(*(np.concatenate([old, new])[-most:] for old, new in zip(self, other, strict=True)))


def cut(frames: Sequence[Seen], time_s: float, path: Array, half: int, border: Border) -> Trail:
    """Cut patches out of frames, so many cells to each side of a path that is at this time; zero outside."""
    shape = frames[-1].evidence.shape
    halves = [0 if length == 1 else half for length in shape]
    patches = np.zeros((len(frames), *(2 * reach + 1 for reach in halves)), np.float32)
    corners = np.empty((len(frames), 2))
    for k, seen in enumerate(frames):
        place = path[:2] - (time_s - seen.time_s) * path[2:] + seen.scene_px
        first = np.rint(place).astype(int) - halves[::-1]
        corners[k] = first - seen.scene_px
        cells = [at + np.arange(2 * reach + 1) for at, reach in zip(first[::-1], halves, strict=True)]
        patches[k] = seen.evidence[np.ix_(*(c % n for c, n in zip(cells, shape, strict=True)))]
        if border == "bounded":
            inside = [(c >= 0) & (c < n) for c, n in zip(cells, shape, strict=True)]
            patches[k] *= np.outer(*inside)
    return Trail(np.array([seen.time_s for seen in frames]), corners, patches)


def frame_deviation(evidence: Map) -> float:
    """Return the deviation of a frame's evidence, in which a target hardly counts; one where nothing varies."""
    most = most_of_square(evidence)
    return math.sqrt(float(np.minimum(np.square(evidence, dtype=np.float64), most).mean())) or 1.0
