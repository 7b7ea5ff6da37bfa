"""Compiled kernels of peaks: local maxima of whitened maps, told apart between scales and between maps."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess._scale_kernels import Image

ROUND = 2.3  # height of a point over its weaker curvature, at most [px^2]; an edge bends in one direction only
SLACK = 2.0  # deviations that noise may add to it
INNER, OUTER = 4, 7  # pixels of a map, of a ring that a point does not reach
CELL_PX = 8  # of the grid by which neighbours are found


@njit(cache=True, nogil=True)
def summits(white: Image, least: float, border: int) -> Array:
    """Local extrema beyond a strength: ``(m, 6)`` of x, y (sub-pixel), value, row, column, and height as a point's."""
    rows, columns = white.shape
    found = np.empty((256, 6))
    m = 0
    for row in range(border, rows - border):
        above, here, below = white[row - 1], white[row], white[row + 1]
        for i in range(border, columns - border):
            value = here[i]
            if abs(value) < least:
                continue
            s = np.float32(1) if value > 0 else np.float32(-1)
            v = abs(value)
            if not (
                v > s * here[i - 1]
                and v >= s * here[i + 1]
                and v > s * above[i - 1]
                and v > s * above[i]
                and v > s * above[i + 1]
                and v >= s * below[i - 1]
                and v >= s * below[i]
                and v >= s * below[i + 1]
            ):
                continue
            if m == len(found):
                more = np.empty((2 * m, 6))
                more[:m] = found
                found = more
            found[m, 0] = i + _summit(s * here[i - 1], v, s * here[i + 1])
            found[m, 1] = row + _summit(s * above[i], v, s * below[i])
            xx = s * (2 * here[i] - here[i - 1] - here[i + 1])
            yy = s * (2 * here[i] - above[i] - below[i])
            xy = s * 0.25 * (above[i + 1] + below[i - 1] - above[i - 1] - below[i + 1])
            weaker = 0.5 * (xx + yy) - np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
            found[m, 2] = value
            found[m, 5] = max(min(v, ROUND * weaker + SLACK), least)
            found[m, 3], found[m, 4] = row, i
            m += 1
    return found[:m].copy()


@njit(cache=True, nogil=True)
def rings(white: Image, row: NDArray[np.int64], column: NDArray[np.int64]) -> Array:
    """Mean root of the magnitude in a ring round each pixel, every second pixel of it."""
    rows, columns = white.shape
    mean = np.empty(len(row))
    for k in range(len(row)):
        total, n = 0.0, 0
        for j in range(max(row[k] - OUTER, 0), min(row[k] + OUTER + 1, rows)):
            first = column[k] - OUTER + (j & 1)
            for i in range(first, column[k] + OUTER + 1, 2):
                square = (j - row[k]) ** 2 + (i - column[k]) ** 2
                if 0 <= i < columns and INNER * INNER <= square <= OUTER * OUTER:
                    total += np.sqrt(abs(white[j, i]))
                    n += 1
        mean[k] = total / max(n, 1)
    return mean


@njit(cache=True, nogil=True)
def _summit(left: float, middle: float, right: float) -> float:
    """Top of a parabola relative to the middle of three samples."""
    bend = left - 2.0 * middle + right
    return min(max(0.5 * (left - right) / bend, -0.5), 0.5) if bend < 0.0 else 0.0


@njit(cache=True, nogil=True)
def beside(white: Image, x: Array, y: Array, sign: Array, reach: int) -> Array:
    """Greatest ``sign * value`` of a map within ``reach`` pixels of each place; -inf beyond its edge."""
    rows, columns = white.shape
    best = np.full(len(x), -np.inf)
    for k in range(len(x)):
        row, column = int(np.floor(y[k] + 0.5)), int(np.floor(x[k] + 0.5))
        for j in range(max(row - reach, 0), min(row + reach + 1, rows)):
            for i in range(max(column - reach, 0), min(column + reach + 1, columns)):
                best[k] = max(best[k], sign[k] * white[j, i])
    return best


@njit(cache=True, nogil=True)
def apart(x: Array, y: Array, sign: Array, radius: Array, columns: int, rows: int) -> NDArray[np.bool_]:
    """Which places, the strongest first, have no stronger of their sign within the lesser of both radii."""
    across, down = columns // CELL_PX + 2, rows // CELL_PX + 2
    newest = np.full((down, across), -1, dtype=np.int64)
    before = np.full(len(x), -1, dtype=np.int64)
    kept = np.zeros(len(x), dtype=np.bool_)
    for k in range(len(x)):
        row = min(max(int(y[k]) // CELL_PX, 0), down - 1)
        column = min(max(int(x[k]) // CELL_PX, 0), across - 1)
        reach = int(radius[k]) // CELL_PX + 1
        free = True
        for j in range(max(row - reach, 0), min(row + reach + 1, down)):
            for i in range(max(column - reach, 0), min(column + reach + 1, across)):
                other = newest[j, i]
                while other >= 0 and free:
                    near = min(radius[k], radius[other])
                    apart_px = (x[k] - x[other]) ** 2 + (y[k] - y[other]) ** 2
                    free = sign[k] != sign[other] or apart_px >= near * near
                    other = before[other]
        if free:
            kept[k] = True
            before[k] = newest[row, column]
            newest[row, column] = k
    return kept
