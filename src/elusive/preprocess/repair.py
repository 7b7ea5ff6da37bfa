"""Recorded frames made whole: gaps filled from about them, pixels that are stuck replaced by their neighbours."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.preprocess import scales
from elusive.preprocess._repair_kernels import surroundings
from elusive.preprocess._scale_kernels import Image, Mask
from elusive.preprocess.stuck import StuckPixels

FILL_PX, NEXT_PX = 4.0, 1.0  # width of the surroundings from which gaps are filled, and of a lone pixel's
NEXT_SHARE = 0.3  # of what is about a pixel, next to it, which must be known to fill it
LOST_PX, LOST_SHARE = 1.5, 0.5  # where so much is missing within such a width, nothing is seen
SUSPECT = 4.0  # deviations from which a point may be a stuck pixel
FORGIVEN, FORGET_PX = 2.0, 5.0  # deviations of its mean height below which a pixel is none, after such a path

BESIDE = (0, 1, 2, 5, 6, 7), (0, 3, 5, 2, 4, 7)  # of the eight neighbours, those in other rows; in other columns


def fill_gaps(image: Image, number: int) -> tuple[Image, list[Mask] | None]:
    """Fill what is not finite from about it, and tell where each scale does not see enough; None where all is seen.

    A pixel missing here and there is known from those next to it, and hides nothing.
    """
    if np.isfinite(image.sum()):
        return image, None
    gaps = ~np.isfinite(image)
    if gaps.all():
        raise DataError(f"frame {number}: no pixel is finite; drop it.")
    level = np.median(image[~gaps])
    known = np.where(gaps, 0.0, image - level).astype(np.float32)
    fill, _ = _mean_about(known, gaps, FILL_PX)
    nearest, near = _mean_about(known, gaps, NEXT_PX)
    fill = level + np.where(near > NEXT_SHARE, nearest, fill)
    missing = gaps.astype(np.float32)
    hidden = []
    for k in range(scales.count_of(image.shape)):
        missing = missing if k == 0 else ndimage.uniform_filter(missing, 3)[::2, ::2]
        lost = ndimage.gaussian_filter(missing, LOST_PX) > LOST_SHARE
        hidden.append(ndimage.maximum_filter(lost, 7))
    return np.where(gaps, fill, image).astype(np.float32), hidden


def _mean_about(known: Image, gaps: Mask, width_px: float) -> tuple[Image, Image]:
    """Mean of what is known about each pixel, and the share of what is about it that is known."""
    share = ndimage.gaussian_filter((~gaps).astype(np.float32), width_px)
    return ndimage.gaussian_filter(known, width_px) / np.maximum(share, np.float32(1e-3)), share


def joined(hidden: list[Mask] | None, others: list[Mask] | None) -> list[Mask] | None:
    """Return where either is hidden, scale by scale."""
    if hidden is None or others is None:
        return others if hidden is None else hidden
    return [gap | other for gap, other in zip(hidden, others, strict=True)]


class Watched(NamedTuple):
    """Pixels that may be stuck, by their number in the frame, increasing, and their means since they were suspected.

    They are looked at whenever the scene has gone by a pixel: it leaves little in a mean, and what is stuck stays.
    """

    pixels: NDArray[np.int64]  # (n,)
    height: Array  # (n,) over the median of the eight about it, mean over the scene's path
    square: Array  # (n,) the same of the height's square
    about: Array  # (8, n) heights of the eight
    looks: Array  # (n,) each after the scene went a pixel
    scene_px: Array  # (2,) x, y: the scene's offset at the last look


NONE_WATCHED = Watched(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros((8, 0)), np.zeros(0), np.zeros(2))


def without_stuck(image: Image, judge: StuckPixels, state: Watched) -> Image:
    """Replace pixels that are known to be stuck by the median of their neighbours."""
    stuck = state.pixels[_stuck(judge, state)]
    if not len(stuck):
        return image
    whole = image.copy()
    whole.ravel()[stuck] = surroundings(image, stuck)[1]
    return whole


def watch(image: Image, judge: StuckPixels, state: Watched, places_px: Array, scene_px: Array) -> Watched:
    """Judge pixels at ``(2, m)`` places of points, and those watched, by a frame as recorded and its scene's offset."""
    if np.abs(scene_px - state.scene_px).max() < 1.0:
        return state
    column, row = np.round(places_px).astype(int)
    rows, columns = image.shape
    points = np.clip(row, 0, rows - 1) * columns + np.clip(column, 0, columns - 1)
    pixels, which = np.unique(np.concatenate([state.pixels, points]), return_inverse=True)
    known = which[: len(state.pixels)]
    looks = np.ones(len(pixels))
    looks[known] += state.looks
    gain = 1.0 / np.minimum(looks, judge.memory_px)
    near, level = surroundings(image, pixels)
    height = image.ravel()[pixels] - level
    means = []
    for before, now in ((state.height, height), (state.square, height**2), (state.about, near - level)):
        mean = np.zeros_like(now)
        mean[..., known] = before
        means.append(mean + gain * (now - mean))
    height, square, about = means
    kept = (looks <= FORGET_PX) | (_sureness(judge, height, square, looks) > FORGIVEN)
    return Watched(pixels[kept], height[kept], square[kept], about[:, kept], looks[kept], scene_px)


def _sureness(judge: StuckPixels, height: Array, square: Array, looks: Array) -> Array:
    """Mean height of each pixel in deviations of that mean."""
    spread = np.maximum(square - height**2, 1e-12)
    found: Array = np.abs(height) * np.sqrt(np.minimum(looks, judge.memory_px) / spread)
    return found


def _stuck(judge: StuckPixels, state: Watched) -> NDArray[np.int64]:
    """Say which are stuck: surely high, and narrower than optics let a point be, each way or, of a pair, one way."""
    sure = _sureness(judge, state.height, state.square, state.looks) > judge.spike
    # hardly any of those watched are so high, so long
    which = np.flatnonzero(sure & (state.looks > judge.path_px))
    height, about = np.abs(state.height[which]), np.abs(state.about[:, which])
    each_way = height > judge.neighbour_ratio * about.max(axis=0)
    one_way = [height > judge.neighbour_ratio**2 * about[list(line)].max(axis=0) for line in BESIDE]
    found: NDArray[np.int64] = which[each_way | one_way[0] | one_way[1]]
    return found
