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
from elusive.report import drawing as draw
from elusive.report.extents import about
from elusive.report.picture import write_picture
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
    rows, columns = grid.shape
    most = max(1.0, float(np.nanmax(links)))
    edges = (grid.x0, grid.x0 + columns * grid.voxel_m, grid.y0, grid.y0 + rows * grid.voxel_m)
    seen: Any = {**draw.shares((links / most).reshape(grid.shape)), "high": most, "unit": "links"}
    names = {"texts": list(nodes.names)} if len(nodes.names) <= NAMED_AT_MOST else {}
    layers = [
        draw.image(seen, edges, "glow"),
        draw.points(nodes.positions_m, "--wall", marker="square", size=3.5, name="node", **names),
    ]
    extent = about([edges[::2], edges[1::2], *nodes.positions_m])
    write_picture(path, draw.drawing("", [0.0], [draw.plane("", extent, layers)]), "Links through each voxel")
