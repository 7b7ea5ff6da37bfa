"""Pixels that flash for a frame, where many do: snow of a disturbed transmission, or hits of particles.

No source; an own test. Optics spread a point over its neighbours and an impulse is one pixel; a point comes again in
the next frame and an impulse does not. A few are told by the tracker, as they continue nothing; many hide targets.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess import _impulse_kernels
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.scales import quantile_of

HEIGHT = 8.0  # deviations from which a pixel may be an impulse
NARROW = 4.0  # times as high as the four beside it on the mean: a point of a spread of .6 px and more is not
AGAIN = 0.5  # of its height, with which it is seen again
MANY, LEAST = 0.002, 8  # share of the pixels, and number, from which impulses are taken out
SPARSE = 16  # of so many rows one is looked at first
UPPER = 0.75  # quantile by which noise is known: what is drawn in a scene is rough, too, in places
NORMAL_UPPER = 1.1503494  # the same of the magnitude of a standard normal


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
    bent = _impulse_kernels.bends(image, every)
    usual = quantile_of(bent[:, ::4], UPPER)
    if not usual:  # in few grey levels a step of one looks like it
        return np.zeros(0, np.int64)
    least, step = np.float32(HEIGHT / NORMAL_UPPER * usual), np.rint(step_px).astype(np.int64)
    found: NDArray[np.int64] = _impulse_kernels.flashes(image, last, bent, every, least, NARROW, AGAIN, step)
    return found
