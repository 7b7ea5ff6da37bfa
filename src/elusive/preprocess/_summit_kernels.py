"""Compiled kernels of peaks: local maxima of whitened maps, told apart between scales and between maps."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive._kernels import copy_rows
from elusive._njit import njit
from elusive.contracts import Array
from elusive.preprocess._scale_kernels import FAST, Counts, Image

ROUND = 2.3  # height of a point over its weaker curvature, at most [px^2]; an edge bends in one direction only
SLACK = 2.0  # deviations that noise may add to it
CHUNK = 8  # pixels that are passed over at once: as many bytes as a word has
# pixels about another, row and column, on two circles that a point does not reach
RING = np.array(
    [
        [round(r * np.sin(a)), round(r * np.cos(a))]
        for r, n in ((4.5, 12), (6.5, 16))
        for a in 2 * np.pi * (np.arange(n) + 0.5) / n
    ]
)
FARTHEST = int(np.abs(RING).max())
LOG_4 = np.log(4.0)
BESIDE = 0.8  # of its height a point has at a scale twice or half its own
CELL_PX = 8  # of the grid by which neighbours are found


@njit(cache=True, nogil=True, fastmath=FAST)
def _mark(row: Image, least: np.float32, out: Counts) -> None:
    """Say which pixels have a magnitude beyond one."""
    for i in range(len(row)):
        out[i] = abs(row[i]) >= least


@njit(cache=True, nogil=True, fastmath=FAST)
def _is_summit(value: float, above: Image, here: Image, below: Image, i: int) -> Any:
    """Whether a pixel's magnitude is beyond that of its eight neighbours; of equals the first."""
    s = np.float32(1) if value > 0 else np.float32(-1)
    v = abs(value)
    first = max(s * here[i - 1], s * above[i - 1], s * above[i], s * above[i + 1])
    later = max(s * here[i + 1], s * below[i - 1], s * below[i], s * below[i + 1])
    return (v > first) & (v >= later)


@njit(cache=True, nogil=True)
def _top(left: float, middle: float, right: float) -> float:
    """Top of a parabola relative to the middle of three samples."""
    bend = left - 2.0 * middle + right
    return min(max(0.5 * (left - right) / bend, -0.5), 0.5) if bend < 0.0 else 0.0


@njit(cache=True, nogil=True, fastmath=FAST)
def _beside(white: Image, x: float, y: float, sign: np.float32, reach: int) -> Any:
    """Greatest ``sign * value`` of a map about a place; -1 where there is no such map."""
    rows, columns = white.shape
    best = np.float32(-1)
    row, column = int(np.floor(y + 0.5)), int(np.floor(x + 0.5))
    if reach <= row < rows - reach and reach <= column < columns - reach:
        for j in range(2 * reach + 1):
            for i in range(2 * reach + 1):
                best = max(best, sign * white[np.uintp(row - reach + j), np.uintp(column - reach + i)])
        return best
    for j in range(max(row - reach, 0), min(row + reach + 1, rows)):
        for i in range(max(column - reach, 0), min(column + reach + 1, columns)):
            best = max(best, sign * white[j, i])
    return best


@njit(cache=True, nogil=True, fastmath=FAST)
def _kind(white: Image, row: int, column: int, bounds: Array) -> int:
    """How restless it is in a ring round a pixel: how many bounds its mean root magnitude exceeds."""
    rows, columns = white.shape
    total, n = np.float32(0), len(RING)
    if FARTHEST <= row < rows - FARTHEST and FARTHEST <= column < columns - FARTHEST:
        for k in range(len(RING)):
            total += np.sqrt(abs(white[np.uintp(row + RING[k, 0]), np.uintp(column + RING[k, 1])]))
    else:
        n = 0
        for k in range(len(RING)):
            j, i = row + RING[k, 0], column + RING[k, 1]
            if 0 <= j < rows and 0 <= i < columns:
                total += np.sqrt(abs(white[j, i]))
                n += 1
    kind = 0
    for bound in bounds:
        kind += 1 if total > bound * n else 0
    return kind


