"""Exact P(water): the land mask convolved with a Gaussian, in closed form with Owen's T function.

The method the thesis of Bootsveld (2012) lacks: its section 6.1 takes the nearest edge alone, its 6.2 a discrete
convolution. Owen (1956): the mass of a Gaussian in a polygon is a sum over its edges.
"""

from __future__ import annotations

from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import spline_filter
from scipy.special import owens_t

from elusive.charts import _exact_kernels as kernels
from elusive.charts._index_kernels import cells_at
from elusive.charts.coast import Coast
from elusive.charts.index import EdgeIndex, index_edges
from elusive.charts.water import Water, WaterModel
from elusive.contracts import Array


class ExactWater(WaterModel):
    """Exact to 2e-8: a sum over the edges within six deviations."""

    kind: Literal["exact"] = "exact"

    def bind(self, coast: Coast) -> Water:
        """Index the edges of the coast."""
        return Exact(self, coast)


class Exact(Water):
    """Exact probability on one coast.

    Where charts end, land beyond is not known: the probability is that among the positions they cover, mass of the
    covered water over mass of what is covered. A coast that meets the border at right angles is then not bent by it.
    """

    def __init__(self, model: WaterModel, coast: Coast) -> None:
        super().__init__(model, coast)
        self.indices = [
            [index_edges(rings, kernels.REACH * sigma, within=coast.extent(k)) for rings in (coast.land, coast.border)]
            for k, sigma in enumerate(coast.sigma_m.tolist())
        ]
        self._parts += [index for pair in self.indices for index in pair]

    def fill(self, x: Array, y: Array, area: NDArray[np.int8], out: Array) -> None:
        """Set P(water) of the positions with an area."""
        for number, (land, border) in enumerate(self.indices):
            here = area == number
            if here.any():
                mass = self._mass(number, land, x, y, here)
                near = here & (mass > 0) if len(border.vertices) else np.zeros(len(x), dtype=bool)
                if near.any():
                    mass[near] /= np.maximum(self._mass(number, border, x, y, near)[near], 1e-9)
                out[here] = np.clip(1.0 - mass[here], 0.0, 1.0)

    def _mass(self, number: int, index: EdgeIndex, x: Array, y: Array, wanted: NDArray[np.bool_]) -> Array:
        per_sigma = 1.0 / float(self.coast.sigma_m[number])
        return kernels.masses(index, cells_at(index, x, y), triangle_table(), per_sigma, x, y, wanted)


@cache
def triangle_table() -> Array:
    """Spline coefficients of the Gaussian mass of a triangle (0, 0), (h, 0), (h, t), for h and t to the reach.

    It is atan(t/h)/2pi - T(h, t/h), entire and odd in both; good to 3e-9. ``(WIDTH**2,)``, row by row of h.
    """
    beyond = 20
    at = np.arange(-beyond, kernels.STEPS + beyond + 1) * (kernels.REACH / kernels.STEPS)
    h, t = np.meshgrid(np.abs(at), np.abs(at), indexing="ij")
    ratio = np.divide(t, h, out=np.full_like(h, np.inf), where=h > 0)
    mass = np.outer(np.sign(at), np.sign(at)) * (np.arctan2(t, h) / (2 * np.pi) - owens_t(h, ratio))
    used = slice(beyond - 1, beyond - 1 + kernels.WIDTH)
    return np.ascontiguousarray(spline_filter(mass, 3, output=np.float64, mode="reflect")[used, used]).ravel()
