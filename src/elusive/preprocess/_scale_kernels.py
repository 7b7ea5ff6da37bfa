"""Compiled kernels of the scales of a frame: pyramid, differences of Gaussians, local noise.

A pyramid as in Burt and Adelson (1983): pixel (x, y) of a level lies at (2 x, 2 y) of the finer one. Beyond its edge
an image is taken to go on as at the edge. Row by row, so that the loops run in vector registers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit

Image = NDArray[np.float32]
Mask = NDArray[np.bool_]
Counts = NDArray[np.uint8]  # of frames, which are read and written often: a byte each

BLOCK = 8  # pixels of a level along a block's side
FAST = {"contract", "reassoc", "nsz", "nnan"}


@njit(cache=True, nogil=True, fastmath=FAST)
def _down(image: Image, row: int, taps: Image, out: Image) -> None:
    """Smooth along the columns at one row, two more values at either side; ``out``: columns + 4."""
    last, columns = image.shape[0] - 1, image.shape[1]
    upper, above = image[max(row - 2, 0)], image[max(row - 1, 0)]
    here, below, lower = image[row], image[min(row + 1, last)], image[min(row + 2, last)]
    far, near, middle = taps[0], taps[1], taps[2]
    inner = out[2 : columns + 2]
    for i in range(columns):
        inner[i] = far * (upper[i] + lower[i]) + near * (above[i] + below[i]) + middle * here[i]
    out[0], out[1] = inner[0], inner[0]
    out[columns + 2], out[columns + 3] = inner[columns - 1], inner[columns - 1]


@njit(cache=True, nogil=True, fastmath=FAST)
def halve(image: Image) -> Image:
    """Smooth by the binomial of five taps and keep every second pixel."""
    rows, columns = image.shape
    half = np.empty(((rows + 1) // 2, (columns + 1) // 2), dtype=np.float32)
    taps = np.array([1 / 16, 4 / 16, 6 / 16], dtype=np.float32)
    line = np.empty(columns + 4, dtype=np.float32)
    for row in range(len(half)):
        _down(image, 2 * row, taps, line)
        out = half[row]
        for i in range(len(out)):
            j = 2 * i
            out[i] = taps[0] * (line[j] + line[j + 4]) + taps[1] * (line[j + 1] + line[j + 3]) + taps[2] * line[j + 2]
    return half


@njit(cache=True, nogil=True, fastmath=FAST)
def spread_blocks(row: Image, out: Image) -> None:
    """Read a value a block between the blocks' centres linearly, for each pixel along them."""
    blocks, half, each = len(row), BLOCK // 2, np.float32(1.0 / BLOCK)
    out[:half] = row[0]
    inner = out[half:]
    for k in range(blocks - 1):
        a, step, start = row[k], (row[k + 1] - row[k]) * each, k * BLOCK
        for i in range(BLOCK):
            inner[start + i] = a + (np.float32(i) + np.float32(0.5)) * step
    out[(blocks - 1) * BLOCK + half :] = row[blocks - 1]


@njit(cache=True, nogil=True, fastmath=FAST)
def blend(image: Image, place: float, out: Image) -> None:
    """Read an image between two of its rows."""
    last = image.shape[0] - 1
    place = min(max(place, 0.0), float(last))
    k = min(int(place), max(last - 1, 0))
    part = np.float32(place - k)
    upper, lower = image[k], image[min(k + 1, last)]
    for i in range(len(out)):
        out[i] = upper[i] + part * (lower[i] - upper[i])


@njit(cache=True, nogil=True, fastmath=FAST)
def smooth(image: Image, taps: Image) -> Image:
    """Smooth along both axes by five taps, of which the outer half is given, outermost first."""
    rows, columns = image.shape
    result = np.empty((rows, columns), dtype=np.float32)
    line = np.empty(columns + 4, dtype=np.float32)
    far, near, middle = taps[0], taps[1], taps[2]
    for row in range(rows):
        _down(image, row, taps, line)
        out = result[row]
        for i in range(columns):
            out[i] = far * (line[i] + line[i + 4]) + near * (line[i + 1] + line[i + 3]) + middle * line[i + 2]
    return result