@njit(cache=True, nogil=True)
def summits(
    white: Image,
    values: Image,
    part: Array,
    finer: Image,
    finer_part: Array,
    coarser: Image,
    coarser_part: Array,
    least: float,
    border: int,
    bounds: Array,
    grid: tuple[int, int, int, int],
    level: int,
    narrow: float,
    wide: float,
    step: int,
) -> tuple[Array, NDArray[np.int64]]:
    """Extrema over place and scale beyond a magnitude, and how much of a map is clutter of each kind.

    ``values`` are in grey levels; ``narrow`` and ``wide`` are the variances of centre and surround in the frame. Maps
    beside are without pixels where there are none; ``part`` is the place of a map's first pixel in the frame, in pixels
    of the map.

    Returns
    -------
    tuple
        ``(m, 9)``: x, y in the frame; height, not above a point's of its weaker curvature; sign; scale in pixels of
        the frame; contrast; kind of clutter and tile, from the numbers that ``grid`` gives after the tiles' rows and
        columns; the level. ``(len(bounds) + 1,)``: pixels of each kind, of every ``step``-th one along both axes.
    """
    rows, columns = white.shape
    found = np.empty((256 + white.size // 64, 9))  # of noise there are no more
    m, unit = 0, 2.0**level
    low = np.float32(least)
    beyond = np.zeros((columns // CHUNK + 1) * CHUNK, dtype=np.uint8)
    chunks = beyond.view(np.uint64)
    kinds = np.zeros(len(bounds) + 1, dtype=np.int64)
    for row in range(rows):
        if row % step == step // 2:
            for column in range(step // 2, columns, step):
                kinds[_kind(white, row, column, bounds)] += 1
        if not border <= row < rows - border:
            continue
        above, here, below = white[row - 1], white[row], white[row + 1]
        _mark(here[border : columns - border], low, beyond[border:])
        for chunk in range(len(chunks)):
            if not chunks[chunk]:
                continue
            for i in range(chunk * CHUNK, (chunk + 1) * CHUNK):
                if not beyond[i] or not _is_summit(here[i], above, here, below, i):
                    continue
                s, v = np.float32(1.0 if here[i] > 0 else -1.0), abs(here[i])
                x = i + _top(s * here[i - 1], v, s * here[i + 1]) + part[0]
                y = row + _top(s * above[i], v, s * below[i]) + part[1]
                left = _beside(finer, 2 * x - finer_part[0], 2 * y - finer_part[1], s, 2)
                right = _beside(coarser, 0.5 * x - coarser_part[0], 0.5 * y - coarser_part[1], s, 1)
                if left > v or right > v:
                    continue
                if m == len(found):
                    more = np.empty((2 * m, 9))
                    copy_rows(more, found)
                    found = more
                xx = s * (2 * here[i] - here[i - 1] - here[i + 1])
                yy = s * (2 * here[i] - above[i] - below[i])
                xy = s * 0.25 * (above[i + 1] + below[i - 1] - above[i - 1] - below[i + 1])
                weaker = 0.5 * (xx + yy) - np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
                found[m, 0], found[m, 1] = x * unit, y * unit
                found[m, 2] = max(min(v, ROUND * weaker + SLACK), least)
                found[m, 3] = s
                octaves = _top(left if finer.size else BESIDE * v, v, right if coarser.size else BESIDE * v)
                square = narrow * np.exp(LOG_4 * octaves)
                found[m, 4] = np.sqrt(square)
                found[m, 5] = values[row, i] / (square / (square + narrow) - square / (square + wide))
                found[m, 6] = grid[2] + _kind(white, row, i, bounds)
                found[m, 7] = grid[3] + row * grid[0] // rows * grid[1] + i * grid[1] // columns
                found[m, 8] = level
                m += 1
    return found[:m], kinds


@njit(cache=True, nogil=True)
def apart(x: Array, y: Array, sign: Array, radius: Array, columns: int, rows: int, most: int) -> NDArray[np.bool_]:
    """Which places, strongest first, have no stronger of their sign within the lesser radius; at most so many."""
    across, down = columns // CELL_PX + 2, rows // CELL_PX + 2
    newest = np.full((down, across), -1, dtype=np.int64)
    before = np.full(len(x), -1, dtype=np.int64)
    kept = np.zeros(len(x), dtype=np.bool_)
    total = 0
    for k in range(len(x)):
        if total == most:
            break
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
            total += 1
            before[k] = newest[row, column]
            newest[row, column] = k
    return kept
