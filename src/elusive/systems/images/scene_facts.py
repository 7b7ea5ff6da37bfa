"""What recorded frames show of their scene, whoever tracks in them: where it changes to another, what rests in it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.contracts import Array
from elusive.preprocess.robust import MAD
from elusive.tracking.peak_alone import RIVALS

SIDE = 32  # cells of a frame's shorter side where scenes are compared
WIDE = 9  # cells, over which their level is taken off
EARLY, MEMORY, THIN = 8, 16.0, 4  # first frames averaged; frames of the average that follows, of which every fourth
POINT_PX, AROUND_PX = 1.0, 3.0  # widths of a point and of what is about it
APART_PX = 5  # from one point to the next
CUT, KEPT = 0.62, 256  # likeness of two scenes at most; of frames, kept


class RestingPoint(NamedTuple):
    """The highest point of a scene that stays on one pixel from the first frames to the last."""

    x: float
    y: float
    height: float  # [deviations of the averaged scene]
    next_heights: Array  # (n,) of the next ones, the highest first


class SceneFacts:
    """Takes frames as they are tracked through, at constant memory."""

    def __init__(self) -> None:
        self.count = 0
        self.likeness: list[float] = []  # correlation of a scene, laid over the one before, with that; evenly
        self.least, self.least_at = np.inf, 0  # the least of all, and its frame
        self.cuts = 0  # frames less like the one before than two scenes at most are
        self._every = 1
        self._last: tuple[NDArray[np.complex128], float] | None = None
        self._early: NDArray[np.float32] | None = None
        self._late: NDArray[np.float32] | None = None

    def add(self, frame: Array) -> None:
        """Take a frame ``(rows, columns)``, NaN where masked."""
        single = frame.astype(np.float32)
        if not np.isfinite(single.sum()):
            single = np.nan_to_num(single, nan=float(np.nanmedian(frame)))
        coarse = _coarse(single)
        spectrum, power = np.fft.rfft2(coarse), float(np.sum(coarse**2))
        if self._last is not None:
            before, earlier = self._last
            together = np.fft.irfft2(spectrum * np.conj(before), s=coarse.shape)
            self._compare(float(together.max() / max((power * earlier) ** 0.5, 1e-12)))
        self._last = spectrum, power
        if self._early is None or self._late is None:
            self._early, self._late = single.copy(), single
        elif self.count < EARLY:
            self._early += (single - self._early) / (self.count + 1)
        if self.count % THIN == 0:
            self._late = self._late + np.float32(max(THIN / (self.count + THIN), THIN / MEMORY)) * (single - self._late)
        self.count += 1

    def _compare(self, alike: float) -> None:
        self.cuts += alike < CUT
        if alike < self.least:
            self.least, self.least_at = alike, self.count
        if self.count % self._every == 0 or not self.likeness:
            self.likeness.append(alike)
        if len(self.likeness) > KEPT:
            self.likeness, self._every = self.likeness[::2], 2 * self._every

    @property
    def resting(self) -> RestingPoint | None:
        """The point that stays; None where the highest of the last frames is not there in the first."""
        if self._early is None or self._late is None:
            return None
        early, late = _points(self._early), _points(self._late)
        row, column = map(int, np.unravel_index(late.argmax(), late.shape))
        height = float(late[row, column])
        here = slice(max(row - 1, 0), row + 2), slice(max(column - 1, 0), column + 2)
        if not early[here].max() > 0.7 * height:
            return None
        _leave_out(late, row, column)
        return RestingPoint(float(column), float(row), height, np.array([_next_of(late) for _ in range(RIVALS + 1)]))


def _leave_out(points: Array, row: int, column: int) -> None:
    """Take a point out, in place."""
    rows, columns = (slice(max(at - APART_PX, 0), at + APART_PX + 1) for at in (row, column))
    points[rows, columns] = 0.0


def _next_of(points: Array) -> float:
    """Return the height of the highest point, which is taken out, in place."""
    row, column = map(int, np.unravel_index(points.argmax(), points.shape))
    height = float(points[row, column])
    _leave_out(points, row, column)
    return height


def _coarse(frame: NDArray[np.float32]) -> Array:
    """Means of blocks of a frame less their surroundings, their scale taken off."""
    size = max(min(frame.shape) // SIDE, 1)
    rows, columns = (length // size for length in frame.shape)
    blocks = frame[: rows * size, : columns * size].reshape(rows, size, columns, size).mean(axis=(1, 3))
    blocks = blocks - ndimage.uniform_filter(blocks, WIDE)
    scale = float(np.quantile(np.abs(blocks), 0.9)) or 1.0
    return np.asarray(np.clip(blocks / scale, -2, 2))


def _points(scene: NDArray[np.float32]) -> Array:
    """How far points of a scene stand out of what is about them, in deviations of all of it."""
    narrow = ndimage.gaussian_filter(scene, POINT_PX) - ndimage.gaussian_filter(scene, AROUND_PX)
    return np.asarray(np.abs(narrow) / max(MAD * float(np.median(np.abs(narrow))), 1e-9), dtype=np.float64)
