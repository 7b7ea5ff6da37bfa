"""Rims of what is saturated: where a frame is cut off at an end of the camera's range over more than a point.

No source; an own test. What a camera cuts off is flat, and its rim is a step that no band-limited scene has: read
between its pixels it differs from frame to frame, and against its surroundings it is a ring of points. So at each
scale no peak is taken from where a plateau wider than that scale's points meets surroundings that are as wide. A target
that is itself saturated is narrower than that at its own scale; one that is seen before the plateau is a hole in it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from elusive.preprocess._scale_kernels import Image, Mask

WIDE = 5  # pixels of a scale's map along the side of a square that no point of that scale fills
REACH = 3  # pixels of a scale's map that a step reaches
_BESIDE = WIDE // 2 + WIDE // 2 + REACH  # pixels about one that tell whether it is in reach of a square
PILED = 2  # grey levels next to the last one that hold fewer pixels, together, than it does: else nothing is cut off
STEP = 8  # grey levels from the last one beyond which is beside it: the brightest of few levels ends in its next ones


def rims_of(image: Image, quantum: float, count: int) -> list[Mask] | None:
    """Return at each of ``count`` scales where a plateau's rim is, pixels of that scale's map; None where none is.

    Parameters
    ----------
    image
        ``(rows, columns)``, as recorded; NaN where a pixel is masked.
    quantum
        Step between grey levels; 0 where there are none.
    """
    flat = [parts for parts in (_parts(image, side, quantum) for side in (1.0, -1.0)) if parts is not None]
    if not flat:
        return None
    rims = []
    for k in range(count):
        rim = np.zeros(image[:: 2**k, :: 2**k].shape, bool)
        for plateau, beside in flat:
            _add_rim(rim, plateau[:: 2**k, :: 2**k], beside[:: 2**k, :: 2**k])
        rims.append(rim)
    return rims


def _parts(image: Image, sign: float, quantum: float) -> tuple[Mask, Mask] | None:
    """Return where the frame is at an end of its range, and where far from it; None where it is nowhere cut off."""
    end = np.fmax.reduce(image, axis=None) if sign > 0 else np.fmin.reduce(image, axis=None)
    coarse = image[::2, ::2]
    # a sample of every wide plateau
    some = np.count_nonzero(coarse == end)
    if some < (WIDE // 2) ** 2:
        return None
    beside = np.count_nonzero(sign * (end - coarse) < (PILED + 0.5) * quantum) - some
    return (image == end, sign * (end - image) > STEP * quantum) if some > beside else None


def _add_rim(rim: Mask, plateau: Mask, beside: Mask) -> None:
    """Add where the wide parts of a plateau and of its surroundings are both within reach."""
    margin = REACH + _BESIDE
    lines = [np.flatnonzero(plateau.any(axis=axis)) for axis in (1, 0)]
    if not len(lines[0]):
        return
    about = tuple(slice(max(line[0] - margin, 0), line[-1] + margin + 1) for line in lines)
    within, without = (
        _slid(_slid(np.pad(side[about], _BESIDE, mode="edge"), WIDE, np.logical_and), WIDE + 2 * REACH, np.logical_or)
        for side in (plateau, beside)
    )
    rim[about] |= within & without


def _slid(mask: Mask, size: int, join: Callable[[Mask, Mask], Mask]) -> Mask:
    """Join the pixels of each square within a mask, by squares twice as large as the ones before."""
    for axis in (0, 1):
        lines, width = np.moveaxis(mask, axis, 0), 1
        while width < size:
            step = min(width, size - width)
            lines, width = join(lines[:-step], lines[step:]), width + step
        mask = np.moveaxis(lines, 0, axis)
    return mask
