"""Pixels that flash for a frame, where many do: snow of a disturbed transmission, or hits of particles.

No source; an own test. Optics spread a point over its neighbours and an impulse is one pixel; a point comes again in
the next frame and an impulse does not. A few are told by the tracker, as they continue nothing; many hide targets.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from elusive.contracts import Array
from elusive.preprocess._scale_kernels import Image

HEIGHT = 8.0  # deviations from which a pixel may be an impulse
NARROW = 4.0  # times as high as the four beside it on the mean: a point of a spread of .6 px and more is not
AGAIN = 0.5  # of its height, with which it is seen again
MANY, LEAST = 0.002, 8  # share of the pixels, and number, from which impulses are taken out
SPARSE = 16  # of so many rows one is looked at first
UPPER = 0.75  # quantile by which noise is known: what is drawn in a scene is rough, too, in places

BESIDE = np.array([(0, -1), (0, 1), (-1, 0), (1, 0)])
RING = np.array([(j, i) for j in range(-2, 3) for i in range(-2, 3) if max(abs(j), abs(i)) == 2])


def without_impulses(image: Image, last: Image | None, step_px: Array) -> Image:
    """Return the frame with NaN where a pixel flashes, if many do.

    Parameters
    ----------
    image
        ``(rows, columns)``, as recorded; NaN where nothing is known.
    last
        The frame before; None: there is none, and nothing is taken out.
    step_px
        ``(2,)`` x, y by which the scene has moved from that frame, as far as is known.
    """
    if last is None:
        return image
    for every in (SPARSE, 1):
        flashes = _flashes(image, last, step_px, every)
        if len(flashes) < max(MANY * image.size, LEAST) / every:
            return image
    whole = image.copy()
    whole.ravel()[flashes] = np.nan
    return whole


def _flashes(image: Image, last: Image, step_px: Array, every: int) -> NDArray[np.int64]:
    """Numbers of the pixels that flash, in every so-many-th row."""
    lines = image[::every]
    curved = np.abs(lines[:, 1:-1] - np.float32(0.5) * (lines[:, :-2] + lines[:, 2:]))
    known = curved[:, ::4][np.isfinite(curved[:, ::4])]
    usual = float(np.quantile(known, UPPER)) if len(known) else 0.0
    if not usual:  # in few grey levels a step of one looks like it
        return np.zeros(0, np.int64)
    row, column = np.nonzero(curved > HEIGHT / ndtri((1 + UPPER) / 2) * usual)
    pixels = every * row * image.shape[1] + column + 1
    level, height = _height(image, pixels)
    beside = np.abs(np.median(_values_about(image, pixels, BESIDE), axis=0) - level)
    before = pixels - int(np.rint(step_px[1])) * image.shape[1] - int(np.rint(step_px[0]))
    _, as_high = _height(last, np.clip(before, 0, image.size - 1))
    narrow = np.abs(height) > NARROW * beside
    return np.asarray(pixels[narrow & (as_high * np.sign(height) < AGAIN * np.abs(height))])


def _height(image: Image, pixels: NDArray[np.int64]) -> tuple[Image, Image]:
    """Median about pixels, and their heights over it."""
    level: Image = np.median(_values_about(image, pixels, RING), axis=0)
    return level, image.ravel()[pixels] - level


def _values_about(image: Image, pixels: NDArray[np.int64], steps: NDArray[np.int64]) -> Image:
    """Values at steps ``(n, 2)`` of rows and columns from pixels ``(m,)``, ``(n, m)``, mirrored at the edge."""
    row, column = (at + step[:, None] for at, step in zip(np.divmod(pixels, image.shape[1]), steps.T, strict=True))
    mirrored = [size - 1 - np.abs(size - 1 - np.abs(at)) for at, size in zip((row, column), image.shape, strict=True)]
    found: Image = image[mirrored[0], mirrored[1]]
    return found
