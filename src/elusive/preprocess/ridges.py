"""How much of an edge or a ridge there is in a point of a frame: it goes on as strong to both sides.

An edge bends in one direction only, as Harris and Stephens (1988, Proc. Alvey Vision Conf., 147-151) and Lowe (2004,
Int. J. Comput. Vis. 60, 91-110, sec. 4.1) leave it out; but so does what is long for its width, which ends.
"""

from __future__ import annotations

import math

import numpy as np

from elusive.contracts import Array
from elusive.preprocess._scale_kernels import Image

FINEST_PX = 0.8  # deviation of the narrowest Gaussian that pixels sample
BESIDE = 3.0, 1.5  # scales and pixels along the edge at which a point is over
REACH = 4.0  # scales to which a Gaussian reaches


def ridge_about(image: Image, point_px: Array, scale_px: float, bright: bool) -> float:
    """Share of a point's curvature that it has on both sides along the direction in which it bends least.

    In [-1, 1]: 1 on an even edge, about 0 at a point; NaN where it does not stand out. Near the border one side counts.

    Parameters
    ----------
    image
        ``(rows, columns)``; NaN where a pixel is masked.
    point_px
        ``(2,)`` x, y.
    scale_px
        Deviation of the Gaussian that is like the point.
    bright
        Whether it is brighter than its surroundings, else darker.
    """
    scale = max(scale_px, FINEST_PX)
    away = BESIDE[0] * scale + BESIDE[1]
    reach = math.ceil(away + REACH * scale)
    first = np.rint(point_px).astype(np.int64) - reach
    # beyond its border a frame is as at it
    columns, rows = (
        np.minimum(np.maximum(np.arange(begin, begin + 2 * reach + 1), 0), size - 1)
        for begin, size in zip(first.tolist(), image.shape[::-1], strict=True)
    )
    values = image[rows[:, None], columns] * (-1.0 if bright else 1.0)
    gaps = ~np.isfinite(values)
    if gaps.all():
        return math.nan
    values = np.where(gaps, 0.0, values - values[~gaps].mean())
    xx, xy, yy = _curvature(values, point_px - first, scale)
    angle = 0.5 * math.atan2(2 * xy, xx - yy) + 0.5 * math.pi  # of the weaker bend
    along = away * np.array([math.cos(angle), math.sin(angle)])
    ends = [end for end in (point_px + along, point_px - along) if ((end >= 0) & (end < image.shape[::-1])).all()]
    if not (xx + yy > 0 and ends):
        return math.nan
    beside = min(sum(_curvature(values, end - first, scale)[::2]) for end in ends)
    return min(max(beside / (xx + yy), -1.0), 1.0)


def _curvature(values: Array, at: Array, scale: float) -> tuple[float, float, float]:
    """Second derivatives xx, xy, yy of values smoothed by a Gaussian, at x, y."""
    orders = []
    for size, place in zip(values.shape[::-1], at.tolist(), strict=True):
        off = (np.arange(size) - place) / scale
        smooth = np.exp(-0.5 * off**2)
        orders.append((smooth, off * smooth, (off**2 - 1) * smooth))
    (zero_x, one_x, two_x), (zero_y, one_y, two_y) = orders
    return float(zero_y @ values @ two_x), float(one_y @ values @ one_x), float(two_y @ values @ zero_x)
