"""Recorded frames made whole: gaps filled from about them, pixels that are stuck replaced by their neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.preprocess import scales
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.stuck import StuckPixels, StuckState

FILL_PX = 4.0  # width of the surroundings from which gaps are filled
SUSPECT = 4.0  # deviations from which a point may be a stuck pixel
DOUBT = 0.1  # share of its path from which a pixel is watched

Mask = NDArray[np.bool_]


def fill_gaps(image: Image, number: int) -> tuple[Image, list[Mask] | None]:
    """Fill what is not finite from about it, and tell where each scale does not see enough; None where all is seen."""
    if np.isfinite(image.sum()):
        return image, None
    gaps = ~np.isfinite(image)
    if gaps.all():
        raise DataError(f"frame {number}: no pixel is finite; drop it.")
    known = np.where(gaps, 0.0, image - np.median(image[~gaps]))
    share = ndimage.gaussian_filter((~gaps).astype(np.float32), FILL_PX)
    fill = np.median(image[~gaps]) + ndimage.gaussian_filter(known, FILL_PX) / np.maximum(share, 1e-3)
    hidden, gap = [], gaps
    for k in range(scales.count_of(image.shape)):
        gap = gap if k == 0 else ndimage.maximum_filter(gap, 3)[::2, ::2]
        hidden.append(ndimage.maximum_filter(gap, 5))
    return np.where(gaps, fill, image).astype(np.float32), hidden


def without_stuck(image: Image, judge: StuckPixels, state: StuckState) -> Image:
    """Replace pixels that are known to be stuck by the median of their neighbours."""
    if state.travelled_px < judge.path_px:
        return image
    rows, columns = np.nonzero(judge.mask(state))
    if not len(rows):
        return image
    whole = image.copy()
    whole[rows, columns] = np.median(_neighbours(image, rows, columns), axis=0)
    return whole


def watch(image: Image, judge: StuckPixels, state: StuckState, places_px: Array, moved_px: float) -> StuckState:
    """Judge pixels at ``(2, m)`` places of points, and those watched, by a frame as recorded after the scene moved."""
    if not moved_px:
        return state
    watched = state.share > DOUBT
    column, row = np.round(places_px).astype(int)
    watched[np.clip(row, 0, len(image) - 1), np.clip(column, 0, image.shape[1] - 1)] = True
    rows, columns = np.nonzero(watched)
    about = _neighbours(image, rows, columns)
    level = np.median(about, axis=0)
    spike = np.zeros(image.shape, dtype=bool)
    spike[rows, columns] = np.abs(image[rows, columns] - level) > judge.neighbour_ratio * np.abs(about - level).max(
        axis=0
    )
    return judge.mark(state, spike, moved_px)


def _neighbours(image: Image, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Image:
    """Values of the eight neighbours, ``(8, m)``, mirrored at the edge."""
    around = [(j, i) for j in (-1, 0, 1) for i in (-1, 0, 1) if j or i]
    mirrored = np.pad(image, 1, mode="reflect")
    return np.stack([mirrored[rows + 1 + j, columns + 1 + i] for j, i in around])
