"""P(water) of a chart taken as it is drawn: one at sea, nothing on land.

The hard constraint of Bootsveld (2012), section 4.1, his filter PF2: the chart's error is a Dirac delta.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from elusive.charts._index_kernels import cells_at, inside
from elusive.charts.coast import Coast
from elusive.charts.index import index_edges
from elusive.charts.water import Water, WaterModel
from elusive.contracts import Array


class HardWater(WaterModel):
    """Inside or outside the land as charted."""

    kind: Literal["hard"] = "hard"

    def bind(self, coast: Coast) -> Water:
        """Index the edges of the coast."""
        return Outline(self, coast)


class Outline(Water):
    """The land's outline on one coast."""

    def __init__(self, model: WaterModel, coast: Coast) -> None:
        super().__init__(model, coast)
        self._index = index_edges(coast.land, 0.0)
        self._parts.append(self._index)

    def fill(self, x: Array, y: Array, area: NDArray[np.int8], out: Array) -> None:
        """Set P(water) of the positions with an area."""
        known = area >= 0
        out[known] = ~inside(self._index, cells_at(self._index, x, y), x, y)[known]
