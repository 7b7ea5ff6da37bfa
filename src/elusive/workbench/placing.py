"""A map on which something is placed: nodes put and moved, paths and areas drawn, with the pointer or with keys."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.report import drawing as draw


def placing(
    label: str, extent: Sequence[float], layers: Iterable[draw.Layer | None] = (), *, mode: str = "view",
    nodes: Iterable[tuple[str, float, float, bool]] = (), step: float = 0.5, **panel: Any,
) -> draw.Drawing:  # fmt: skip
    """Return a map.

    Parameters
    ----------
    label
        For who does not see it.
    extent
        What is shown at first.
    layers
        What lies beneath.
    mode
        ``view``, ``node``, ``path`` or ``area``.
    nodes
        Name, x, y, and whether it is chosen.
    step
        Of an arrow key [m].
    """
    placed = [{"name": name, "x": x, "y": y, "selected": selected} for name, x, y, selected in nodes]
    shown: dict[str, Any] = {"span": 12, "label": label, **panel}
    shown["place"] = {"mode": mode, "step": step, "nodes": placed}
    return draw.drawing(label, [0.0], [draw.plane("Map", extent, layers, **shown)])


def path_layers(paths: Sequence[Array], colours: Sequence[str]) -> list[draw.Layer]:
    """Return paths ``(k, 2)`` with the number of each at its start; NaN breaks them."""
    layers: list[draw.Layer] = []
    for number, path in enumerate(paths):
        there = path[np.isfinite(path[:, 0])]
        if len(there):
            colour = colours[number % len(colours)]
            layers.append(draw.line(path[:, 0], path[:, 1], colour, width=2))
            layers.append(draw.points(there[:1], colour, size=4.5, texts=[f"{number + 1}"]))
    return layers
