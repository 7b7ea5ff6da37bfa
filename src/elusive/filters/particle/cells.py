"""Survivors spread over what they stand for, cell by cell of place: what is apart stays apart.

West (1993), J. Roy. Stat. Soc. B 55(2), 409-422; :mod:`elusive.filters.particle._prediction_kernels`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array
from elusive.filters.particle._prediction_kernels import by_cell, predict
from elusive.filters.particle.births import Optics
from elusive.filters.particle.resampling import resample

SPREADS = 3.0  # of the point: side of the cells in which survivors are spread


def cell_side(within: float | None, sensor: Any) -> float:
    """Return the side of the cells: as told, or three point spreads of a sensor; 0 where it has none."""
    spread = float(getattr(sensor, "spread_px", 0.0)) * Optics.of(sensor).dx
    return SPREADS * spread if within is None else within


def spread(states: Array, weights: Array, side: float, rng: Generator) -> Array:
    """Draw as many states ``(N, d)``, each about one of those given; mean and covariance of each cell stay."""
    n, d = states.shape
    held, share, starts = by_cell(np.asfortranarray(states), weights, side)
    chosen = resample(share, n, rng)
    return np.asfortranarray(predict(held, share, starts, chosen, True, np.eye(d), np.zeros((d, d)), rng.random(), n))