@njit(cache=True, nogil=True, fastmath=FAST)
def subtract(image: Image, coarse: Image) -> Image:
    """Take away an image half as large, between its pixels linearly."""
    rows, columns = image.shape
    result = np.empty((rows, columns), dtype=np.float32)
    between = np.empty(coarse.shape[1] + 1, dtype=np.float32)
    half = np.float32(0.5)
    for row in range(rows):
        blend(coarse, row / 2, between[:-1])
        between[-1] = between[-2]
        values, out = image[row], result[row]
        for k in range(columns // 2):
            a, b = between[k], between[k + 1]
            out[2 * k] = values[2 * k] - a
            out[2 * k + 1] = values[2 * k + 1] - half * (a + b)
        if columns % 2:
            out[columns - 1] = values[columns - 1] - between[columns // 2]
    return result


@njit(cache=True, nogil=True, fastmath=FAST)
def block_roots(image: Image) -> Image:
    """Mean root of the magnitude in blocks of :data:`BLOCK`; the last takes what is left over."""
    rows, columns = image.shape
    down, across = max(rows // BLOCK, 1), max(columns // BLOCK, 1)
    mean = np.empty((down, across), dtype=np.float32)
    line = np.empty(columns, dtype=np.float32)
    for i in range(down):
        first, end = i * BLOCK, rows if i == down - 1 else (i + 1) * BLOCK
        line[:] = 0
        for row in range(first, end):
            values = image[row]
            for k in range(columns):
                line[k] += np.sqrt(np.abs(values[k]))
        for j in range(across):
            left, right = j * BLOCK, columns if j == across - 1 else (j + 1) * BLOCK
            total = np.float32(0)
            for k in range(left, right):
                total += line[k]
            mean[i, j] = total / np.float32((end - first) * (right - left))
    return mean


@njit(cache=True, nogil=True, fastmath=FAST)
def whiten(image: Image, inverse: Image) -> Image:
    """Multiply by a value a block, between the blocks' centres linearly."""
    rows, columns = image.shape
    white = np.empty((rows, columns), dtype=np.float32)
    between, factor = np.empty(inverse.shape[1], dtype=np.float32), np.empty(columns, dtype=np.float32)
    for row in range(rows):
        blend(inverse, (row - (BLOCK - 1) / 2) / BLOCK, between)
        spread_blocks(between, factor)
        values, out = image[row], white[row]
        for i in range(columns):
            out[i] = values[i] * factor[i]
    return white


@njit(cache=True, nogil=True)
def _middle_of(a: float, b: float, c: float, d: float, e: float) -> float:
    low, high = max(min(a, b), min(c, d)), min(max(a, b), max(c, d))
    # the middle three of four, then of five
    return max(min(low, high), min(max(low, high), e))


@njit(cache=True, nogil=True)
def _mirrored(i: int, n: int) -> int:
    return min(abs(i), 2 * n - 2 - i) if n > 2 else min(max(i, 0), n - 1)


@njit(cache=True, nogil=True)
def middle(blocks: Image) -> Image:
    """Median of five along the columns, then of five along the rows; mirrored at the edge."""
    rows, columns = blocks.shape
    down, both = np.empty_like(blocks), np.empty_like(blocks)
    for i in range(rows):
        a, b, d, e = _mirrored(i - 2, rows), _mirrored(i - 1, rows), _mirrored(i + 1, rows), _mirrored(i + 2, rows)
        for j in range(columns):
            down[i, j] = _middle_of(blocks[a, j], blocks[b, j], blocks[i, j], blocks[d, j], blocks[e, j])
    for j in range(columns):
        a, b, d, e = (
            _mirrored(j - 2, columns),
            _mirrored(j - 1, columns),
            _mirrored(j + 1, columns),
            _mirrored(j + 2, columns),
        )
        for i in range(rows):
            both[i, j] = _middle_of(down[i, a], down[i, b], down[i, j], down[i, d], down[i, e])
    return both


@njit(cache=True, nogil=True, fastmath=FAST)
def along(image: Image, bound: float) -> tuple[Image, Image]:
    """Mean of each row and of each column, values clipped."""
    rows, columns = image.shape
    of_rows, of_columns = np.empty(rows, dtype=np.float32), np.zeros(columns, dtype=np.float32)
    most = np.float32(bound)
    for row in range(rows):
        values, total = image[row], np.float32(0)
        for i in range(columns):
            value = min(max(values[i], -most), most)
            total += value
            of_columns[i] += value
        of_rows[row] = total / np.float32(columns)
    return of_rows, of_columns / np.float32(rows)


@njit(cache=True, nogil=True)
def level_lines(response: Image, samples: int, mean_root: float, clip: float, alike: float, plain: float) -> Image:
    """Take away what whole rows and columns add where that is ``plain`` times what chance gives.

    ``clip`` deviations are what a pixel counts for, told from so many ``samples`` by their mean root; ``alike``
    neighbours speak as one.
    """
    flat = response.ravel()
    step, total, n = max(1, len(flat) // samples) | 1, 0.0, 0
    for i in range(0, len(flat), step):
        total += np.sqrt(abs(flat[i]))
        n += 1
    deviation = (total / n / mean_root) ** 2
    of_rows, of_columns = along(response, clip * deviation)
    levelled = response
    for axis in range(2):
        mean = of_rows if axis == 0 else of_columns
        spread = np.median(np.abs(mean)) / 0.6745
        chance = deviation * np.sqrt(alike / response.shape[1 - axis])
        if spread > plain * chance:
            offset = np.clip(mean, -4 * spread, 4 * spread) * np.float32(1 - (chance / spread) ** 2)
            offset = offset.astype(np.float32)
            levelled = levelled - (offset.reshape(-1, 1) if axis == 0 else offset.reshape(1, -1))
    return levelled


@njit(cache=True, nogil=True)
def local_variance(image: Image, mean_root: float, share: float, least: float) -> Image:
    """Variance about each block by the median of the mean roots round it, held above a share of its mean."""
    roots = middle(block_roots(image))
    variance, total = np.empty_like(roots), 0.0
    for i in range(roots.shape[0]):
        for j in range(roots.shape[1]):
            square = (roots[i, j] / np.float32(mean_root)) ** 2
            variance[i, j] = square * square
            total += variance[i, j]
    held = np.float32(max(share * total / variance.size, least))
    for i in range(roots.shape[0]):
        for j in range(roots.shape[1]):
            variance[i, j] = max(variance[i, j], held)
    return variance
