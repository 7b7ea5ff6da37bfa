"""Compiled kernels of births: the cells that newborns are drawn in, and the newborns in them."""

from __future__ import annotations

from typing import Any

import numpy as np

from elusive._kernels import exponentiate
from elusive._njit import njit
from elusive._random_kernels import fill_normal, fill_uniform
from elusive.contracts import Array, X, Y


@njit(cache=True, nogil=True, error_model="numpy")
def draw_cells(log_preference: Array, n: int, uniform_share: float, u0: float) -> tuple[np.ndarray, Array]:
    """Draw cells in proportion to ``exp(log_preference)`` mixed with uniform; also log of uniform over mixture.

    One systematic comb ``(u0 + j) / n`` over the mixture: unbiased, and with less spread than independent draws.
    """
    cells = len(log_preference)
    share = log_preference - log_preference.max()
    exponentiate(share)
    total = 0.0
    for i in range(cells):
        total += share[i]
    scale = (1.0 - uniform_share) / total
    floor = uniform_share / cells
    chosen = np.empty(n, dtype=np.int64)
    log_ratio = np.empty(n)
    i = 0
    reached = share[0] * scale + floor
    here = -np.log(reached * cells)
    for j in range(n):
        tooth = (u0 + j) / n
        if reached <= tooth and i < cells - 1:
            while reached <= tooth and i < cells - 1:
                i += 1
                reached += share[i] * scale + floor
            here = -np.log((share[i] * scale + floor) * cells)
        chosen[j] = i
        log_ratio[j] = here
    return chosen, log_ratio


@njit(cache=True, nogil=True)
def uniform_cells(draw: float, n: int, cells: int) -> np.ndarray:
    """Draw cells, all alike, ``(n,)``."""
    places = np.empty(n)
    fill_uniform(draw, places)
    chosen = np.empty(n, dtype=np.int64)
    for i in range(n):
        chosen[i] = int(places[i] * cells)
    return chosen


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def fill_newborns(states: Array, cells: np.ndarray, ranges: Any, draws: Array) -> None:
    """Fill components ``(d, n)``: each uniform in its range and Gaussian about that, x and y about their cell.

    The keys of the random numbers are the second and the third of ``draws``.
    """
    d, n = states.shape
    low, high, deviation = ranges.table
    numbers = np.empty(d * n)
    fill_uniform(draws[1], numbers)
    for k in range(d):
        width = high[k] - low[k]
        for i in range(n):
            states[k, i] = low[k] + width * numbers[k * n + i]
    if deviation.any():
        fill_normal(draws[2], numbers)
        for k in range(d):
            for i in range(n):
                states[k, i] += deviation[k] * numbers[k * n + i]
    for i in range(n):
        row = cells[i] // ranges.columns
        states[X, i] += (cells[i] - row * ranges.columns) * ranges.pitch[0]
        states[Y, i] += row * ranges.pitch[1]
