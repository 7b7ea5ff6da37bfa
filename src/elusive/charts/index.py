"""Index over the edges of rings: a two-level grid of cells with the edges near each and a winding number in each.

Only tiles of cells near an edge are stored; the others hold the winding number of all their positions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.charts import _index_kernels as kernels
from elusive.charts.coast import Rings, edge_lengths
from elusive.contracts import Array
from elusive.errors import DataError

MOST_TILES = 1 << 23  # of the coarser level; cells grow where there would be more


class EdgeIndex(NamedTuple):
    """What the kernels need to find the edges near a position."""

    x0: float  # south-west corner of the grid [m]
    y0: float
    per_cell: float  # cells a metre
    tiles: NDArray[np.int32]  # (rows, columns) number of a stored tile, or -1 less the winding number there
    winding: NDArray[np.int8]  # (cells,) winding number at one point of each cell
    first: NDArray[np.int32]  # (cells + 1,) runs of cell c are runs[first[c]:first[c + 1]]
    runs: NDArray[np.int32]  # (R, 2) first and last vertex of consecutive edges within reach of the cell
    vertices: Array  # (V, 2) [m]
    per_length: Array  # (V,) one over the length of the edge that begins there [1/m]; 0: none does


def index_edges(rings: Rings, reach_m: float, cell_m: float | None = None, within: Array | None = None) -> EdgeIndex:
    """Index the edges of rings.

    Parameters
    ----------
    rings
        Closed rings that do not cross, what they enclose on their left.
    reach_m
        A cell lists every edge that is within this distance of a position in it; 0 serves winding numbers only.
    cell_m
        Width of a cell; not given: one that keeps both lists and their number short.
    within
        ``(2, 2)`` least and greatest x and y of the positions that will be asked for [m]; not given: any.

    Raises
    ------
    DataError
        If cells of the given width would be too many.
    """
    vertices = np.ascontiguousarray(rings.vertices)
    lengths = edge_lengths(rings)
    per_length = np.divide(1.0, lengths, out=np.zeros(len(lengths)), where=lengths > 0)
    if not len(vertices):
        return _EMPTY
    last = np.zeros(len(vertices), dtype=bool)
    last[rings.starts[1:] - 1] = True
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    cell = cell_m or max(0.5 * reach_m, min(float(lengths.sum()) / len(lengths), float((high - low).max()) / 64))
    if within is not None:
        low, high = np.maximum(low, within[0]), np.maximum(np.minimum(high, within[1]), np.maximum(low, within[0]))
    while True:
        corner = low - reach_m - 0.5 * cell
        columns, rows = np.ceil((high + reach_m + 0.5 * cell - corner) / (cell * kernels.TILE)).astype(int)
        if rows * columns <= MOST_TILES:
            break
        if cell_m is not None:
            raise DataError(
                f"coast: it is {max(high - low):g} m wide, too wide for cells of {cell:g} m; take the exact method, or "
                "a smaller chart."
            )
        cell *= 1.5
    x0, y0 = float(corner[0]), float(corner[1])
    tiles = np.zeros((rows, columns), np.int32)
    kernels.mark_tiles(vertices, last, x0, y0, cell, reach_m, tiles)
    stored = tiles > 0
    n_tiles = int(stored.sum())
    tiles[:] = -1
    tiles[stored] = np.arange(n_tiles)
    first, runs = kernels.list_runs(vertices, last, x0, y0, cell, reach_m, tiles, n_tiles)
    winding = np.zeros(n_tiles * kernels.TILE**2, np.int8)
    kernels.wind(vertices, last, x0, y0, cell, tiles, winding)
    return EdgeIndex(x0, y0, 1.0 / cell, tiles, winding, first, runs, vertices, per_length)


_EMPTY = EdgeIndex(
    0.0,
    0.0,
    1.0,
    np.full((1, 1), -1, np.int32),
    np.zeros(0, np.int8),
    np.zeros(1, np.int32),
    np.zeros((0, 2), np.int32),
    np.zeros((0, 2)),
    np.zeros(0),
)
