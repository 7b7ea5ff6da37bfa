"""What a camera draws over its scene, bars and a reticle: pixels that keep their value while the others change.

Margins without a picture, rows and columns at the edge that are of one value throughout, are known from a single frame.

No source; an own test. Nothing passes before what is drawn: where something does, a flat part of the scene lies, which
is seen. What is drawn keeps its place on the sensor, and would hold a registration there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.preprocess._scale_kernels import Image

FRAMES, FIRST = 8, 4  # in which a pixel kept its value; from a recording's begin on
TOLERANCE = 0.25  # of the frame's median change, by which a value may have changed
LONG_PX = 10  # along a row or a column; what is shorter may be a saturated target that the camera follows
INNER_PX = 7  # side of a square that keeps its value: a change in it is something that passes
MOSTLY = 0.5  # of the line beside a margin, that is of another value
PASSED_PX = 33  # side of the square about such a change that is seen again

Mask = NDArray[np.bool_]


class Drawn(NamedTuple):
    """What is drawn over the frames so far."""

    last: Image  # the last frame
    kept: NDArray[np.uint8]  # (rows, columns) frames since the pixel changed, at most FRAMES
    mask: Mask | None  # true where something is drawn; None where nothing is


def without_drawn(image: Image, mask: Mask | None) -> Image:
    """Return the frame with NaN where something is drawn."""
    return image if mask is None else np.where(mask, np.float32(np.nan), image)


def drawn(state: Drawn | None, image: Image) -> Drawn:
    """Return what is drawn over the frames up to a new one, as recorded."""
    blank = margins(image)
    if state is None:
        kept = np.where(blank, FRAMES, FRAMES - FIRST).astype(np.uint8)
        return Drawn(image, kept, _drawn(kept == FRAMES))
    change = np.abs(image - state.last)
    usual = np.float32(np.nanmedian(change[::4, ::4]))
    same = change <= TOLERANCE * usual  # no where it is not finite
    # where most keep their value, that of one says nothing
    kept = np.minimum(state.kept + (blank | (usual > 0)), FRAMES) * same
    if state.mask is not None:
        passes = ~same & ndimage.minimum_filter(state.kept == FRAMES, INNER_PX)
        if passes.any():
            kept[ndimage.maximum_filter(passes, PASSED_PX)] = 0
    return Drawn(image, kept, _drawn(kept == FRAMES))


def margins(image: Image) -> Mask:
    """Rows and columns from the edges inward that have a corner's value throughout.

    A picture begins beside them along the whole line. Where only a part of that is of another value, it is a flat part
    of the scene in which something lies.
    """
    blank = np.zeros(image.shape, bool)
    for corner in (image[0, 0], image[-1, -1]):
        picture = image != corner
        for lines, over in ((picture, blank), (picture.T, blank.T)):
            filled = np.flatnonzero(lines.any(axis=1))
            if not len(filled):
                return np.zeros(image.shape, bool)
            first, last = filled[[0, -1]]
            over[:first] |= lines[first].mean() > MOSTLY
            over[last + 1 :] |= lines[last].mean() > MOSTLY
    return blank


def _drawn(still: Mask) -> Mask | None:
    """Of the pixels that keep their value, those in straight lines that are long enough."""
    if not still.any():
        return None
    lines = [ndimage.binary_opening(still, np.ones(side, bool)) for side in ((1, LONG_PX), (LONG_PX, 1))]
    mask: Mask = lines[0] | lines[1]
    return mask if mask.any() else None
