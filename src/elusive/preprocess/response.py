"""Matched filter of a frame's residual at several widths, in units of its local noise.

Turin (1960) for noise that is white but of uneven strength: the correlation is weighted by the inverse variance, and
masked pixels have weight zero. What the noise map leaves over is divided out by a local root mean square of the
clipped response, so that the response's deviation is one everywhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.contracts import Array

CLIP = 4.5  # a target's response counts at most this much towards the local noise
LEAST_SHARE = 0.25  # of the frame's mean square that the local one is held above


def matched_response(
    residual: Array, variance: Array, seen: NDArray[np.bool_], sigmas_px: tuple[float, ...], window_px: int
) -> Array:
    """Return the largest response over the widths, NaN where too little of the template is seen.

    Parameters
    ----------
    residual
        ``(rows, columns)`` frame less background, of zero mean.
    variance
        Noise variance of each pixel.
    seen
        False on masked pixels.
    sigmas_px
        Deviations of the Gaussian point spreads [px].
    window_px
        Width of the window of the local root mean square [px].
    """
    weight = np.where(seen, 1.0 / variance, 0.0)
    best = np.full(residual.shape, -np.inf)
    covered = np.ones(residual.shape, dtype=bool)
    for sigma in sigmas_px:
        taps = point_spread(sigma)
        along = _separable(np.where(seen, residual, 0.0) * weight, taps)
        power = np.maximum(_separable(weight, taps**2), 0.0)
        visible = _separable(seen.astype(float), taps / taps.sum()) > 0.6
        response = np.where(visible, along / np.sqrt(np.maximum(power, 1e-300)), 0.0)
        best = np.maximum(best, response / local_deviation(response, visible, window_px))
        covered &= visible
    return np.where(covered, best, np.nan)


def point_spread(sigma_px: float) -> Array:
    """One axis of a Gaussian template out to three deviations; the template is its outer product with itself."""
    reach = int(np.ceil(3 * sigma_px))
    taps: Array = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma_px) ** 2)
    return taps


def local_mean(image: Array, seen: Array, window_px: int) -> Array:
    """Mean over the seen pixels of a square window; 0 where none is seen."""
    share = ndimage.uniform_filter(seen, window_px)
    mean: Array = ndimage.uniform_filter(image * seen, window_px) / np.maximum(share, 1e-6)
    return mean


def local_deviation(response: Array, visible: NDArray[np.bool_], window_px: int) -> Array:
    """Root mean square of the seen values about each pixel, outliers clipped, held above a share of the frame's."""
    square = np.clip(response, -CLIP, CLIP) ** 2
    overall = float(square[visible].mean()) if visible.any() else 1.0
    local = local_mean(square, visible.astype(float), window_px)
    deviation: Array = np.sqrt(np.maximum(np.maximum(local, LEAST_SHARE * overall), 1e-12))
    return deviation


def _separable(image: Array, taps: Array) -> Array:
    once = ndimage.correlate1d(image, taps, axis=0, mode="constant")
    found: Array = ndimage.correlate1d(once, taps, axis=1, mode="constant")
    return found
