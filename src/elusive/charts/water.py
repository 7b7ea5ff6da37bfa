"""P(position is water) near an imprecise coast: the contract that every method keeps.

Bootsveld (2012), eq. 4.9: the filter multiplies a particle's weight by Phi, the probability that it satisfies the
constraint. Here the land of the chart, moved by a Gaussian error, covers the position or not.
"""

from __future__ import annotations

import abc
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from elusive.charts._index_kernels import cells_at, inside
from elusive.charts.coast import Coast
from elusive.charts.index import index_edges
from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.model import Model


class WaterModel(Model, abc.ABC):
    """How the probability of water is computed; :meth:`bind` prepares it for one coast."""

    floor: float = Field(
        1e-6,
        gt=0,
        lt=0.1,
        description="Probability that the chart is wrong altogether: log P is the logarithm of floor + (1 - floor) P",
    )
    unknown: float = Field(
        1.0,
        gt=0,
        le=1,
        description="P taken where no chart says anything; 1 is no evidence either way, as open water is none",
    )

    @abc.abstractmethod
    def bind(self, coast: Coast) -> Water:
        """Prepare for a coast: indices, grids or splines are made once, here."""


class Water(abc.ABC):
    """Where water is likely on one coast: a piece of knowledge for any filter.

    Parameters
    ----------
    model
        The method and its parameters.
    coast
        Land, imprecision and what the charts cover.
    """

    def __init__(self, model: WaterModel, coast: Coast) -> None:
        self.coast = coast
        self.floor, self.unknown = model.floor, model.unknown
        self._areas = [index_edges(rings, 0.0) for rings in coast.areas]
        self._parts: list[tuple[Any, ...]] = [*self._areas]

    @property
    def nbytes(self) -> int:
        """Memory of the arrays that the method reads, the coast's own too [bytes]."""
        arrays = [array for part in self._parts for array in part if isinstance(array, np.ndarray)]
        return sum({id(array): array.nbytes for array in arrays}.values())

    def area(self, points: ArrayLike) -> NDArray[np.int8]:
        """Return the number of the chart whose area each of ``(N, 2)`` points [m] lies in, finest first; -1: none's."""
        x, y = _columns(points)
        return self.locate(x, y)

    def known(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether any chart covers each of ``(N, 2)`` points [m]: elsewhere nothing is known, not even water."""
        return self.area(points) >= 0

    def probability(self, points: ArrayLike) -> Array:
        """P(water) at each of ``(N, 2)`` points [m], ``(N,)``; ``unknown`` where no chart covers them.

        Raises
        ------
        DataError
            If the points are not ``(N, 2)`` or not finite.
        """
        x, y = _columns(points)
        out = np.full(len(x), self.unknown)
        self.fill(x, y, self.locate(x, y), out)
        return out

    def log_probability(self, states: Array) -> Array:
        """Log P(water) of ``(N, d)`` states x, vx, y, vy, ... [m], ``(N,)``, never below the logarithm of the floor."""
        x, y = states[:, X], states[:, Y]
        out = np.full(len(x), self.unknown)
        self.fill(x, y, self.locate(x, y), out)
        out *= 1.0 - self.floor
        out += self.floor
        return np.asarray(np.log(out, out=out))

    def locate(self, x: Array, y: Array) -> NDArray[np.int8]:
        """Return the number of the area of each position [m] as :meth:`area` does, without a look at the input."""
        area = np.full(len(x), len(self._areas) if self.coast.everywhere else -1, np.int8)
        left = np.arange(len(x))  # areas do not overlap: what is in one need not be looked for in others
        for number, index in enumerate(self._areas):
            here = inside(index, cells_at(index, x, y), x, y)
            if here.any():
                area[left[here]] = number
                left, x, y = left[~here], x[~here], y[~here]
                if not len(left):
                    break
        return area

    @abc.abstractmethod
    def fill(self, x: Array, y: Array, area: NDArray[np.int8], out: Array) -> None:
        """Set P(water) of the positions with an area; leave the others."""


def _columns(points: ArrayLike) -> tuple[Array, Array]:
    table = np.asarray(points, dtype=np.float64)
    if table.ndim != 2 or table.shape[1] != 2:
        raise DataError(f"points: must be (N, 2), x and y in metres (got shape {table.shape}).")
    if not np.isfinite(table).all():
        row = int(np.flatnonzero(~np.isfinite(table).all(axis=1))[0])
        raise DataError(f"points, row {row}: is not finite; leave it out.")
    return table[:, 0], table[:, 1]
