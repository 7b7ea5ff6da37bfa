"""What is drawn over frames with soft edges or half transparently: it stays on the sensor while the scene goes by.

No source; an own test. Antialiased, scaled or compressed, what is written has no one value and no sharp outline. So it
is known by where it is: again and again a pixel is as it was in its place, and far from what the scene brings there,
whichever way that goes. A target that the camera follows stays, too: it is one thing, and text is many strokes; and in
the middle of the frame, where a camera keeps its target, nothing is taken for drawn.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from elusive.contracts import Array
from elusive.preprocess import _overlaid_kernels, scales
from elusive.preprocess._scale_kernels import Image, Mask

PATH_PX = 1.5  # of the scene, from one look to the next
STEP, STEADY = 4.0, 0.25  # times the usual change that a stroke differs from the scene by; share of that it changes by
VOTES, FADES, MOST_VOTES = 4.5, 0.95, 16.0  # that tell a stroke; left of them after a look that tells nothing; at most
CELL_PX, NEAR_PX = 4, 1  # sides of cells that join, if they touch; about strokes
LONG_PX, THIN = 8, 3  # extent of what is drawn; and times the side of a square in it
MIDDLE = 0.125  # share of the sides from the centre of the frame, where a camera keeps what it follows
SEVERAL, LEAST_PX = 6, 3  # strokes, that no target has; pixels of one
MOST = 0.15  # share of the frame above which it is a part of the scene that goes otherwise
BESIDE, INK = 1.5, 0.4  # heights beside what is drawn, within which what has so much of its contrast is drawn, too
NEIGHBOURS = np.ones((3, 3), dtype=np.int64)


class Part(NamedTuple):
    """Strokes that are close together."""

    box: tuple[slice, ...]  # of the frame
    ink: Mask  # (rows, columns) of the box


class Overlaid(NamedTuple):
    """What is drawn so far."""

    looked: Image  # the frame of the last look
    scene_px: Array  # (2,) x, y: where the scene was then
    votes: Image  # (rows, columns) for each pixel to be drawn
    parts: tuple[Part, ...] = ()
    mask: Mask | None = None  # (rows, columns) true where something is drawn; None where nothing is


def overlaid(state: Overlaid | None, image: Image, scene_px: Array) -> Overlaid:
    """Return what is drawn over the frames up to a new one, as recorded, and its scene's offset ``(2,)`` x, y."""
    if state is None:
        return Overlaid(image, scene_px, np.zeros_like(image))
    way = scene_px - state.scene_px
    if np.abs(way).max() < PATH_PX:
        return state
    right, down = np.rint(way).astype(np.int64).tolist()
    change = image[::4, ::4] - state.looked[::4, ::4]
    change = change[np.isfinite(change)]
    level = np.float32(np.median(change)) if len(change) else np.float32(0)
    usual = scales.median_of(np.abs(change - level)) if len(change) else 0.0
    if not usual > 0 or 2 * abs(right) >= image.shape[1] or 2 * abs(down) >= image.shape[0]:
        return state._replace(looked=image, scene_px=scene_px)
    votes = _overlaid_kernels.vote(
        image, state.looked, down, right, level, state.votes, np.float32(STEP * usual), np.float32(STEADY),
        np.float32(FADES), np.float32(MOST_VOTES),
    )  # fmt: skip
    parts, mask = _drawn(votes > VOTES)
    return Overlaid(image, scene_px, votes, parts, mask)


def without_overlaid(image: Image, state: Overlaid | None) -> Image:
    """Return a frame with NaN where something is drawn, and where digits have changed beside that."""
    if state is None or state.mask is None:
        return image
    whole = image.copy()
    whole[state.mask] = np.nan
    for (rows, columns), ink in state.parts:
        high = rows.stop - rows.start
        reach = int(BESIDE * high) if 2 * ink.shape[1] > high else NEAR_PX  # not of an upright line
        zone = tuple(
            slice(max(side.start - more, 0), side.stop + more)
            for side, more in ((rows, NEAR_PX), (columns, NEAR_PX + reach))
        )
        seen, known, strokes = image[zone], whole[zone], image[rows, columns][ink]
        if not np.isfinite(known).any() or not np.isfinite(strokes).any():
            continue
        level = np.nanmedian(known)
        step = np.nanmedian(strokes) - level
        inked = (seen - level) * np.sign(step) > INK * np.abs(step)
        known[ndimage.maximum_filter(inked, 2 * NEAR_PX + 1)] = np.nan
    return whole


def _drawn(found: Mask) -> tuple[tuple[Part, ...], Mask | None]:
    """Of pixels that stay, those of strokes, part by part; and all that they hide."""
    pixels = np.flatnonzero(found)
    if len(pixels) < SEVERAL * LEAST_PX:
        return (), None
    # in cells: a frame is large, and little is drawn in it
    row, column = np.divmod(pixels, found.shape[1])
    cells = np.zeros([size // CELL_PX + 1 for size in found.shape], np.bool_)
    cells[row // CELL_PX, column // CELL_PX] = True
    names, _ = ndimage.label(cells, NEIGHBOURS)
    parts, apart, along = list[Part](), 0, 0
    for k, coarse in enumerate(ndimage.find_objects(names), 1):
        here = np.kron(names[coarse] == k, np.ones((CELL_PX, CELL_PX), np.bool_))
        top, left = (CELL_PX * side.start for side in coarse)
        seen = found[top : top + here.shape[0], left : left + here.shape[1]]
        ink = seen & here[: seen.shape[0], : seen.shape[1]]
        lines = [np.flatnonzero(ink.any(axis=axis)) for axis in (1, 0)]
        inner = tuple(slice(int(line[0]), int(line[-1]) + 1) for line in lines)
        part = Part(
            tuple(slice(a + side.start, a + side.stop) for a, side in zip((top, left), inner, strict=True)), ink[inner]
        )
        if _is_of_strokes(part, found.shape):
            parts.append(part)
            apart, along = apart + _apart(part.ink), max(along, _along(part.ink))
    if max(apart, along) < SEVERAL:
        return (), None
    mask = np.zeros(found.shape, np.bool_)
    for (rows, columns), ink in parts:
        mask[rows, columns] |= ink
        about = tuple(slice(max(side.start - NEAR_PX, 0), side.stop + NEAR_PX) for side in (rows, columns))
        mask[about] = ndimage.maximum_filter(mask[about], 2 * NEAR_PX + 1)
    return (tuple(parts), mask) if np.count_nonzero(mask) < MOST * mask.size else ((), None)


def _is_of_strokes(part: Part, shape: tuple[int, ...]) -> bool:
    """Say if a part is long for its width, and not in the middle of a frame of this shape."""
    square = 2 * int(ndimage.distance_transform_cdt(np.pad(part.ink, 1)).max()) - 1
    centre = ((side.start + side.stop - 1) / 2 / (size - 1) for side, size in zip(part.box, shape, strict=True))
    off = max(abs(share - 0.5) for share in centre)
    return bool(max(part.ink.shape) >= max(LONG_PX, THIN * square) and off > MIDDLE)


def _apart(ink: Mask) -> int:
    """How many strokes lie apart from each other."""
    names, _ = ndimage.label(ink, NEIGHBOURS)
    return int(np.count_nonzero(np.bincount(names[ink]) >= LEAST_PX))


def _along(ink: Mask) -> int:
    """How many there are, at most, one after the other along a row or a column."""
    begins = (np.diff(ink.astype(np.int8), axis=axis, prepend=0) > 0 for axis in (0, 1))
    return max(int(begin.sum(axis=axis).max()) for axis, begin in enumerate(begins))
