"""Compiled kernels of what a camera draws over its scene: pixels that keep their value, and long lines of them."""

from __future__ import annotations

import numpy as np
from numba import njit

from elusive.preprocess._scale_kernels import Counts, Image, Mask


@njit(cache=True, nogil=True)
def keep(
    image: Image, last: Image, kept: Counts, blank: Mask, bound: np.float32, counts: bool, most: int
) -> tuple[Counts, int]:
    """Count on in which frames a pixel kept its value within a bound, up to ``most``; and how many pixels reach that.

    Where not ``counts``, only ``blank`` pixels count on. What is not finite begins anew.
    """
    rows, columns = image.shape
    after = np.empty((rows, columns), dtype=np.uint8)
    full = 0
    for row in range(rows):
        now, before, so_far, empty, out = image[row], last[row], kept[row], blank[row], after[row]
        for i in range(columns):
            more = min(so_far[i] + (counts or empty[i]), most)
            value = more if abs(now[i] - before[i]) <= bound else 0
            out[i] = value
            full += value == most
    return after, full


@njit(cache=True, nogil=True)
def _any(row: Counts, value: np.uint8) -> bool:
    found = np.uint8(0)
    for i in range(len(row)):
        found |= row[i] == value
    return bool(found)


@njit(cache=True, nogil=True)
def long_lines(kept: Counts, value: int, length: int) -> tuple[Mask, bool]:
    """Mark pixels of a value in rows and columns of at least ``length`` such; say if there are any."""
    rows, columns = kept.shape
    mask, found = np.zeros((rows, columns), dtype=np.bool_), False
    below = np.zeros(columns, dtype=np.int64)  # such pixels in each column up to this row
    before = False
    for row in range(rows + 1):
        # most rows have none, and end none
        now = row < rows and _any(kept[row], np.uint8(value))
        if not now and not before:
            continue
        before = now
        beside = 0
        for i in range(columns):
            here = row < rows and kept[row, i] == value
            if here:
                below[i] += 1
                beside += 1
            if below[i] and not here:
                if below[i] >= length:
                    found = True
                    mask[row - below[i] : row, i] = True
                below[i] = 0
            if beside and (not here or i == columns - 1):
                end = i + here
                if beside >= length:
                    found = True
                    mask[row, end - beside : end] = True
                beside = 0
    return mask, found
