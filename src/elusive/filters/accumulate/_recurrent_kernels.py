"""Compiled kernels of the recurrent filter: each velocity's accumulated evidence, the maximum and where it is from.

A signal is a frame of one row. Rows are worked on in tiles that stay in cache while every velocity's plane streams by.
Loops over cells are flat and count in unsigned numbers, which lets them be vectorised.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import uint64

from elusive._njit import njit

TILE = 32768  # cells: three maps of a tile stay in a cache of 1 MB


@njit(cache=True, nogil=True)
def tile_rows(rows: int, columns: int) -> int:
    """Rows worked on at once."""
    return min(rows, max(1, TILE // columns))


@njit(cache=True, nogil=True)
def straight(
    planes: Any, vectors: Any, offsets: Any, at: float, scene_x: float, scene_y: float, evidence: Any, work: Any,
    alpha: float, gain: float, variance: float, most: float, bounded: bool, score: Any, velocity: Any,
) -> tuple[float, int]:  # fmt: skip
    """One step, eq. 7, of trajectories that keep their velocity: in place, and no plane is moved.

    A cell of ``planes[v]`` is where its trajectory was anchored; it stands ``offsets[v]`` further, round the frame.
    The maps of the tile in ``work`` (scaled evidence, maximum, its index) are two frames wide, so that a row of any
    offset is one stretch; its last, ``held``, is what each velocity is worth. A square of evidence counts ``most`` at
    most towards the variance. Returns the variance and the best cell's flat index; where the evidence is not finite,
    neither is the variance, and nothing has changed.
    """
    count, rows, columns = planes.shape
    variance = alpha * alpha * variance + gain * gain * _mean_square(evidence, most)
    if not np.isfinite(variance):
        return variance, 0
    shifts = _move(offsets, vectors, at, scene_x, scene_y)
    keep, flat = planes.dtype.type(alpha), planes.reshape(-1)
    scaled, best, which, held = work
    span, height = 2 * columns, tile_rows(rows, columns)
    width = min(span, 2 * TILE)
    starts = np.empty(3, np.int64)
    found = (0, -np.inf)
    for top in range(0, rows, height):
        bottom = min(top + height, rows)
        _open(evidence, top, bottom, gain, span, scaled, best, which)
        for left in range(0, span, width):
            v = 0
            while v < count:
                dx = offsets[v, 0] % columns
                # three that stand alike are compared in one pass
                three = v + 2 < count and offsets[v + 1, 0] % columns == dx and offsets[v + 2, 0] % columns == dx
                group = 3 if three else 1
                start, stop = max(0, left - dx), min(columns, left + width - dx)
                for y in range(top, bottom if start < stop else top):
                    x, length = (y - top) * span + dx + start, stop - start
                    for e in range(group):
                        row = ((v + e) * rows + (y - offsets[v + e, 1]) % rows) * columns
                        if bounded:
                            _forget(flat, row, start, stop, dx, shifts[v + e], y, rows, columns)
                        starts[e] = row + start
                        _update(flat, starts[e], scaled, x, length, keep)
                    if three:
                        _highest_of_three(flat, starts, best, which, x, length, v, held[v : v + 3])
                    else:
                        _highest(flat, starts[0], best, which, x, length, v, held[v])
                v += group
        found = _close(best, which, top, bottom, span, np.sqrt(variance), score, velocity, found)
    return variance, found[0]


@njit(cache=True, nogil=True)
def switching(
    planes: Any, later: Any, vectors: Any, offsets: Any, at: float, scene_x: float, scene_y: float, evidence: Any,
    work: Any, alpha: float, gain: float, variance: float, most: float, bounded: bool, score: Any, velocity: Any,
    firsts: Any, sources: Any, shares: Any,
) -> tuple[float, int]:  # fmt: skip
    """One step, eq. 7, of trajectories that may change velocity: planes are mixed, moved and updated into ``later``.

    Planes stand where their cells stand. That of velocity v is mixed of ``sources[firsts[v] : firsts[v + 1]]`` in
    these ``shares``; one plane more than velocities is their sum. Returns as :func:`straight`.
    """
    count, rows, columns = len(vectors), planes.shape[1], planes.shape[2]
    variance = alpha * alpha * variance + gain * gain * _mean_square(evidence, most)
    if not np.isfinite(variance):
        return variance, 0
    shifts = _move(offsets, vectors, at, scene_x, scene_y)
    keep, one, flat, into = planes.dtype.type(alpha), planes.dtype.type(1), planes.reshape(-1), later.reshape(-1)
    scaled, best, which, held = work
    span, height = 2 * columns, tile_rows(rows, columns)
    found = (0, -np.inf)
    later[count:] = 0
    for top in range(0, rows, height):
        bottom = min(top + height, rows)
        _open(evidence, top, bottom, gain, span, scaled, best, which)
        for v in range(count):
            dx = shifts[v, 0] % columns
            for y in range(top, bottom):
                row, before = (v * rows + y) * columns, (y - shifts[v, 1]) % rows * columns
                later[v, y] = 0
                for e in range(firsts[v], firsts[v + 1]):
                    source = sources[e] * rows * columns + before
                    _add(into, row, flat, source + columns - dx, dx, shares[e])
                    _add(into, row + dx, flat, source, columns - dx, shares[e])
                if bounded:
                    _forget(into, row, 0, columns, 0, shifts[v], y, rows, columns)
                x = (y - top) * span
                _update(into, row, scaled, x, columns, keep)
                _highest(into, row, best, which, x, columns, v, held[v])
                if len(planes) > count:
                    _add(into, (count * rows + y) * columns, into, row, columns, one)
        found = _close(best, which, top, bottom, span, np.sqrt(variance), score, velocity, found)
    return variance, found[0]


@njit(cache=True, nogil=True)
def _update(planes: Any, start: int, scaled: Any, x: int, length: int, keep: Any) -> None:
    """Eq. 7c on a stretch of a row."""
    p, s = uint64(start), uint64(x)
    for i in range(uint64(length)):
        planes[p + i] = keep * planes[p + i] + scaled[s + i]


@njit(cache=True, nogil=True)
def _add(total: Any, start: int, planes: Any, source: int, length: int, share: Any) -> None:
    p, q = uint64(start), uint64(source)
    for i in range(uint64(length)):
        total[p + i] += share * planes[q + i]


@njit(cache=True, nogil=True)
def _highest(planes: Any, start: int, best: Any, which: Any, x: int, length: int, v: int, held: Any) -> None:
    """Raise the maximum over a stretch, where the first velocity to attain it counts."""
    p, s, index = uint64(start), uint64(x), np.int32(v)
    for i in range(uint64(length)):
        value, most, at = held * planes[p + i], best[s + i], which[s + i]
        best[s + i] = value if value > most else most
        which[s + i] = index if value > most else at


@njit(cache=True, nogil=True)
def _highest_of_three(planes: Any, starts: Any, best: Any, which: Any, x: int, length: int, v: int, held: Any) -> None:
    """:func:`_highest` of velocities v, v + 1 and v + 2."""
    p, q, r, s = uint64(starts[0]), uint64(starts[1]), uint64(starts[2]), uint64(x)
    one, two, three = np.int32(v), np.int32(v + 1), np.int32(v + 2)
    first, second, third = held[0], held[1], held[2]
    for i in range(uint64(length)):
        most, at = best[s + i], which[s + i]
        value = first * planes[p + i]
        most, at = (value, one) if value > most else (most, at)
        value = second * planes[q + i]
        most, at = (value, two) if value > most else (most, at)
        value = third * planes[r + i]
        best[s + i] = value if value > most else most
        which[s + i] = three if value > most else at


@njit(cache=True, nogil=True)
def _move(offsets: Any, vectors: Any, at: float, scene_x: float, scene_y: float) -> Any:
    """Bring the offsets to frame ``at``; return by how many cells each has changed."""
    shifts = np.empty_like(offsets)
    for v in range(len(vectors)):
        x, y = int(np.rint(at * vectors[v, 0] + scene_x)), int(np.rint(at * vectors[v, 1] + scene_y))
        shifts[v, 0], shifts[v, 1] = x - offsets[v, 0], y - offsets[v, 1]
        offsets[v, 0], offsets[v, 1] = x, y
    return shifts


@njit(cache=True, nogil=True)
def _forget(planes: Any, row: int, start: int, stop: int, dx: int, shift: Any, y: int, rows: int, columns: int) -> None:
    """Zero what has just entered row ``y``, in its cells start to stop: they hold what left at the other side."""
    by_x, by_y = shift[0], shift[1]
    if y < by_y or y >= rows + by_y:
        planes[row + start : row + stop] = 0
    for x in range(max(0, columns + by_x) if by_x < 0 else 0, columns if by_x < 0 else min(by_x, columns)):
        cell = (x - dx) % columns
        if start <= cell < stop:
            planes[row + cell] = 0


@njit(cache=True, nogil=True)
def forget(
    planes: Any, vectors: Any, offsets: Any, at: float, scene_x: float, scene_y: float, top: int, left: int,
    removed: Any, weight: float, bounded: bool,
) -> None:  # fmt: skip
    """Take a patch of the evidence of an earlier frame, at ``top, left``, out of every plane that still holds it.

    The frame stood at ``at``, its scene at ``scene_x, scene_y``, and its evidence has this weight by now.
    """
    _, rows, columns = planes.shape
    factor = planes.dtype.type(weight)
    for v in range(len(vectors)):
        x, y = int(np.rint(at * vectors[v, 0] + scene_x)), int(np.rint(at * vectors[v, 1] + scene_y))
        on_x, on_y = offsets[v, 0] - x, offsets[v, 1] - y
        for i in range(removed.shape[0]):
            for k in range(removed.shape[1]):
                row, column = top + i, left + k
                # what has left a bounded frame since is gone already
                if bounded and not (0 <= row + on_y < rows and 0 <= column + on_x < columns):
                    continue
                planes[v, (row - y) % rows, (column - x) % columns] -= factor * planes.dtype.type(removed[i, k])


@njit(cache=True, nogil=True, fastmath={"reassoc"})
def _mean_square(values: Any, most: float) -> float:
    """Mean of the squares, none above ``most``; NaN where a value is not finite."""
    total, whole, count = 0.0, 0.0, values.shape[0] * values.shape[1]
    for y in range(values.shape[0]):
        for x in range(values.shape[1]):
            square = np.float64(values[y, x]) ** 2
            whole += square
            total += square if square < most else most
    return total / float(count) if np.isfinite(whole) else np.nan


@njit(cache=True, nogil=True)
def _open(evidence: Any, top: int, bottom: int, gain: float, span: int, scaled: Any, best: Any, which: Any) -> None:
    """Fill a tile with its evidence, twice side by side, and with no maximum yet."""
    columns, factor = evidence.shape[1], scaled.dtype.type(gain)
    for y in range(top, bottom):
        start = (y - top) * span
        for x in range(columns):
            value = factor * evidence[y, x]
            scaled[start + x] = value
            scaled[start + columns + x] = value
    best[:] = -np.inf
    which[:] = 0


@njit(cache=True, nogil=True)
def _close(
    best: Any, which: Any, top: int, bottom: int, span: int, deviation: float, score: Any, velocity: Any,
    found: tuple[int, float],
) -> tuple[int, float]:  # fmt: skip
    """Write a tile's maps, in deviations; return the best cell so far, as flat index and score."""
    columns, unit = score.shape[1], score.dtype.type(deviation)
    place, highest = found
    for y in range(top, bottom):
        for x in range(columns):
            a = (y - top) * span + x
            b = a + columns
            if best[b] > best[a] or (best[b] == best[a] and which[b] < which[a]):
                a = b
            value = best[a] / unit if unit > 0 else score.dtype.type(0)
            score[y, x], velocity[y, x] = value, which[a]
            if value > highest:
                place, highest = y * columns + x, value
    return place, highest
