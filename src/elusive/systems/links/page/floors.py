"""What the map of radio tomography shows: area, paths, nodes, ellipses, coverage."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.geometry.places import NamedPlace
from elusive.sensors.radio_network import links_of
from elusive.systems.links.page.state import LinksState
from elusive.systems.links.scene import Coverage, LinkScene

ELLIPSES_MOST = 1200


def path_floor(state: LinksState, mode: str) -> dict[str, Any]:
    """Return a map of the paths; ``mode``: view, path or area."""
    paths: list[Any] = []
    if state.truth is not None:
        rounded = np.round(state.truth, 3)
        paths = [
            [None if np.isnan(x) else [x, y] for x, y in rounded[:, person].tolist()]
            for person in range(rounded.shape[1])
        ]
    return _ground(state.scene, "Map of the area and the paths") | {"mode": mode, "paths": paths}


def node_floor(state: LinksState, nodes: tuple[NamedPlace, ...], coverage: Coverage | None) -> dict[str, Any]:
    """Return a map of the nodes."""
    scene = state.scene
    spec = _ground(scene, "Map of the sensors: arrow keys move a cross, Enter places a sensor") | {
        "mode": "node",
        "nodes": [
            {"name": one.name, "x": one.x_m, "y": one.y_m, "selected": one.name in state.selected} for one in nodes
        ],
    }
    if state.shows_ellipses and len(nodes) > 1:
        places = np.array([(one.x_m, one.y_m) for one in nodes])
        spec["ellipses"] = _ellipses(places, scene.simulation.weights.excess_m)
    if coverage is not None:
        grid = scene.grid
        values = np.where(grid.inside, coverage.links, -1).astype(int)
        rows, columns = grid.shape
        spec["heat"] = {
            "rows": rows, "columns": columns, "most": max(1, int(values.max())), "values": values.tolist(),
            "x0": grid.x0, "y0": grid.y0, "voxel": grid.voxel_m,
        }  # fmt: skip
    return spec


def _ground(scene: LinkScene, label: str) -> dict[str, Any]:
    x0, x1, y0, y1 = scene.area.bounds_m
    for node in getattr(scene.simulation.network, "places", ()):
        x0, x1, y0, y1 = min(x0, node.x_m), max(x1, node.x_m), min(y0, node.y_m), max(y1, node.y_m)
    margin = 0.05 * max(x1 - x0, y1 - y0)
    return {
        "label": label,
        "extent": [x0 - margin, x1 + margin, y0 - margin, y1 + margin],
        "corners": [list(corner) for corner in scene.area.corners_m],
    }


def _ellipses(places: Array, excess_m: float) -> list[list[float]]:
    """Return centre, half axes and angle of each link's ellipse; evenly chosen where there are very many."""
    links = links_of(len(places))
    links = links[:: max(1, math.ceil(len(links) / ELLIPSES_MOST))]
    first, second = places[links[:, 0]], places[links[:, 1]]
    apart = np.hypot(*(second - first).T)
    half = (apart + excess_m) / 2
    across = np.sqrt(np.maximum(half**2 - (apart / 2) ** 2, 0.0))
    angle = np.arctan2(*(second - first).T[::-1])
    table = np.column_stack([(first + second) / 2, half, across, angle])
    rounded: list[list[float]] = np.round(table, 4).tolist()
    return rounded
