"""P(water) on a chart that stands off as a whole by an unknown bias, and what ships at sea tell of that bias.

Bootsveld (2012), section 2.1: a measurement is truth, systematic error and random error. The systematic one is the
same for every ship and at every time, so its density is kept once, on a grid (a point-mass filter: Bucy and Senne,
1971), and the particles carry nothing of it: carried by particles that are resampled for their places, a constant
is lost within some dozen steps.
"""

from __future__ import annotations

import copy
from typing import NamedTuple, Self

import numpy as np

from elusive.charts.coast import Coast
from elusive.charts.water import WaterModel
from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError

SIDE = 41  # of the grid
REACH = 3.5  # of the grid [deviations before anything is measured]
LEAST = 1e-12  # of a bias, beside the likeliest, below which it is given up
DRAWS, TURN = 55, 34  # biases that stand for the density, on a Fibonacci lattice: even along each axis
PLACES = 32  # of a ship's, that stand for its particles where the bias is learnt


class CoastBias(NamedTuple):
    """Estimate of how far the chart stands off, chart less truth, east and north."""

    mean_m: Array  # (2,)
    covariance_m2: Array  # (2, 2)


class BiasedWater:
    """Where water is likely while the chart's bias is being learnt; never changed, learning gives another one.

    Parameters
    ----------
    model
        How the probability of water is computed.
    coast
        Land and the imprecision that it has beside the bias.
    bias_sd_m
        Deviation of the bias on each axis before anything is measured [m].

    Raises
    ------
    ParameterError
        If the deviation is not positive and finite.
    """

    def __init__(self, model: WaterModel, coast: Coast, bias_sd_m: float) -> None:
        if not 0.0 < bias_sd_m < np.inf:
            raise ParameterError(f"bias_sd_m: must be positive and finite (got {bias_sd_m!r}).")
        self.water = model.bind(coast)
        self.coast, self.floor = coast, model.floor
        self.axis_m = np.linspace(-REACH, REACH, SIDE) * bias_sd_m
        one = np.exp(-0.5 * (self.axis_m / bias_sd_m) ** 2)
        self._counted = np.zeros((SIDE, SIDE))  # evidence against each bias that the error here is known to hold, log
        self._hold(np.outer(one, one))

    def _hold(self, density: Array) -> None:
        self.density = density / density.sum()  # (east, north)
        self._draws = _spread(self.density, self.axis_m)

    @property
    def nbytes(self) -> int:
        """Memory of the arrays that are read [bytes]."""
        return self.water.nbytes + int(self.density.nbytes + self._counted.nbytes)

    @property
    def bias(self) -> CoastBias:
        """Mean and covariance of the bias, the width of the grid's cells among them."""
        cells = np.stack(np.meshgrid(self.axis_m, self.axis_m, indexing="ij"), axis=-1).reshape(-1, 2)
        weight = self.density.ravel()
        mean = weight @ cells
        width = self.axis_m[1] - self.axis_m[0]
        return CoastBias(mean, (cells - mean).T @ (weight[:, None] * (cells - mean)) + np.eye(2) * width**2 / 12)

    def log_probability(self, states: Array) -> Array:
        """Log P(water) of ``(N, d)`` states [m], averaged over the bias, ``(N,)``."""
        return np.asarray(np.log(self._given(states[:, X], states[:, Y], self._draws).mean(axis=1)))

    def learn(self, particles: Array, weights: Array, kept: float = 0.0) -> Self:
        """Return what is known after a ship was at sea.

        Parameters
        ----------
        particles, weights
            ``(N, d)`` and ``(N,)``, after a step of the filter that had this knowledge.
        kept
            Correlation of the coast's own error here with that where a ship was last: evidence against a bias counts
            as far as it is stronger than what remains of the evidence before. At rest the same counts once.

        Raises
        ------
        ParameterError
            If the correlation is not between 0 and 1.
        """
        if not 0.0 <= kept <= 1.0:
            raise ParameterError(f"kept: must lie between 0 and 1 (got {kept!r}).")
        even = (np.arange(PLACES) + 0.5) / PLACES
        places = particles[np.minimum(np.searchsorted(np.cumsum(weights), even), len(weights) - 1)]
        east, north = np.nonzero(self.density > LEAST * self.density.max())
        before = self.density[east, north]
        water = self._given(places[:, X], places[:, Y], np.column_stack([self.axis_m[east], self.axis_m[north]]))
        # the map has weighted the particles in this step already: that is taken off them
        unweighted = 1.0 / (water @ before)
        remembered = kept * self._counted[east, north]
        counted = np.minimum(np.log(unweighted @ water / unweighted.sum()), remembered)
        learnt, density = copy.copy(self), np.zeros_like(self.density)
        gained = counted - remembered
        density[east, north] = before * np.exp(gained - gained.max())
        learnt._counted = np.zeros_like(density)
        learnt._counted[east, north] = counted
        learnt._hold(density)
        return learnt

    def _given(self, x: Array, y: Array, biases: Array) -> Array:
        """P(water) at N positions for each of B biases, ``(N, B)``, not below the floor."""
        moved_x, moved_y = (np.add.outer(at, off).ravel() for at, off in zip((x, y), biases.T, strict=True))
        found = np.full(len(moved_x), self.water.unknown)
        self.water.fill(moved_x, moved_y, self.water.locate(moved_x, moved_y), found)
        return np.asarray(self.floor + (1.0 - self.floor) * found).reshape(len(x), -1)


def _spread(density: Array, axis_m: Array) -> Array:
    """Spread draws evenly over a density on a grid, east first, then north given east, ``(DRAWS, 2)``."""
    width = axis_m[1] - axis_m[0]
    even = (np.outer(np.arange(DRAWS), [1, TURN]) % DRAWS + 0.5) / DRAWS
    column, east = _quantiles(density.sum(axis=1)[None], even[:, 0])
    _, north = _quantiles(density[column], even[:, 1])
    return np.asarray(axis_m[0] + width * (np.column_stack([east, north]) - 0.5))


def _quantiles(densities: Array, at: Array) -> tuple[Array, Array]:
    """Return cell and place, in cells from the first's edge, of quantiles of densities, ``(1 or D, cells)``."""
    total = np.cumsum(densities, axis=1)
    wanted = at * total[:, -1]
    cell = (total[:, :-1] <= wanted[:, None]).sum(axis=1)
    row = np.arange(len(cell)) % len(densities)
    return cell, cell + 1.0 - (total[row, cell] - wanted) / densities[row, cell]
