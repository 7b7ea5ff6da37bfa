"""Recorded frames made whole: gaps filled from about them, pixels that are stuck replaced by their neighbours."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.preprocess import scales
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.stuck import StuckPixels

FILL_PX = 4.0  # width of the surroundings from which gaps are filled
SUSPECT = 4.0  # deviations from which a point may be a stuck pixel
DOUBT, FORGOTTEN = 0.1, 1e-3  # share of its path from which a pixel is watched, and below which it is none

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


class Watched(NamedTuple):
    """Pixels that were spikes, by their number in the frame, increasing; the others' share is zero."""

    pixels: NDArray[np.int64]  # (n,)
    share: Array  # (n,) of the scene's path over which each was a spike
    travelled_px: float  # length of that path, each step counted as one pixel at most


NONE_WATCHED = Watched(np.zeros(0, np.int64), np.zeros(0), 0.0)


def without_stuck(image: Image, judge: StuckPixels, state: Watched) -> Image:
    """Replace pixels that are known to be stuck by the median of their neighbours."""
    stuck = state.pixels[state.share > judge.share]
    if state.travelled_px < judge.path_px or not len(stuck):
        return image
    whole = image.copy()
    whole.ravel()[stuck] = np.median(_neighbours(image, stuck), axis=0)
    return whole


def watch(image: Image, judge: StuckPixels, state: Watched, places_px: Array, moved_px: float) -> Watched:
    """Judge pixels at ``(2, m)`` places of points, and those watched, by a frame as recorded after the scene moved."""
    if not moved_px:
        return state
    column, row = np.round(places_px).astype(int)
    rows, columns = image.shape
    points = np.clip(row, 0, rows - 1) * columns + np.clip(column, 0, columns - 1)
    pixels, which = np.unique(np.concatenate([state.pixels, points]), return_inverse=True)
    share, looked_at = np.zeros(len(pixels)), np.zeros(len(pixels), np.bool_)
    share[which[: len(state.pixels)]] = state.share
    looked_at[which[len(state.pixels) :]] = True
    looked_at |= share > DOUBT
    about = _neighbours(image, pixels[looked_at])
    level = np.median(about, axis=0)
    spike = np.zeros(len(pixels))
    spike[looked_at] = np.abs(image.ravel()[pixels[looked_at]] - level) > judge.neighbour_ratio * np.abs(
        about - level
    ).max(axis=0)
    travelled_px = state.travelled_px + min(moved_px, 1.0)
    share += judge.gain(travelled_px, moved_px) * (spike - share)
    kept = share > FORGOTTEN
    return Watched(pixels[kept], share[kept], travelled_px)


def _neighbours(image: Image, pixels: NDArray[np.int64]) -> Image:
    """Values of the eight neighbours, ``(8, m)``, mirrored at the edge."""
    around = np.array([(j, i) for j in (-1, 0, 1) for i in (-1, 0, 1) if j or i])
    row, column = (at + step[:, None] for at, step in zip(np.divmod(pixels, image.shape[1]), around.T, strict=True))
    mirrored = [size - 1 - np.abs(size - 1 - np.abs(at)) for at, size in zip((row, column), image.shape, strict=True)]
    found: Image = image[mirrored[0], mirrored[1]]
    return found
