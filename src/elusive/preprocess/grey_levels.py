"""What a frame's grey levels are, from a sample of its pixels: their unit, their median, the step between them."""

from __future__ import annotations

import math

import numpy as np

from elusive.contracts import Array
from elusive.preprocess._scale_kernels import Image

SAMPLES = 3000  # pixels from which quantiles are taken
RANGE_BITS = 8  # of the first frame's grey levels once they are in units of the finder's own


def sample_of(image: Image) -> Image:
    """Return the values of every so many pixels."""
    sample: Image = image.ravel()[:: max(1, image.size // SAMPLES) | 1]
    return sample


def unit_of(frame: Array) -> float:
    """Return the power of two that makes a frame's values as large as a camera's grey levels; 0 where all are equal.

    Floors against rounding are then the same for counts, kelvins and watts, and what is found is, to the last bit.
    """
    sample = sample_of(frame.astype(np.float32))
    finite = sample[np.isfinite(sample)]
    extent = float(np.ptp(finite)) if len(finite) else 0.0
    return 2.0 ** (RANGE_BITS - math.frexp(extent)[1]) if extent else 0.0


def levels_of(image: Image) -> tuple[float, float]:
    """Median and step between grey levels of a frame (0 where it is not of steps)."""
    sample = np.sort(sample_of(image))
    steps = np.diff(sample)
    return float(sample[len(sample) // 2]), float(np.min(steps[steps > 0], initial=1e3))


def quantiles_of(image: Image, levels: tuple[float, ...]) -> Array:
    """Return quantiles of a frame's values."""
    sample = np.sort(sample_of(image))
    return np.interp(np.multiply(levels, len(sample) - 1), np.arange(len(sample)), sample)
