"""What a camera draws over its scene, bars and a reticle: pixels that keep their value while the others change.

Margins without a picture, rows and columns at the edge that are of one value throughout, are known from a single frame.

No source; an own test. Nothing passes before what is drawn: where something does, a flat part of the scene lies, which
is seen. What is drawn keeps its place on the sensor, and would hold a registration there. What is cut off at an end of
the camera's range keeps its value, too, a sun or a target that the camera follows: optics give that flanks, and nothing
straight; what is drawn is sharp, or straight where a recorder has scaled it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.preprocess import _drawn_kernels, scales
from elusive.preprocess._scale_kernels import Image, Mask

FRAMES, FIRST = 8, 4  # in which a pixel kept its value; from a recording's begin on
TOLERANCE = 0.25  # of the frame's median change, by which a value may have changed
LONG_PX = 10  # along a row or a column; what is shorter may be a saturated target that the camera follows
WIDE_PX = 5  # side of a square that has no place in a line, but in something that is cut off
STRAIGHT = 0.5  # of the outline of what is so wide, in pieces that are so long: else it may be of the scene
SHARP = 0.1  # of its step to the second pixel beside, beyond the first: more makes it one
INNER_PX = 7  # side of a square that keeps its value: a change in it is something that passes
MOSTLY = 0.5  # of the line beside a margin, that is of another value
PASSED_PX = 33  # side of the square about such a change that is seen again


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
        return Drawn(image, kept, _drawn(kept, int(np.count_nonzero(blank)), image, blank, np.float32(0.0)))
    usual = np.float32(scales.median_of(np.abs(image[::4, ::4] - state.last[::4, ::4])))
    bound = np.float32(TOLERANCE) * usual
    # where most keep their value, that of one says nothing
    kept, full = _drawn_kernels.keep(image, state.last, state.kept, blank, bound, bool(usual > 0), FRAMES)
    if state.mask is not None:
        passes = (kept == 0) & ndimage.minimum_filter(state.kept == FRAMES, INNER_PX)
        if passes.any():
            kept[ndimage.maximum_filter(passes, PASSED_PX)] = 0
    return Drawn(image, kept, _drawn(kept, full, image, blank, bound))


def margins(image: Image) -> Mask:
    """Rows and columns from the edges inward that have a corner's value throughout.

    A picture begins beside them along the whole line. Where only a part of that is of another value, it is a flat part
    of the scene in which something lies.
    """
    blank = np.zeros(image.shape, bool)
    edges = image[0], image[-1], image[:, 0], image[:, -1]
    for corner in (image[0, 0], image[-1, -1]):
        if not any((edge == corner).all() for edge in edges):
            continue
        picture = image != corner
        for lines, over in ((picture, blank), (picture.T, blank.T)):
            filled = np.flatnonzero(lines.any(axis=1))
            if not len(filled):
                return np.zeros(image.shape, bool)
            first, last = filled[[0, -1]]
            over[:first] |= lines[first].mean() > MOSTLY
            over[last + 1 :] |= lines[last].mean() > MOSTLY
    return blank


def _drawn(kept: NDArray[np.uint8], full: int, image: Image, blank: Mask, bound: np.float32) -> Mask | None:
    """Of the pixels, at most so many, that keep their value, those in straight lines that are long enough."""
    if full < LONG_PX:
        return None
    mask, found = _drawn_kernels.long_lines(kept, FRAMES, LONG_PX)
    if found:
        found = _drawn_kernels.leave_round(mask, kept, image, blank, FRAMES, bound, LONG_PX, WIDE_PX, STRAIGHT, SHARP)
    return mask if found else None
