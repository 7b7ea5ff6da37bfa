"""P(water) from a bicubic B-spline over sparse tiles: the exact probability at a look-up's cost.

It takes the place of the grid of Bootsveld (2012), section 6.2, and its 90 million cells: knots stand only where the
coast is near. The spline (Unser, 1999) is of the root of P: where P is small its error is smaller still, so that a
position on land still knows the way out.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import ndtri

from elusive.charts import _field_kernels as kernels
from elusive.charts._index_kernels import TILE, cells_at, inside
from elusive.charts.coast import Coast
from elusive.charts.exact import Exact
from elusive.charts.index import EdgeIndex, index_edges
from elusive.charts.water import Water, WaterModel
from elusive.contracts import Array
from elusive.errors import DataError

STEP = 3.04  # of the knots at a tolerance of one, where that follows the fourth power of the step [deviations]
ATTEMPTS = 4
LEAST_SHRINK = 0.7  # of the step between two attempts
AT_ONCE = 4096  # tiles that are sampled in one go
PROBES = 20_000  # positions at which the spline is compared with the exact probability when it is made


class FieldWater(WaterModel):
    """Within a stated tolerance of the exact probability."""

    kind: Literal["field"] = "field"
    tolerance: float = Field(1e-3, ge=5e-4, le=0.05, description="Largest error of P")

    def bind(self, coast: Coast) -> Water:
        """Fit the spline."""
        return SplineField(self, coast)


class Spline(NamedTuple):
    """Coefficients of one area's spline, and the two levels that lead to them."""

    x0: float  # [m]
    y0: float
    per_step: float  # knots a metre
    blocks: NDArray[np.int32]  # number of a block of TILE x TILE tiles, or -1 water, -2 land
    codes: NDArray[np.int32]  # of each tile of the blocks: its number, or -1 water, -2 land
    coefficients: NDArray[np.int16]  # (tiles * SIDE * SIDE,)


class SplineField(Water):
    """The field on one coast, one spline for each area."""

    def __init__(self, model: FieldWater, coast: Coast) -> None:
        super().__init__(model, coast)
        self.tolerance = model.tolerance
        exact = Exact(model, coast)
        self.splines = [self._fitted(exact, number) for number in range(len(coast.sigma_m))]
        self._parts += self.splines

    def _fitted(self, exact: Exact, number: int) -> Spline:
        step = STEP * self.tolerance**0.25 * float(self.coast.sigma_m[number])
        for _ in range(ATTEMPTS):
            spline = self._spline(exact, number, step)
            error = self._error(exact, number, spline)
            if error <= 0.9 * self.tolerance:
                return spline
            step *= max(0.99 * (0.9 * self.tolerance / error) ** 0.25, LEAST_SHRINK)
        raise DataError(f"coast: its field errs by {error:.2g} however fine; take the exact method.")

    def _spline(self, exact: Exact, number: int, step_m: float) -> Spline:
        """Sample the exact probability near the coast, fit, and keep the tiles that are not all water or all land."""
        sigma = float(self.coast.sigma_m[number])
        least = min(self.floor, 0.2 * self.tolerance)  # of P that matters; of 1 - P too
        band = -float(ndtri(0.1 * least)) * sigma
        index = index_edges(self.coast.land, band, TILE * step_m, self.coast.extent(number))
        cells = np.flatnonzero(np.diff(index.first))
        block_row, block_column = (part[cells // TILE**2] for part in np.nonzero(index.tiles >= 0))
        tiles = np.column_stack(
            [block_row * TILE + cells % TILE**2 // TILE, block_column * TILE + cells % TILE]
        ).astype(np.int32)
        reached = self._reached(number, tiles, index, step_m)
        cells, tiles = cells[reached], np.ascontiguousarray(tiles[reached])
        codes = -1 - index.winding.astype(np.int32)
        codes[cells] = np.arange(len(cells))
        roots = self._roots(exact, number, tiles, (index.x0, index.y0), step_m)
        fitted = np.empty((len(cells), kernels.SIDE, kernels.SIDE), np.int16)
        kernels.fit(codes, index.tiles, tiles, roots, fitted)
        water = fitted.min(axis=(1, 2), initial=32767) >= (0.5 - 0.2 * self.tolerance) / kernels.QUANTUM
        firm = fitted.max(axis=(1, 2), initial=-32767) <= (np.sqrt(least) - 0.5) / kernels.QUANTUM
        kept = ~(water | firm)
        codes[cells] = np.where(kept, np.cumsum(kept) - 1, np.where(water, -1, -2))
        return Spline(index.x0, index.y0, 1.0 / step_m, index.tiles, codes, fitted[kept].ravel())

    def _roots(
        self, exact: Exact, number: int, tiles: NDArray[np.int32], corner: tuple[float, float], step_m: float
    ) -> NDArray[np.float32]:
        """Return the root of the exact probability at the TILE x TILE knots of each tile."""
        inner = np.indices((TILE, TILE)).reshape(2, -1).T
        roots = np.empty((len(tiles), TILE, TILE), np.float32)
        for first in range(0, len(tiles), AT_ONCE):
            some = tiles[first : first + AT_ONCE]
            knots = (some[:, None, :] * TILE + inner).reshape(-1, 2).astype(np.float64) * step_m
            values = np.empty(len(knots))
            exact.fill(corner[0] + knots[:, 1], corner[1] + knots[:, 0], np.full(len(knots), number, np.int8), values)
            roots[first : first + AT_ONCE] = np.sqrt(values).reshape(-1, TILE, TILE)
        return roots

    def _reached(self, number: int, tiles: NDArray[np.int32], index: EdgeIndex, step_m: float) -> NDArray[np.bool_]:
        """Tell which tiles a spline needs within the area: those in it, and those with knots just beyond it."""
        width = TILE * step_m
        middles = (tiles.astype(np.float64) + 0.5) * width
        x, y = index.x0 + middles[:, 1], index.y0 + middles[:, 0]
        reach = np.sqrt(2) * (0.5 * width + kernels.MARGIN * step_m)
        hidden = np.zeros(len(tiles), dtype=bool)
        for area, rings in enumerate(self.coast.areas):
            around = index_edges(rings, reach)
            cells = cells_at(around, x, y)
            within = inside(around, cells, x, y)
            if area == number:
                return within | (cells >= 0)
            hidden |= within & (cells < 0)
        return ~hidden

    def _error(self, exact: Exact, number: int, spline: Spline) -> float:
        """Largest error of P at random positions near the coast."""
        vertices, deviation = self.coast.land.vertices, 2.0 * float(self.coast.sigma_m[number])
        extent = self.coast.extent(number)
        if extent is not None:
            vertices = vertices[((vertices > extent[0] - deviation) & (vertices < extent[1] + deviation)).all(axis=1)]
        if not len(vertices):
            return 0.0
        rng = np.random.default_rng(0)
        points = vertices[rng.integers(len(vertices), size=PROBES)] + rng.normal(scale=deviation, size=(PROBES, 2))
        x, y = points[:, 0], points[:, 1]
        here = self.locate(x, y) == number
        area = np.where(here, number, -1).astype(np.int8)
        found = np.ones(len(x))
        kernels.read(spline, x, y, area, number, found)
        return float(np.abs(found - exact.probability(points))[here].max(initial=0.0))

    def fill(self, x: Array, y: Array, area: NDArray[np.int8], out: Array) -> None:
        """Set P(water) of the positions with an area."""
        for number, spline in enumerate(self.splines):
            kernels.read(spline, x, y, area, number, out)
