"""Compiled kernels of what a camera draws over its scene: pixels that keep their value, and long lines of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
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


@njit(cache=True, nogil=True)
def _sides(
    parts: NDArray[np.int32], image: Image, number: int, box: tuple[int, int, int, int], length: int
) -> tuple[int, int, float, float]:
    """Say of the sides between two rows that a part's outline has how many there are, and in straight pieces so long.

    And the sums of the steps from inside to two pixels outside of it, and of their parts beyond the first pixel.
    """
    top, bottom, left, right = box
    every = straight = 0
    whole = beyond = 0.0
    for row in range(max(top, 1), min(bottom + 1, len(parts))):
        piece, before = 0, 0
        for i in range(left, right + 1):
            side = 0
            if i < right:
                side = int(parts[row, i] == number) - int(parts[row - 1, i] == number)
            if side != before or not side:
                straight += piece if piece >= length else 0
                piece = 0
            piece += side != 0
            every += side != 0
            before = side
            second = row - 2 if side > 0 else row + 1
            if side and 0 <= second < len(parts) and parts[second, i] != number:
                inside, first = (row, row - 1) if side > 0 else (row - 1, row)
                step = image[inside, i] - image[second, i]
                rest = image[first, i] - image[second, i]
                if np.isfinite(step) and np.isfinite(rest):
                    whole += abs(step)
                    beyond += rest * np.sign(step)
    return every, straight, whole, beyond


@njit(cache=True, nogil=True)
def _fills(parts: NDArray[np.int32], number: int, box: tuple[int, int, int, int], wide: int) -> bool:
    """Whether a square so wide has place in a part."""
    top, bottom, left, right = box
    largest = np.zeros(right - left + 1, dtype=np.int64)  # squares that end at each pixel, from the second on
    for row in range(top, bottom):
        corner = 0
        for i in range(left, right):
            above = largest[i - left + 1]
            here = min(corner, above, largest[i - left]) + 1 if parts[row, i] == number else 0
            largest[i - left + 1] = here
            if here >= wide:
                return True
            corner = above
    return False


@njit(cache=True, nogil=True)
def leave_round(
    mask: Mask,
    kept: Counts,
    image: Image,
    blank: Mask,
    value: int,
    bound: np.float32,
    length: int,
    wide: int,
    straight: float,
    sharp: float,
) -> bool:
    """Take lines out of a mask, in place, that are of a wide part, bent and with flanks; say if there are any left.

    A part is what is connected with a line, keeps its value, and has the line's within a bound. It is wide if a square
    of ``wide`` pixels has place in it, and bent if less than a share ``straight`` of its outline is in straight pieces
    of ``length``; what lies at the frame's edge is no outline. It has flanks if more than a share ``sharp`` of the step
    from it to the second pixel beside is made beyond the first. Margins, ``blank``, are no part of any.
    """
    rows, columns = mask.shape
    parts = np.zeros((rows, columns), dtype=np.int32)
    waiting = np.empty(mask.size, dtype=np.int32)
    number, any_left = 0, False
    for first in range(mask.size):
        row, i = first // columns, first % columns
        if not mask[row, i] or parts[row, i]:
            continue
        if blank[row, i]:
            any_left = True
            continue
        number += 1
        level = image[row, i]
        parts[row, i] = number
        waiting[0], count = first, 1
        top, bottom, left, right = rows, 0, columns, 0
        while count:
            count -= 1
            row, i = waiting[count] // columns, waiting[count] % columns
            top, bottom, left, right = min(top, row), max(bottom, row + 1), min(left, i), max(right, i + 1)
            for j, k in ((row - 1, i), (row + 1, i), (row, i - 1), (row, i + 1)):
                if not (0 <= j < rows and 0 <= k < columns) or parts[j, k] or blank[j, k]:
                    continue
                if kept[j, k] == value and abs(image[j, k] - level) <= bound:
                    parts[j, k] = number
                    waiting[count] = j * columns + k
                    count += 1
        box = top, bottom, left, right
        if _fills(parts, number, box, wide):
            across = _sides(parts, image, number, box, length)
            along = _sides(parts.T, image.T, number, (left, right, top, bottom), length)
            bent = across[1] + along[1] < straight * (across[0] + along[0])
            if bent and across[3] + along[3] > sharp * (across[2] + along[2]):
                for row in range(top, bottom):
                    for i in range(left, right):
                        mask[row, i] &= parts[row, i] != number
                continue
        any_left = True
    return any_left
