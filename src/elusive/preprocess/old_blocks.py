"""Parts of a frame that are the last one's to the bit while the scene goes on, as a video coder repeats blocks.

No source; an own test. They show what was: no new peak, and nothing of what has come or gone since.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess._scale_kernels import Image, Mask

TILE = 4  # pixels of a side; coders' blocks have 4 and more
GONE_PX = 0.3  # that the scene has gone since; a peak's place is known so well
CORNERS = [(down, right) for down in (np.s_[:-1], np.s_[1:]) for right in (np.s_[:-1], np.s_[1:])]  # of a square
SIDES = np.array([(-1, 0), (1, 0), (0, -1), (0, 1)])


class OldBlocks(NamedTuple):
    """Tiles of a frame, ``(rows // 4, columns // 4)``."""

    tiles: Mask  # those that are old
    scene_px: NDArray[np.float32]  # (rows // 4, columns // 4, 2) x, y: where the scene was when each was new


def old_blocks(before: OldBlocks | None, image: Image, last: Image | None, scene_px: Array) -> OldBlocks:
    """Return which parts of a frame are old.

    Parameters
    ----------
    before
        The same of the last frame; None where that shows another scene.
    image, last
        ``(rows, columns)``, the frame, NaN where something is drawn over it, and the last one as recorded.
    scene_px
        ``(2,)`` x, y: where the scene is now.
    """
    rows, columns = (size // TILE for size in image.shape)
    here = np.broadcast_to(scene_px.astype(np.float32), (rows, columns, 2))
    if before is None or last is None:
        return OldBlocks(np.zeros((rows, columns), np.bool_), here)
    same = _same(image[: TILE * rows, : TILE * columns], last[: TILE * rows, : TILE * columns])
    if not same.any():
        return OldBlocks(same, here)
    since = np.where(same[..., None], before.scene_px, here)
    return OldBlocks(same & (np.abs(here - since).max(axis=2) > GONE_PX), since)


def _same(image: Image, last: Image) -> Mask:
    """Say which tiles are in a square of two by two that kept every value, and are not cut off at the range's ends."""
    rows, columns = (size // TILE for size in image.shape)
    # a few pixels tell of most frames that they repeat nothing
    few = [np.s_[k::TILE, k::TILE] for k in (0, TILE // 2)]
    alike = np.logical_and.reduce([image[part] == last[part] for part in few])
    if not _squares(alike).any():
        return np.zeros((rows, columns), np.bool_)
    # four flags are one number
    changed = np.not_equal(image, last, order="C").view(np.uint32).reshape(rows, TILE, columns)
    corner = image[few[0]]
    alike = (np.bitwise_or.reduce(changed, axis=1) == 0) & (corner > np.nanmin(image)) & (corner < np.nanmax(image))
    found: Mask = np.zeros_like(alike)
    squares = _squares(alike)
    for down, right in CORNERS:
        found[down, right] |= squares
    return found


def _squares(alike: Mask) -> Mask:
    """Squares of two by two that are alike, by their first tile."""
    found: Mask = np.logical_and.reduce([alike[corner] for corner in CORNERS])
    return found


def within(tiles: Mask, places_px: Array, scale_px: Array) -> Mask:
    """Say which things at places ``(n, 2)`` x, y, of a scale ``(n,)``, are in such tiles on all sides."""
    found = np.ones(len(places_px), np.bool_)
    if not tiles.any():
        return ~found
    most = np.subtract(tiles.shape[::-1], 1)
    for side in SIDES:
        at = places_px + scale_px[:, None] * side
        column, row = np.clip(at // TILE, 0, most).astype(np.int64).T
        found &= tiles[row, column]
    return found
