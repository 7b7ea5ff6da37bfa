"""How well a radio network sees an area: the number of links through each voxel, as a table and a map.

Mendieta (2017), section 3.4, figures 3.9 and 3.10; table 3.3.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from elusive.io.csv_files import write_csv
from elusive.preprocess.link_weights import coverage
from elusive.preprocess.voxels import VoxelGrid
from elusive.report import plots
from elusive.sensors.radio_network import RadioNodes

COLUMNS = ("x_m", "y_m", "links", "weight")
NAMED_AT_MOST = 60  # nodes


def write_coverage(folder: Path, nodes: RadioNodes, grid: VoxelGrid, weights: Any) -> str:
    """Write ``coverage.csv``, a row a voxel of the area, and ``coverage.png``; return what they show in words.

    Parameters
    ----------
    folder
        Where to.
    nodes, grid
        The network and the voxels.
    weights
        ``(L, V)`` weights, an array or sparse.

    Returns
    -------
    str
        Least, median and greatest number of links through a voxel of the area, and how many have none.
    """
    links = coverage(weights)
    total = np.asarray(weights.sum(axis=0)).ravel()
    inside = grid.inside
    seen_by = zip(grid.centres[inside], links[inside], total[inside], strict=True)
    rows = ((f"{x:.10g}", f"{y:.10g}", count, f"{weight:.6g}") for (x, y), count, weight in seen_by)
    write_csv(folder / "coverage.csv", COLUMNS, rows)
    _draw(folder / "coverage.png", nodes, grid, np.where(inside, links, np.nan))
    seen = links[inside]
    words = f"{seen.min()} to {seen.max()} links a voxel, {np.median(seen):g} at the median"
    blind = int((seen == 0).sum())
    return f"{words}; {blind} of {len(seen)} voxels see none" if blind else words


def _draw(path: Path, nodes: RadioNodes, grid: VoxelGrid, links: Any) -> None:
    x, y = nodes.positions_m.T
    west, east = min(grid.x0, x.min()), max(grid.x1, x.max())
    south, north = min(grid.y0, y.min()), max(grid.y1, y.max())
    margin = 0.05 * max(east - west, north - south)
    rows, columns = grid.shape
    edges = (grid.x0, grid.x0 + columns * grid.voxel_m, grid.y0, grid.y0 + rows * grid.voxel_m)
    height = 6.0 * (north - south + 2 * margin) / (east - west + 2 * margin) + 0.6
    with plots.figure(path, 7.2, min(max(height, 2.5), 12.0)) as (drawn, ((axes,),)):
        image = axes.imshow(
            links.reshape(grid.shape), origin="lower", extent=edges, cmap="Blues", vmin=0, interpolation="nearest"
        )
        axes.plot(x, y, "s", color="#334155", markersize=4.5, clip_on=False)
        if len(nodes.names) <= NAMED_AT_MOST:
            middle = np.array([west + east, south + north]) / 2
            for name, place in zip(nodes.names, nodes.positions_m, strict=True):
                away = place - middle
                offset = 9 * away / max(float(np.hypot(*away)), 1e-9)  # outwards, off the map
                axes.annotate(
                    name, tuple(place), tuple(offset), textcoords="offset points", color=plots.MUTED, size=7,
                    ha="center", va="center", clip_on=False,
                )  # fmt: skip
        axes.set(
            title="Links through each voxel", xlabel="x [m]", ylabel="y [m]", aspect="equal",
            xlim=(west - margin, east + margin), ylim=(south - margin, north + margin),
        )  # fmt: skip
        axes.grid(visible=False)
        drawn.colorbar(image, ax=axes, shrink=0.8)
