"""Compiled kernels that index edges by the cells near them, and find a position's cell and winding number."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive._kernels import copy_row
from elusive._njit import njit
from elusive.contracts import Array

TILE = 8  # cells along a side of a tile
SHIFT, INNER = np.uint64(3), np.uint64(TILE - 1)  # a cell's tile, and its place in it
# where in a cell its winding number is known: off the middle by an odd share, so that no edge of a chart meets it
AT_X, AT_Y = 0.5137318294, 0.4871930517


@njit(cache=True, nogil=True)
def _rows(vertices: Array, i: int, y0: float, cell: float, far: float, rows: int) -> tuple[int, int]:
    """Return the first row within ``far`` of edge i, and the one after the last."""
    low, high = min(vertices[i, 1], vertices[i + 1, 1]) - far - y0, max(vertices[i, 1], vertices[i + 1, 1]) + far - y0
    return max(int(low // cell), 0), min(int(high // cell), rows - 1) + 1


@njit(cache=True, nogil=True)
def _columns(
    vertices: Array, i: int, row: int, x0: float, y0: float, cell: float, far: float, columns: int
) -> tuple[int, int]:
    """Return the first column of a row whose cell may be within ``far`` of edge i, and the one after the last."""
    ax, ay, bx, by = vertices[i, 0] - x0, vertices[i, 1] - y0, vertices[i + 1, 0] - x0, vertices[i + 1, 1] - y0
    low, high = (min(ax, bx) - far) / cell, (max(ax, bx) + far) / cell
    if ay != by:
        # where cells' middles are within far, and half a cell's breadth across the edge, of its line
        length = math.hypot(bx - ax, by - ay)
        slope = (bx - ax) / (by - ay)
        middle = (ax + slope * ((row + 0.5) * cell - ay)) / cell
        half = (far * length / abs(by - ay)) / cell + 0.5 * (1.0 + abs(slope))
        low, high = max(low, math.ceil(middle - half - 0.5)), min(high, middle + half - 0.5)
    return int(max(low, 0.0)), int(max(min(high, columns - 1.0), -1.0)) + 1


@njit(cache=True, nogil=True)
def mark_tiles(
    vertices: Array, last: NDArray[np.bool_], x0: float, y0: float, cell: float, reach: float, tiles: NDArray[np.int32]
) -> None:
    """Set to 1 every tile with a cell within ``reach`` of an edge; ``last`` marks vertices where no edge begins."""
    far = reach + 1e-9 * cell
    rows, columns = tiles.shape[0] * TILE, tiles.shape[1] * TILE
    for i in range(len(vertices) - 1):
        if last[i]:
            continue
        for row in range(*_rows(vertices, i, y0, cell, far, rows)):
            for column in range(*_columns(vertices, i, row, x0, y0, cell, far, columns)):
                tiles[row // TILE, column // TILE] = 1


@njit(cache=True, nogil=True)
def list_runs(
    vertices: Array,
    last: NDArray[np.bool_],
    x0: float,
    y0: float,
    cell: float,
    reach: float,
    tiles: NDArray[np.int32],
    n_tiles: int,
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """List for every cell the runs of consecutive edges within ``reach`` of it.

    Returns
    -------
    first
        ``(n_tiles * TILE**2 + 1,)`` runs of cell c are ``runs[first[c]:first[c + 1]]``.
    runs
        ``(R, 2)`` first and last vertex of each.
    """
    far = reach + 1e-9 * cell
    rows, columns = tiles.shape[0] * TILE, tiles.shape[1] * TILE
    cells = n_tiles * TILE * TILE
    first = np.zeros(cells + 1, np.int32)
    runs = np.empty((0, 2), np.int32)
    previous = np.empty(cells, np.int32)
    at = np.empty(cells, np.int32)
    for filling in (False, True):
        if filling:
            for i in range(cells):
                first[i + 1] += first[i]
                at[i] = first[i] - 1
            runs = np.empty((first[-1], 2), np.int32)
        previous[:] = -2
        for i in range(len(vertices) - 1):
            if last[i]:
                continue
            for row in range(*_rows(vertices, i, y0, cell, far, rows)):
                for column in range(*_columns(vertices, i, row, x0, y0, cell, far, columns)):
                    c = (tiles[row // TILE, column // TILE] * TILE + row % TILE) * TILE + column % TILE
                    if previous[c] != i - 1:
                        if filling:
                            at[c] += 1
                            runs[at[c], 0] = i
                        else:
                            first[c + 1] += 1
                    previous[c] = i
                    if filling:
                        runs[at[c], 1] = i + 1
    return first, runs


@njit(cache=True, nogil=True)
def wind(
    vertices: Array,
    last: NDArray[np.bool_],
    x0: float,
    y0: float,
    cell: float,
    tiles: NDArray[np.int32],
    winding: NDArray[np.int8],
) -> None:
    """Fill in the winding number at each cell's point; a tile without edges becomes -1 less its winding number."""
    rows, columns = tiles.shape[0] * TILE, tiles.shape[1] * TILE
    counts = np.zeros(rows + 1, np.int64)
    place = np.empty(0, np.int32)
    sign = np.empty(0, np.int8)
    for filling in (False, True):
        if filling:
            counts = np.cumsum(counts)
            place, sign = np.empty(counts[-1], np.int32), np.empty(counts[-1], np.int8)
        for i in range(len(vertices) - 1):
            ay, by = (vertices[i, 1] - y0) / cell - AT_Y, (vertices[i + 1, 1] - y0) / cell - AT_Y
            if last[i] or ay == by:
                continue
            ax, bx = (vertices[i, 0] - x0) / cell - AT_X, (vertices[i + 1, 0] - x0) / cell - AT_X
            for row in range(max(math.ceil(min(ay, by)), 0), min(math.ceil(max(ay, by)), rows)):
                if not filling:
                    counts[row + 1] += 1
                    continue
                counts[row] -= 1
                to = counts[row]
                place[to] = min(max(math.ceil(ax + (row - ay) / (by - ay) * (bx - ax)), 0), columns)
                sign[to] = 1 if by > ay else -1
        if filling:
            break
        copy_row(counts, counts[1:])
        counts[-1] = 0
    line = np.zeros(columns + 1, np.int32)
    for row in range(rows):
        line[:] = 0
        for k in range(counts[row], counts[row + 1]):
            line[place[k]] += sign[k]
        total = 0
        for column in range(columns - 1, -1, -1):
            total += line[column + 1]
            tile = tiles[row // TILE, column // TILE]
            if tile >= 0:
                winding[(tile * TILE + row % TILE) * TILE + column % TILE] = total
            elif row % TILE == 0 and column % TILE == 0:
                tiles[row // TILE, column // TILE] = -1 - total


@njit(cache=True, nogil=True)
def cells_at(index: Any, x: Array, y: Array) -> NDArray[np.int64]:
    """Return the cell that each position lies in, or -1 less its winding number where no edge is near.

    In one loop without calls: with one a position, counting references to the arrays would take most of the time.
    """
    x0, y0, per_cell = index.x0, index.y0, index.per_cell
    tiles, first, winding = index.tiles, index.first, index.winding
    cells = np.empty(len(x), np.int64)
    for n in range(len(x)):
        u, v = (x[n] - x0) * per_cell, (y[n] - y0) * per_cell
        cell = np.int64(-1)
        if u >= 0.0 and v >= 0.0 and u < TILE * tiles.shape[1] and v < TILE * tiles.shape[0]:
            column, row = np.uint64(np.int64(u)), np.uint64(np.int64(v))
            tile = np.int64(tiles[row >> SHIFT, column >> SHIFT])
            cell = tile
            if tile >= 0:
                cell = (tile * TILE + np.int64(row & INNER)) * TILE + np.int64(column & INNER)
                if first[np.uint64(cell)] == first[np.uint64(cell + 1)]:
                    cell = -1 - np.int64(winding[np.uint64(cell)])
        cells[n] = cell
    return cells


@njit(cache=True, nogil=True)
def to_known(corner: tuple[float, float, float], x: float, y: float) -> tuple[float, float]:
    """Return the way from a position to the point of its cell where the winding number is known."""
    x0, y0, per_cell = corner
    column, row = math.floor((x - x0) * per_cell), math.floor((y - y0) * per_cell)
    return (column + AT_X) / per_cell + x0 - x, (row + AT_Y) / per_cell + y0 - y


@njit(cache=True, nogil=True)
def winding_in(
    cell: int,
    corner: tuple[float, float, float],
    winding: NDArray[np.int8],
    first: NDArray[np.int32],
    runs: NDArray[np.int32],
    vertices: Array,
    x: float,
    y: float,
) -> int:
    """Return the winding number round a position in a cell: the cell's, and the edges crossed on the way there."""
    total = int(winding[cell])
    qx, qy = to_known(corner, x, y)
    for r in range(first[cell], first[cell + 1]):
        i, end = runs[r, 0], runs[r, 1]
        bx, by = vertices[i, 0] - x, vertices[i, 1] - y
        beyond = bx * qy - by * qx >= 0.0
        while i < end:
            i += 1
            ax, ay, before = bx, by, beyond
            bx, by = vertices[i, 0] - x, vertices[i, 1] - y
            beyond = bx * qy - by * qx >= 0.0
            if before != beyond:
                here = ax * by - ay * bx >= 0.0
                there = (ax - qx) * (by - qy) - (ay - qy) * (bx - qx) >= 0.0
                total += int(here) - int(there)
    return total


@njit(cache=True, nogil=True)
def inside(index: Any, cells: NDArray[np.int64], x: Array, y: Array) -> NDArray[np.bool_]:
    """Tell which positions lie within the rings, given their cells."""
    corner, winding = (index.x0, index.y0, index.per_cell), index.winding
    first, runs, vertices = index.first, index.runs, index.vertices
    out = np.empty(len(x), np.bool_)
    for n in range(len(x)):
        cell = cells[n]
        if cell < 0:
            out[n] = cell == -2
        else:
            out[n] = winding_in(cell, corner, winding, first, runs, vertices, x[n], y[n]) > 0
    return out
