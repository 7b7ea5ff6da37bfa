"""Compiled kernels of pixels that flash for a frame: how much rows bend, and which pixels stand alone in time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.preprocess._scale_kernels import FAST, Image

BESIDE = np.array([(0, -1), (0, 1), (-1, 0), (1, 0)])
RING = np.array([(j, i) for j in range(-2, 3) for i in range(-2, 3) if max(abs(j), abs(i)) == 2])


@njit(cache=True, nogil=True, fastmath=FAST - {"nnan"})
def bends(image: Image, every: int) -> Image:
    """Say how far pixels of every so-many-th row are off the mean of both beside them, ``(rows, columns - 2)``."""
    rows, columns = (image.shape[0] + every - 1) // every, image.shape[1]
    bent = np.empty((rows, columns - 2), dtype=np.float32)
    for row in range(rows):
        line, out = image[every * row], bent[row]
        before, here, after = line[: columns - 2], line[1 : columns - 1], line[2:]
        for i in range(len(out)):
            out[i] = abs(here[i] - np.float32(0.5) * (before[i] + after[i]))
    return bent


@njit(cache=True, nogil=True)
def _middle_of(image: Image, row: int, column: int, steps: NDArray[np.int64], ranked: Image) -> Any:
    """Median about a pixel, of an even number of values, mirrored at the edge; NaN where one is."""
    rows, columns = image.shape
    for k in range(len(steps)):
        j = rows - 1 - abs(rows - 1 - abs(row + steps[k, 0]))
        i = columns - 1 - abs(columns - 1 - abs(column + steps[k, 1]))
        value = image[j, i]
        if np.isnan(value):
            return value
        to = k
        while to > 0 and ranked[to - 1] > value:
            ranked[to] = ranked[to - 1]
            to -= 1
        ranked[to] = value
    half = len(steps) // 2
    return np.float32(0.5) * (ranked[half - 1] + ranked[half])


@njit(cache=True, nogil=True)
def flashes(
    image: Image,
    last: Image,
    bent: Image,
    every: int,
    least: np.float32,
    narrow: float,
    again: float,
    step: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Numbers of the pixels that flash, in every so-many-th row.

    A pixel flashes that bends its row by more than the least, is ``narrow`` times as high as what is beside it, and was
    not a share ``again`` as high in the last frame, where the scene was by ``step`` ``(2,)`` pixels of x and y less.
    """
    rows, columns = image.shape
    found, count, ranked = np.empty(256, np.int64), 0, np.empty(len(RING), dtype=np.float32)
    for line in range(len(bent)):
        for i in range(columns - 2):
            if not bent[line, i] > least:
                continue
            row, column = every * line, i + 1
            level = _middle_of(image, row, column, RING, ranked)
            height = image[row, column] - level
            if not abs(height) > narrow * abs(_middle_of(image, row, column, BESIDE, ranked) - level):
                continue
            before = min(max((row - step[1]) * columns + column - step[0], 0), rows * columns - 1)
            at = before // columns, before % columns
            as_high = last[at] - _middle_of(last, at[0], at[1], RING, ranked)
            if not as_high * np.sign(height) < again * abs(height):
                continue
            if count == len(found):
                found = np.concatenate((found, found))
            found[count] = row * columns + column
            count += 1
    return found[:count].copy()
