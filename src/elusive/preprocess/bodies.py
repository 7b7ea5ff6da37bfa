"""The body about a point of a frame: all of one connected thing that stands out of calm surroundings.

A level set that keeps clear of its surroundings, as those of Matas et al. (2002, Proc. BMVC, 384-393) are chosen: here
the level follows from how far the surroundings vary.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from elusive.contracts import Array
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.robust import MAD

WINDOWS_PX = (48, 32, 20, 12)  # to each side of the point, in which surroundings are looked at
MOST = 0.25  # share of a window that a body fills: the median is of its surroundings
CLEAR = 3.0  # deviations of the surroundings that a body is beyond
LARGE = 0.5  # of a window's half side, from which a body is as large as suits it
SHARE = 0.25  # of the height over its surroundings that all of a body has
TOP_PX = 2  # about the point, within which a body is highest
GAP = 0.15  # of a window's half side, across which parts are joined: what is thin is lost in the surroundings
NEIGHBOURS = np.ones((3, 3), dtype=np.int64)


class Body(NamedTuple):
    """What is connected in one frame."""

    centre_px: Array  # (2,) x, y in the frame
    extent_px: float  # longer side of its box


def body_about(image: Image, point_px: Array, bright: bool) -> Body | None:
    """Return the body that a point is a part of; None where none is wholly seen in calm surroundings.

    Parameters
    ----------
    image
        ``(rows, columns)``; NaN where a pixel is masked.
    point_px
        ``(2,)`` x, y.
    bright
        Whether it is brighter than its surroundings, else darker.
    """
    x, y = (int(value) for value in np.rint(point_px))
    rows, columns = image.shape
    if not (0 <= x < columns and 0 <= y < rows):
        return None
    found = None
    for half in WINDOWS_PX:
        left, top = max(x - half, 0), max(y - half, 0)
        window = image[top : y + half + 1, left : x + half + 1]
        values = window if bright else -window
        first = max(y - top - TOP_PX, 0), max(x - left - TOP_PX, 0)
        near = values[first[0] : y - top + TOP_PX + 1, first[1] : x - left + TOP_PX + 1]
        if not np.isfinite(near).any():
            break
        level = float(np.nanmedian(values))
        # what else stands out is no part of the surroundings' own variation
        deviation = MAD * float(level - np.nanmedian(values[values <= level]))
        height = float(np.nanmax(near)) - level
        bound = max(CLEAR * deviation, SHARE * height)
        if not height > bound:
            continue
        beyond = values > level + bound
        parts, _ = ndimage.label(ndimage.maximum_filter(beyond, int(GAP * half) | 1), NEIGHBOURS)
        summit = np.unravel_index(int(np.nanargmax(near)), near.shape)
        body = beyond & (parts == parts[first[0] + summit[0], first[1] + summit[1]])
        across, down = np.flatnonzero(body.any(axis=0)), np.flatnonzero(body.any(axis=1))
        whole = across[0] > 0 and down[0] > 0 and across[-1] < body.shape[1] - 1 and down[-1] < body.shape[0] - 1
        if whole and np.count_nonzero(body) < MOST * body.size:
            row, column = np.nonzero(body)
            extent = float(max(np.ptp(across), np.ptp(down)) + 1)
            found = Body(np.array([left + column.mean(), top + row.mean()]), extent)
            if extent > LARGE * half:
                break
    return found
