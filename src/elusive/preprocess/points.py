"""Points in white noise: how wide, how bright, brighter or darker; found without labels.

A point of known width is sought by the matched filter; its width by the likelihood ratio maximised over width, place
and amplitude (van Trees (1968), section 4.4), that of all points together.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import ndtri

from elusive.contracts import Array

WIDTHS_PX = np.geomspace(0.4, 4.0, 40)  # sought
COARSE_PX = (0.6, 1.0, 1.7, 2.9)  # in which points are found
HALF_PX = 8  # of a patch
OFFSETS_PX = np.linspace(-0.5, 0.5, 5)  # of a point from its pixel's centre
FALSE_POINTS = 0.5  # of noise, that all frames together may show
MOST = 4000  # points kept, the highest
SINGLE, WIDER = 0.4, 1.3  # share of points that no other overlaps, at least, and how much wider than these others are


class Points(NamedTuple):
    """Points that stand out of all frames' noise, k of them."""

    frame: NDArray[np.int64]  # (k,) number
    patches: Array  # (k, (2 HALF_PX + 1)^2) about each [noise deviations], the sign such that the point is bright
    bright: NDArray[np.bool_]  # (k,) whether it is brighter than the level
    level: float  # least response [deviations]


class Placed(NamedTuple):
    """Where k points of a frame are."""

    places_px: Array  # (k, 2) x, y, between pixels
    deviation_px: Array  # (k,) of each along an axis, at best (Cramer-Rao)
    bright: NDArray[np.bool_]  # (k,) whether it is brighter than the level


class PointFinder:
    """Finds peaks of the matched filter that noise alone would hardly show, frame by frame.

    Parameters
    ----------
    pixels
        Of all frames together, about: it sets the level.
    """

    def __init__(self, pixels: int) -> None:
        self.level = float(-ndtri(min(FALSE_POINTS / (2 * len(COARSE_PX) * max(pixels, 1)), 0.5)))
        self._found: list[tuple[float, int, bool, Array]] = []  # height, frame, whether bright, patch
        self._count = 0

    def add(self, frame: Array) -> Placed:
        """Take a frame of white noise of deviation one about zero, NaN where masked; give its points."""
        known = np.nan_to_num(frame)
        responses = np.stack([ndimage.gaussian_filter(known, s, mode="constant") / _energy(s) for s in COARSE_PX])
        highest = np.abs(responses).max(axis=0)
        peaks = np.argwhere((highest == ndimage.maximum_filter(highest, HALF_PX + 1)) & (highest > self.level))
        for row, column in peaks.tolist():
            top, left = row - HALF_PX, column - HALF_PX
            if min(top, left) >= 0 and row + HALF_PX < frame.shape[0] and column + HALF_PX < frame.shape[1]:
                bright = bool(responses[np.abs(responses[:, row, column]).argmax(), row, column] > 0)
                patch = known[top : row + HALF_PX + 1, left : column + HALF_PX + 1].ravel()
                height = float(highest[row, column])
                self._found.append((height, self._count, bright, patch if bright else -patch))
        if len(self._found) > 2 * MOST:
            self._found = sorted(self._found, key=lambda one: -one[0])[:MOST]
        self._count += 1
        return _placed(responses, peaks)

    @property
    def points(self) -> Points:
        """Those that lie whole within a frame; of very many the highest."""
        size = (2 * HALF_PX + 1) ** 2
        return Points(
            np.array([one[1] for one in self._found], np.int64),
            np.array([one[3] for one in self._found]).reshape(-1, size),
            np.array([one[2] for one in self._found], np.bool_),
            self.level,
        )


def _placed(responses: Array, peaks: NDArray[np.int64]) -> Placed:
    """Place peaks ``(k, 2)`` of responses ``(widths, rows, columns)`` between pixels, by parabolas of the strongest."""
    row, column = peaks.T
    heights = np.abs(responses[:, row, column])
    best = heights.argmax(axis=0) if len(peaks) else np.zeros(0, np.int64)
    most = heights.max(axis=0, initial=0.0)
    padded = np.abs(np.pad(responses, ((0, 0), (1, 1), (1, 1)), mode="edge"))
    places = np.empty((len(peaks), 2))
    for axis, (down, along) in enumerate(((0, 1), (1, 0))):
        before = padded[best, row + 1 - down, column + 1 - along]
        after = padded[best, row + 1 + down, column + 1 + along]
        bend = np.maximum(2 * most - before - after, 1e-9 * most)
        places[:, axis] = (column, row)[axis] + np.clip(0.5 * (after - before) / bend, -0.5, 0.5)
    deviation = math.sqrt(2) * np.array(COARSE_PX)[best] / np.maximum(most, 1e-9)
    return Placed(places, deviation, responses[best, row, column] > 0)


def responses_of(points: Points) -> Array:
    """Response of each point to each width of WIDTHS_PX at its best place, ``(k, widths)`` [deviations]."""
    found = np.empty((len(points.patches), len(WIDTHS_PX)))
    for j, width in enumerate(WIDTHS_PX):
        found[:, j] = (points.patches @ _templates(float(width)).T).max(axis=1, initial=-np.inf)
    return found


def width_of(responses: Array) -> float:
    """Return the width that makes points most likely together, between those tabulated by a parabola [px]."""
    score = np.sum(np.maximum(responses, 0.0) ** 2, axis=0)
    best = int(np.clip(score.argmax(), 1, len(score) - 2))
    before, here, after = score[best - 1 : best + 2]
    bend = before - 2 * here + after
    shift = float(np.clip(0.5 * (before - after) / bend, -1, 1)) if bend < 0 else 0.0
    return float(np.exp(np.interp(best + shift, np.arange(len(score)), np.log(WIDTHS_PX))))


def single_width_of(responses: Array) -> float:
    """Return the width of points that are by themselves [px]: two that overlap are found as one, and that is wider."""
    own = WIDTHS_PX[responses.argmax(axis=1)]
    return width_of(responses[own <= WIDER * np.quantile(own, SINGLE)])


def peaks_of(responses: Array, width_px: float) -> Array:
    """Height of each point above the level, ``(k,)`` [deviations], at a width."""
    at = np.interp(np.log(width_px), np.log(WIDTHS_PX), np.arange(len(WIDTHS_PX)))
    low = min(int(at), len(WIDTHS_PX) - 2)
    response = responses[:, low] + (at - low) * (responses[:, low + 1] - responses[:, low])
    return np.asarray(response / _length(width_px))


def _templates(width: float) -> Array:
    """Points of a width at all offsets, of unit length, ``(offsets^2, pixels)``."""
    grid = np.arange(-HALF_PX, HALF_PX + 1)
    along = np.exp(-0.5 * ((grid - OFFSETS_PX[:, None]) / width) ** 2)
    bells = np.einsum("ir,jc->ijrc", along, along).reshape(len(OFFSETS_PX) ** 2, -1)
    return np.asarray(bells / np.linalg.norm(bells, axis=1, keepdims=True))


def _length(width: float) -> float:
    """Root of the summed squares of a point of unit height."""
    bell = np.exp(-0.5 * (np.arange(-4 * HALF_PX, 4 * HALF_PX + 1) / width) ** 2)
    return float(bell @ bell)


def _energy(width: float) -> float:
    """Deviation of white noise after a Gaussian filter."""
    impulse = np.zeros(8 * HALF_PX + 1)
    impulse[4 * HALF_PX] = 1.0
    kernel = ndimage.gaussian_filter1d(impulse, width)
    return float(kernel @ kernel)
