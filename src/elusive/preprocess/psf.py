"""Width of the point spread, from bright points in frames.

Least-squares fit of a circular Gaussian on a level to each point (as in Anthony and Granick, 2009); the median over
points, so that a blend or an edge among them does no harm. A Gaussian sampled, not integrated over each pixel: the
estimate holds the pixel's own width.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError

LIMITS_PX = (0.3, 4.0)  # widths between which a fit is believed


class PointSpread(NamedTuple):
    """What the points say."""

    sigma_px: float  # median of the fitted widths
    deviation_px: float  # of the widths over the points, from their median absolute deviation
    points: int  # how many were fitted


def estimate_psf(frames: Iterable[Array], threshold: float = 10.0, half_px: int = 5) -> PointSpread:
    """Fit every bright, isolated point and return the median width.

    Parameters
    ----------
    frames
        Frames less their background (a whitener's ``residual``), ``(rows, columns)`` each.
    threshold
        Height from which a peak counts [noise deviations of its frame].
    half_px
        Half-width of the patch fitted, and the distance within which no higher peak may lie [px].

    Raises
    ------
    DataError
        If no point can be fitted.
    ParameterError
        If the threshold or the half-width is not above zero.
    """
    if not (threshold > 0 and half_px > 0):
        raise ParameterError("threshold and half_px: must be above zero.")
    widths = [
        width for frame in frames for width in map(_fit, _patches(np.nan_to_num(frame), threshold, half_px)) if width
    ]
    if not widths:
        raise DataError(f"frames: no point {threshold} deviations above the noise was fitted; lower the threshold.")
    middle = float(np.median(widths))
    return PointSpread(middle, float(1.4826 * np.median(np.abs(np.array(widths) - middle))), len(widths))


def _patches(frame: Array, threshold: float, half: int) -> list[Array]:
    """Cut out a patch round each isolated peak that lies whole within the frame."""
    deviation = 1.4826 * float(np.median(np.abs(frame - np.median(frame))))
    smooth = ndimage.gaussian_filter(frame, 0.5)
    highest = smooth == ndimage.maximum_filter(smooth, 2 * half + 1)
    peaks = np.argwhere(highest & (frame > threshold * max(deviation, 1e-12)))
    return [
        frame[row - half : row + half + 1, column - half : column + half + 1]
        for row, column in peaks
        if half <= row < frame.shape[0] - half and half <= column < frame.shape[1] - half
    ]


def _fit(patch: Array) -> float | None:
    """Width of the patch's point, None where the fit fails or leaves its limits."""
    from scipy import optimize  # a fifth of a second, which only a fit needs

    half = patch.shape[0] // 2
    y, x = np.mgrid[-half : half + 1, -half : half + 1].astype(float)
    height = float(patch[half, half])

    def error(p: Array) -> Array:
        bell = p[0] * np.exp(-0.5 * ((x - p[1]) ** 2 + (y - p[2]) ** 2) * np.exp(-2 * p[3]))
        misfit: Array = (bell + p[4] - patch / height).ravel()
        return misfit

    start = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    found = optimize.least_squares(error, start, loss="soft_l1", f_scale=0.2, max_nfev=100)
    width = float(np.exp(found.x[3]))
    centred = float(np.abs(found.x[1:3]).max()) <= 1.5
    return width if found.success and centred and LIMITS_PX[0] < width < LIMITS_PX[1] else None
