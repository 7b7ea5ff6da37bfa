"""Figures 7.1 to 7.3 of Bootsveld (2012): the edges that a position meets without a partition, and with two of them.

Section 7.2: with simple partitioning a cell lists the edges inside of it, with intelligent partitioning those within
three deviations of it too.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from elusive.charts import Coast, CoastPart
from elusive.charts.index import EdgeIndex, index_edges
from elusive.charts.nearest import signed_distances
from elusive.contracts import Array, X, Y
from elusive.experiments.bootsveld2012.case import ShipCase, scenery
from elusive.experiments.bootsveld2012.clouds import LAND, SHORE, draw_land
from elusive.experiments.bootsveld2012.shore import shoreline
from elusive.io.csv_files import write_results
from elusive.report import plots

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# the width of the boundary round a cell [deviations]; None: no cells
FIGURES: dict[str, float | None] = {"fig7_1": None, "fig7_2": 0.0, "fig7_3": 3.0}
CELLS = 5  # along each side, as in the thesis
TILE = 8  # cells along a side of the index's one tile: five after the first are the partition
CELL_M = 120.0
SIGMA_M = 20.0  # that of the thesis's text: with the port's 5 m a boundary could hardly be seen
ENOUGH = 10.0  # deviations, beyond which an edge changes P(water) by less than a double shows
PIXELS = 480  # along each side; a whole number a cell


class CellRow(NamedTuple):
    """One row of ``fig7_1.csv`` to ``fig7_3.csv``; the map without partitioning is one cell."""

    column: int  # from the west
    row: int  # from the south
    edges: int  # that a position in the cell meets
    greatest_error: float  # of P(water) in the cell, against that by all edges


class Partition(NamedTuple):
    """A piece of the map in cells, what each lists, and what comes of it."""

    corner: Array  # (2,) south-west [m]
    listed: list[NDArray[np.int64]]  # of cell 5 * row + column the vertices where listed edges begin
    water: Array  # (PIXELS, PIXELS) P(water), row 0 in the south
    error: Array  # (PIXELS, PIXELS) this less P(water) by all edges

    @property
    def rows(self) -> list[CellRow]:
        """What the table says of each cell."""
        side = round(len(self.listed) ** 0.5)
        worst = np.abs(self.error).reshape(side, PIXELS // side, side, PIXELS // side).max(axis=(1, 3))
        return [
            CellRow(n % side, n // side, len(edges), float(worst[n // side, n % side]))
            for n, edges in enumerate(self.listed)
        ]


def partition(coast: Coast, middle: Array, boundary: float | None) -> Partition:
    """Partition the piece of a map about ``middle`` into 5 by 5 cells, each with a boundary [deviations]; None: none.

    The coast has one imprecision.
    """
    # the index begins half a cell before its first vertex at most, and the partition a cell later
    corner = np.maximum(middle - 0.5 * CELLS * CELL_M, coast.land.vertices.min(axis=0) + 0.5 * CELL_M)
    every = np.setdiff1d(np.arange(len(coast.land.vertices)), coast.land.starts[1:] - 1)
    whole = _water(coast, _index(coast, corner, ENOUGH * float(coast.sigma_m[0])), corner)
    if boundary is None:
        return Partition(corner, [every], whole, np.zeros_like(whole))
    index = _index(coast, corner, boundary * float(coast.sigma_m[0]))
    water = _water(coast, index, corner)
    cells = [TILE * row + column for row in range(1, CELLS + 1) for column in range(1, CELLS + 1)]
    return Partition(corner, [_listed(index, cell) for cell in cells], water, water - whole)


def _index(coast: Coast, corner: Array, reach_m: float) -> EdgeIndex:
    # the index begins its reach and half a cell before what it is asked for; its outermost cells list some edges more
    low = corner + reach_m - 0.5 * CELL_M
    return index_edges(coast.land, reach_m, CELL_M, np.array([low, low]))


def _listed(index: EdgeIndex, cell: int) -> NDArray[np.int64]:
    runs = index.runs[index.first[cell] : index.first[cell + 1]]
    return np.concatenate([np.zeros(0, np.int64), *(np.arange(begin, end) for begin, end in runs)])


def _water(coast: Coast, index: EdgeIndex, corner: Array) -> Array:
    """P(water) at the middles of pixels by the shortest distance to what the index lists, ``(PIXELS, PIXELS)``."""
    side = CELLS * CELL_M * (np.arange(PIXELS) + 0.5) / PIXELS
    x, y = (values.ravel() for values in np.meshgrid(corner[0] + side, corner[1] + side))
    away = signed_distances(index, coast.on_border, x, y, np.ones(len(x), dtype=bool))
    return np.asarray(ndtr(away / coast.sigma_m[0])).reshape(PIXELS, PIXELS)


def draw_partition(folder: Path, name: str, case: ShipCase) -> None:
    """Write one figure as PNG, with a table of its cells: what one cell lists, and the error that it makes.

    The piece is about the middle of the ship's way; the cell shown is that of the nine inner ones in which simple
    partitioning errs most.
    """
    scene, boundary = scenery(case), FIGURES[name]
    middle = scene.truth[len(scene.truth) // 2, [X, Y]] - scene.moved
    land = shoreline(case.shoreline, case.delta_seed)
    coast = Coast.of(CoastPart(list(land), SIGMA_M))
    made = partition(coast, middle, boundary)
    rows = made.rows
    write_results(folder / f"{name}.csv", CellRow._fields, rows)
    simple = partition(coast, middle, FIGURES["fig7_2"]).rows
    inner = [cell for cell in simple if {cell.column, cell.row}.isdisjoint({0, CELLS - 1})]
    shown = max(inner, key=lambda cell: cell.greatest_error)
    most = max(cell.greatest_error for cell in simple)
    number = 0 if boundary is None else CELLS * shown.row + shown.column
    west, south = made.corner
    extent = (west, west + CELLS * CELL_M, south, south + CELLS * CELL_M)
    with plots.figure(folder / f"{name}.png", 9.6, 4.6, 1, 2) as (drawn, grid):
        left, right = grid[0]
        for axes in (left, right):
            axes.grid(visible=False)
            axes.set(xlabel="x, east [m]", xlim=extent[:2], ylim=extent[2:], aspect="equal")
        left.set_ylabel("y, north [m]")
        draw_land(left, land, LAND, width=0.8)
        _draw_edges(left, coast, made.listed[number])
        if boundary is not None:
            _draw_cells(left, made.corner, rows[number], boundary * SIGMA_M)
        met, every = rows[number].edges, int((np.diff(coast.land.starts) - 1).sum())
        left.set_title(("No partition" if boundary is None else "Shaded cell") + f": {met} of {every} edges met")
        if boundary is None:
            image = right.imshow(made.water, origin="lower", extent=extent, cmap="gray", vmin=0, vmax=1)
            right.set_title(f"P(water) by the shortest distance, s = {SIGMA_M:g} m")
        else:
            image = right.imshow(made.error, origin="lower", extent=extent, cmap="RdBu", vmin=-most, vmax=most)
            draw_land(right, land, "none", "none", width=0.5)
            worst = max(row.greatest_error for row in rows)
            right.set_title(f"Error of P(water): {worst:.4f} at most")
        drawn.colorbar(image, ax=right, shrink=0.85)
        drawn.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)


def _draw_edges(axes: Axes, coast: Coast, begins: NDArray[np.int64]) -> None:
    from matplotlib.collections import LineCollection

    ends = np.stack([coast.land.vertices[begins], coast.land.vertices[begins + 1]], axis=1)
    axes.add_collection(LineCollection(list(ends), colors=plots.TRACKS[0], linewidths=2.0, zorder=4))
    axes.plot([], [], color=SHORE, linewidth=0.8, label="charted coast")
    axes.plot([], [], color=plots.TRACKS[0], linewidth=2.0, label="edges met")


def _draw_cells(axes: Axes, corner: Array, cell: CellRow, reach_m: float) -> None:
    from matplotlib.patches import Rectangle

    for n in range(CELLS + 1):
        axes.axvline(corner[0] + n * CELL_M, color=plots.MUTED, linewidth=0.7, zorder=2)
        axes.axhline(corner[1] + n * CELL_M, color=plots.MUTED, linewidth=0.7, zorder=2)
    at = corner + CELL_M * np.array([cell.column, cell.row])
    axes.add_patch(Rectangle((at[0], at[1]), CELL_M, CELL_M, fc=plots.TRACKS[1], alpha=0.25, zorder=3, label="a cell"))
    if reach_m:
        side, at = CELL_M + 2 * reach_m, at - reach_m
        border = Rectangle((at[0], at[1]), side, side, fc="none", ec=plots.TRACKS[1], ls=":", lw=1.6, zorder=3)
        border.set_label("its boundary, three deviations")
        axes.add_patch(border)
