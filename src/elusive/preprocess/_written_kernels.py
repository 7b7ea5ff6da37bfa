"""Compiled kernel of what is written into frames: parts of exactly one value, and how sharp their outlines are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.preprocess._scale_kernels import Counts, Image

FLAT = -1  # number of what is too large
CROSS = np.array([(-1, 0), (1, 0), (0, -1), (0, 1)])


@njit(cache=True, nogil=True)
def _is_step(value: np.float32, first: np.float32, second: np.float32, bound: np.float32, left: np.float32) -> np.bool_:
    """Say if a value's step to the first pixel beside is more than a bound, and no more than a share left of it there.

    Not ``and``, that a row's go in vector registers.
    """
    whole = value - second
    return (abs(value - first) > bound) & ((first - second) * whole <= left * whole * whole)


@njit(cache=True, nogil=True)
def _stepped(image: Image, row: int, bound: np.float32, left: np.float32, out: Counts) -> bool:
    """Mark the pixels of a row with such a step beside them; say if there are any."""
    rows, columns = image.shape
    here = image[row]
    for i in range(columns):
        out[i] = 0
    for i in range(columns - 2):
        out[i] |= _is_step(here[i], here[i + 1], here[i + 2], bound, left)
    for i in range(2, columns):
        out[i] |= _is_step(here[i], here[i - 1], here[i - 2], bound, left)
    for side in (-1, 1):
        if 0 <= row + 2 * side < rows:
            first, second = image[row + side], image[row + 2 * side]
            for i in range(columns):
                out[i] |= _is_step(here[i], first[i], second[i], bound, left)
    found = np.uint8(0)
    for i in range(columns):
        found |= out[i]
    return bool(found)


@njit(cache=True, nogil=True)
def _grown(image: Image, part: NDArray[np.int32], number: int, pixels: NDArray[np.int64]) -> int:
    """Grow a part from its first pixel, and say how many it has; 0 where it is of a flat part."""
    rows, columns = image.shape
    at, count, flat = 0, 1, False
    value = image[pixels[0] // columns, pixels[0] % columns]
    while at < count and not flat:
        y, x = pixels[at] // columns, pixels[at] % columns
        at += 1
        for j in range(max(y - 1, 0), min(y + 2, rows)):
            for k in range(max(x - 1, 0), min(x + 2, columns)):
                if image[j, k] != value or part[j, k] == number:
                    continue
                if part[j, k] == FLAT or count == len(pixels):
                    flat = True
                else:
                    part[j, k] = number
                    pixels[count] = j * columns + k
                    count += 1
    if flat:
        for k in range(count):
            part[pixels[k] // columns, pixels[k] % columns] = FLAT
        return 0
    return count


@njit(cache=True, nogil=True)
def _is_sharp(
    image: Image,
    part: NDArray[np.int32],
    number: int,
    pixels: NDArray[np.int64],
    bound: np.float32,
    share: float,
    left: np.float32,
) -> bool:
    """Say if so much of a part's outline is sharp.

    A side is with a step as above. Where the second is the part's again, or beyond the frame, a side does not count.
    """
    rows, columns = image.shape
    every = sharp = 0
    for pixel in pixels:
        y, x = pixel // columns, pixel % columns
        value = image[y, x]
        for down, right in CROSS:
            j, k = y + 2 * down, x + 2 * right
            if not (0 <= j < rows and 0 <= k < columns):
                continue
            if part[j, k] == number or part[y + down, x + right] == number:
                continue
            every += 1
            sharp += bool(_is_step(value, image[y + down, x + right], image[j, k], bound, left))
    return every > 0 and sharp >= share * every


@njit(cache=True, nogil=True)
def sharp_parts(
    image: Image, bound: np.float32, share: float, left: np.float32
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return parts of exactly one value, whose pixels touch, and so much of whose outline is sharp.

    Their pixels' numbers in the frame, part after part, and where each part begins and ends. What is larger than a
    box about the frame, four pixels wide, is a flat part of the scene.
    """
    rows, columns = image.shape
    part = np.zeros((rows, columns), dtype=np.int32)
    steps = np.zeros(columns, dtype=np.uint8)
    found, ends, number = [np.int64(0)], [np.int64(0)], 0
    pixels = np.empty(8 * (rows + columns), dtype=np.int64)
    for row in range(rows):
        if not _stepped(image, row, bound, left, steps):
            continue
        for i in range(columns):
            if not steps[i] or part[row, i]:
                continue
            number += 1
            part[row, i] = number
            pixels[0] = row * columns + i
            count = _grown(image, part, number, pixels)
            if count and _is_sharp(image, part, number, pixels[:count], bound, share, left):
                found.extend(pixels[:count])
                ends.append(np.int64(len(found) - 1))
    return np.array(found)[1:], np.array(ends)
