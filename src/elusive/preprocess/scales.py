"""Scales of a frame: differences of Gaussians on a pyramid, and their local noise.

Burt and Adelson (1983); the scale of the noise from the mean root of magnitudes, in which a target counts little.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from elusive.contracts import Array
from elusive.preprocess import _scale_kernels
from elusive.preprocess._scale_kernels import Image

FINEST = np.array([1 / 32, 1 / 4, 7 / 16], dtype=np.float32)  # outer half of five taps, variance 3/4 px^2
COARSER = np.array([0.0, 1 / 4, 1 / 2], dtype=np.float32)  # variance 1/2
MEAN_ROOT = 0.8222  # mean root of the magnitude of a standard normal
LEAST_SHARE = 0.05  # of a map's mean variance that the local one is held above
SAMPLES = 3000  # pixels that tell a map's deviation
CLIP = 2.5  # deviations that a pixel counts for at most in its row and column
ALIKE = 3.0  # neighbours along a row that speak as one
PLAIN = 3.0  # times what chance gives, from which rows and columns have offsets of their own
LINED = 2  # finest scales from which they are taken away
LEAST_SIDE = 16  # of the coarsest map


def count_of(shape: tuple[int, int]) -> int:
    """How many scales a frame has."""
    return int(np.clip(np.floor(np.log2(min(shape) / LEAST_SIDE)) + 1, 1, 4))


def moments_of(level: int) -> tuple[float, float]:
    """Variances of a scale's centre and of its surround, which is the next scale's centre [px^2 of the frame]."""
    gathered = (4.0**level - 1) / 3  # of the pyramid
    unit = 4.0**level
    return gathered + (
        0.75 if level == 0 else 0.5
    ) * unit, gathered + 3.5 * unit  # reading between pixels adds half a unit


def noise_gain(level: int) -> float:
    """Deviation of the response to white noise of deviation one."""
    a, b = moments_of(level)
    return float(np.sqrt((1 / a + 1 / b - 4 / (a + b)) / (4 * np.pi)))


def log_rate(level: int) -> float:
    """Log of Lambda, the density of maxima of the response to white noise [1 / px^2], less that of their height."""
    a, b = moments_of(level)
    slope = (1 / a**2 + 1 / b**2 - 8 / (a + b) ** 2) / (8 * np.pi)
    return float(np.log(slope / noise_gain(level) ** 2 / (2 * np.pi) ** 1.5))


def responses(frame: Image, count: int) -> list[Image]:
    """Response of each scale, each half as large as the one before."""
    smoothed, level = [], frame
    for k in range(count + 1):
        level = _scale_kernels.halve(level) if k else level
        smoothed.append(_scale_kernels.smooth(level, COARSER if k else FINEST))
    maps = [_scale_kernels.subtract(fine, coarse) for fine, coarse in pairwise(smoothed)]
    return [level_lines(response) if k < LINED else response for k, response in enumerate(maps)]


def level_lines(response: Image) -> Image:
    """Take away what whole rows and columns of the sensor add, where that is plain.

    A row's mean of clipped values varies by chance as that of so many pixels, a few of which speak as one; what it
    varies beyond, by the median over the rows so that an edge along some does not count, is the sensor's. What of it
    is noise stays (Wiener).
    """
    levelled: Image = _scale_kernels.level_lines(response, SAMPLES, MEAN_ROOT, CLIP, ALIKE, PLAIN)
    return levelled


def local_variance(image: Image, least: float) -> Image:
    """Variance of a map's noise about each of its blocks, ``least`` or more.

    The median of the blocks round each: where two textures meet, each side has its own.
    """
    variance: Image = _scale_kernels.local_variance(image, MEAN_ROOT, LEAST_SHARE, least)
    return variance


def median_of(values: Array | Image) -> float:
    """Return the median of what is finite, 0 where nothing is."""
    return quantile_of(values, 0.5)


def quantile_of(values: Array | Image, share: float) -> float:
    """Return a quantile of what is finite, 0 where nothing is: one partition.

    About two ranks, even where one is enough: NumPy parts about one alone two to three times slower.
    """
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0
    part, rank = math.modf(share * (len(known) - 1))
    ranks = int(rank), min(int(rank) + 1, len(known) - 1)
    low, high = np.partition(known, ranks)[list(ranks)].tolist()
    return float(low + part * (high - low))
