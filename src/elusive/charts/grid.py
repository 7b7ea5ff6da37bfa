"""P(water) from a grid: the land mask of the cells' middles, convolved with a sampled Gaussian.

Bootsveld (2012), section 6.2, his filter PF4. Its memory grows with the map's area, whatever the coast.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.ndimage import correlate1d

from elusive.charts import _grid_kernels as kernels
from elusive.charts._index_kernels import cells_at, inside
from elusive.charts.coast import Coast
from elusive.charts.index import EdgeIndex, index_edges
from elusive.charts.water import Water, WaterModel
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Positive

REACH = 6.0  # of the sampled Gaussian [deviations]


class GridWater(WaterModel):
    """A regular grid over all of the map."""

    kind: Literal["grid"] = "grid"
    cell: Positive = Field(0.2, le=2, description="Width of a cell, D [deviations]")
    look_up: Literal["bilinear", "nearest"] = Field("bilinear", description="Between the cells, or the nearest cell's")
    most_cells: int = Field(200_000_000, gt=0, description="A map that needs more is refused")

    def bind(self, coast: Coast) -> Water:
        """Fill the grid."""
        return Convolved(self, coast)


class Raster(NamedTuple):
    """P(water) over one area."""

    x0: float  # middle of the first cell [m]
    y0: float
    width_m: float
    values: NDArray[np.float32]  # (rows, columns)


class Convolved(Water):
    """The grids on one coast, one for each area.

    Near the charts' border the convolution is over what they cover.
    """

    def __init__(self, model: GridWater, coast: Coast) -> None:
        super().__init__(model, coast)
        self._bilinear = model.look_up == "bilinear"
        land, border = index_edges(coast.land, 0.0), index_edges(coast.border, 0.0)
        self._rasters = [self._raster(model, number, land, border) for number in range(len(coast.sigma_m))]
        self._parts += self._rasters

    def fill(self, x: Array, y: Array, area: NDArray[np.int8], out: Array) -> None:
        """Set P(water) of the positions with an area."""
        for number, (x0, y0, width, values) in enumerate(self._rasters):
            kernels.read(values, x0, y0, 1.0 / width, self._bilinear, x, y, area, number, out)

    def _raster(self, model: GridWater, number: int, land: EdgeIndex, border: EdgeIndex) -> Raster:
        sigma = float(self.coast.sigma_m[number])
        width, radius = model.cell * sigma, round(REACH / model.cell)
        area = self.coast.areas[number] if number < len(self.coast.areas) else self.coast.land
        corners = area.vertices if len(area.vertices) else np.zeros((1, 2))
        low = corners.min(axis=0) - (radius + 0.5) * width
        columns, rows = (np.ceil((corners.max(axis=0) - low) / width).astype(int) + radius + 1).tolist()
        if rows * columns > model.most_cells:
            raise DataError(
                f"grid: the map takes {rows} x {columns} cells of {width:g} m, {4e-9 * rows * columns:.1f} GB; take "
                "wider cells, a smaller chart or the field."
            )
        x0, y0 = (low + 0.5 * width).tolist()
        masses = [_mask(index, x0, y0, width, (rows, columns)) for index in (land, border) if len(index.vertices)]
        at = np.arange(-radius, radius + 1) * model.cell
        weights = np.exp(-0.5 * at**2)
        for mask in masses:
            for axis in (0, 1):
                correlate1d(mask, weights / weights.sum(), axis, output=mask, mode="nearest")
        if not len(land.vertices):
            return Raster(x0, y0, width, np.ones((2, 2), np.float32))
        covered = np.maximum(masses[1], np.float32(1e-6)) if len(masses) > 1 else np.float32(1.0)
        return Raster(x0, y0, width, np.clip(1.0 - masses[0] / covered, 0.0, 1.0, dtype=np.float32))


def _mask(index: EdgeIndex, x0: float, y0: float, width: float, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Tell by one or zero which cells' middles lie within the rings."""
    mask = np.empty(shape, np.float32)
    x = x0 + width * np.arange(shape[1], dtype=np.float64)
    for row in range(shape[0]):
        y = np.full(shape[1], y0 + row * width, np.float64)
        mask[row] = inside(index, cells_at(index, x, y), x, y)
    return mask
