"""What the map of radio tomography shows: area, paths, nodes, ellipses, coverage."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.geometry.places import NamedPlace
from elusive.report import drawing as draw
from elusive.report.extents import Extent, about
from elusive.report.plots import SERIES
from elusive.sensors.radio_network import links_of
from elusive.systems.links.page.state import LinksState
from elusive.systems.links.scene import Coverage, LinkScene
from elusive.workbench.placing import path_layers, placing

ELLIPSES_MOST = 1200


def path_floor(state: LinksState, mode: str) -> draw.Drawing:
    """Return a map of the paths; ``mode``: view, path or area."""
    truth = state.truth
    paths = [] if truth is None else [truth[:, person] for person in range(truth.shape[1])]
    layers = [draw.area([state.scene.area.corners_m], fill="--ground", colour="--wall"), *path_layers(paths, SERIES)]
    return placing("Map of the area and the paths", _extent(state.scene), layers, mode=mode, ground="--shade")


def node_floor(state: LinksState, nodes: tuple[NamedPlace, ...], coverage: Coverage | None) -> draw.Drawing:
    """Return a map of the nodes."""
    scene = state.scene
    layers = [draw.area([scene.area.corners_m], fill="--ground", colour="--wall")]
    if coverage is not None:
        grid = scene.grid
        rows, columns = grid.shape
        links = np.where(grid.inside, coverage.links, 0.0).reshape(rows, columns)
        most = max(1.0, float(links.max()))
        seen: dict[str, Any] = {**draw.shares(np.where(links > 0, links / most, np.nan)), "high": most, "unit": "links"}
        edges = (grid.x0, grid.x0 + columns * grid.voxel_m, grid.y0, grid.y0 + rows * grid.voxel_m)
        within = [draw.rounded(np.ravel(scene.area.corners_m))]
        layers.append(draw.image(seen, edges, "heat", within=within))
    if state.shows_ellipses and len(nodes) > 1:
        found = _ellipses(np.array([(one.x_m, one.y_m) for one in nodes]), scene.simulation.weights.excess_m)
        layers.append(draw.ellipses(found, "--accent", alpha=0.18 if len(found) > 300 else 0.5))
    label = "Map of the sensors: arrow keys move a cross, Enter places a sensor"
    placed = [(one.name, one.x_m, one.y_m, one.name in state.selected) for one in nodes]
    return placing(label, _extent(scene), layers, mode="node", nodes=placed, ground="--shade")


def _extent(scene: LinkScene) -> Extent:
    x0, x1, y0, y1 = scene.area.bounds_m
    return about(
        [(x0, y0), (x1, y1), *((node.x_m, node.y_m) for node in getattr(scene.simulation.network, "places", ()))], 0.05
    )


def _ellipses(places: Array, excess_m: float) -> Array:
    """Return centre, half axes and angle of each link's ellipse; evenly chosen where there are very many."""
    links = links_of(len(places))
    links = links[:: max(1, math.ceil(len(links) / ELLIPSES_MOST))]
    first, second = places[links[:, 0]], places[links[:, 1]]
    apart = np.hypot(*(second - first).T)
    half = (apart + excess_m) / 2
    across = np.sqrt(np.maximum(half**2 - (apart / 2) ** 2, 0.0))
    angle = np.arctan2(*(second - first).T[::-1])
    return np.column_stack([(first + second) / 2, half, across, angle])
