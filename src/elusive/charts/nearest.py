"""P(water) from the shortest distance to the coast, with or without a partition of the map into cells.

Bootsveld (2012), section 6.1: Phi(D / s), D the distance to the nearest edge, negative on land; section 7.2: each cell
lists what is within three deviations of it, cut along that boundary.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import ndtr

from elusive.charts import _nearest_kernels as kernels
from elusive.charts._index_kernels import cells_at, inside
from elusive.charts.coast import Coast
from elusive.charts.index import EdgeIndex, index_edges
from elusive.charts.water import Water, WaterModel
from elusive.contracts import Array
from elusive.model import Positive


class NearestWater(WaterModel):
    """The nearest edge alone: in creeks and on corners and islands it errs, by up to a half."""

    kind: Literal["nearest"] = "nearest"
    boundary: Positive | None = Field(
        3.0,
        description="Width of the boundary round a cell: edges farther away count as infinitely far [deviations]; "
        "None: no cells, each position meets every edge",
    )

    def bind(self, coast: Coast) -> Water:
        """Partition the coast's edges."""
        return ShortestDistance(self, coast)


class ShortestDistance(Water):
    """Signed distance to one coast."""

    def __init__(self, model: NearestWater, coast: Coast) -> None:
        super().__init__(model, coast)
        west, south, east, north = coast.bounds
        # from beyond twice the extent nothing is near: the few cells list every edge
        everything = 2.0 * float(np.hypot(east - west, north - south))
        self._indices = []
        for number, sigma in enumerate(coast.sigma_m.tolist()):
            reach = model.boundary * sigma if model.boundary else everything + 10.0 * sigma
            self._indices.append(index_edges(coast.land, reach, within=coast.extent(number)))
        self._parts += [*self._indices, (coast.on_border,)]

    def fill(self, x: Array, y: Array, area: NDArray[np.int8], out: Array) -> None:
        """Set P(water) of the positions with an area."""
        for number, index in enumerate(self._indices):
            here = area == number
            if here.any():
                away = signed_distances(index, self.coast.on_border, x, y, here)
                out[here] = ndtr(away[here] / self.coast.sigma_m[number])


def signed_distances(
    index: EdgeIndex, on_border: NDArray[np.bool_], x: Array, y: Array, wanted: NDArray[np.bool_]
) -> Array:
    """Distance ``(N,)`` to the nearest edge that each position's cell lists [m]; negative on land.

    Infinite where a cell lists none, and where it is not wanted; ``on_border`` is :attr:`Coast.on_border`.
    """
    cells = cells_at(index, x, y)
    away = kernels.distances(index, cells, on_border, x, y, wanted)
    return np.where(inside(index, cells, x, y), -away, away)
