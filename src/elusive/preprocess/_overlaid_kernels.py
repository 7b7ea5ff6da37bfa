"""Compiled kernel of what stays on the sensor while the scene goes by."""

from __future__ import annotations

import numpy as np

from elusive._njit import njit
from elusive.preprocess._scale_kernels import Image


@njit(cache=True, nogil=True)
def vote(
    image: Image,
    before: Image,
    down: int,
    right: int,
    level: np.float32,
    votes: Image,
    bound: np.float32,
    steady: np.float32,
    fades: np.float32,
    most: np.float32,
) -> Image:
    """Go on with votes for each pixel to be drawn over the scene, up to ``most``, by a frame and an earlier one.

    The scene has moved by ``down, right`` between them, and all grey levels by ``level``. A pixel is drawn that differs
    by more than ``bound`` from the scene as it has gone, and by no more than a share ``steady`` of that from what was
    in its place; the other way round it is of the scene, which counts against; else its votes fade. What only lies
    beside a stroke differs from the scene on one side alone, and what is beyond the frame on either tells nothing.
    """
    rows, columns = image.shape
    after = votes.copy()
    for row in range(abs(down), rows - abs(down)):
        for i in range(abs(right), columns - abs(right)):
            value = image[row, i] - level
            here = abs(value - before[row, i])
            one, other = abs(value - before[row - down, i - right]), abs(value - before[row + down, i + right])
            if one > bound and other > bound and here < steady * one and here < steady * other:
                after[row, i] = min(votes[row, i] + np.float32(1.0), most)
            elif here > bound and one < steady * here:
                after[row, i] = max(votes[row, i] - np.float32(1.0), np.float32(0.0))
            else:
                after[row, i] = fades * votes[row, i]
    return after
