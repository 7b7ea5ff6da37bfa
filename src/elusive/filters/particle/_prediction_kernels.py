"""Compiled kernels of a linear prediction that spreads survivors over what they stand for, cell by cell of place.

West (1993), J. Roy. Stat. Soc. B 55(2), and Liu and West (2001), in Sequential Monte Carlo methods in practice, ch. 10:
each survivor is drawn towards its cloud's mean and given a part of the cloud's covariance, so that mean and covariance
stay. Here a cloud is what lies in one cell, wherefore those of the whole stay too, and what is apart stays apart. The
bandwidth is that of Silverman (1986), section 4.3, for the cloud's effective number.
"""

from __future__ import annotations

import numpy as np

from elusive._kernels import BLOCK, add_product, copy_rows
from elusive._njit import njit
from elusive._random_kernels import fill_normal
from elusive.contracts import Array, X, Y
from elusive.filters.particle._kernels import gather, moments_between, total_of, total_product

MOST_CELLS = 1 << 20
LEAST_EFFECTIVE = 1.5  # particles that a cloud takes
LEAST_CHILDREN = 8  # of a cell: fewer are hardly ever of one parent
LEAST_PIVOT = 1e-8  # of a variance, under which a component follows from those before


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"nnan", "nsz", "reassoc"})
def _extent(row: Array, weights: Array) -> tuple[float, float]:
    """Least and greatest value of those with weight; none is NaN."""
    low, high = np.inf, -np.inf
    for i in range(len(row)):
        low = min(low, row[i] if weights[i] > 0.0 else np.inf)
        high = max(high, row[i] if weights[i] > 0.0 else -np.inf)
    return low, high


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc"})
def _sum(row: Array, other: Array) -> float:
    """Sum of both rows, not finite where a value is not."""
    total = 0.0
    for i in range(len(row)):
        total += row[i] + other[i]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _cells(states: Array, weights: Array, side: float) -> tuple[np.ndarray, int]:
    """Each particle's cell, one more for those without weight, and how many there are of the first."""
    along_x, along_y, n = states.T[X], states.T[Y], len(weights)
    cell = np.empty(n, dtype=np.int64)
    if not np.isfinite(_sum(along_x, along_y)):
        for i in range(n):
            cell[i] = 0 if weights[i] > 0.0 else 1
        return cell, 1
    (left, right), (bottom, top) = _extent(along_x, weights), _extent(along_y, weights)
    while ((right - left) / side + 2.0) * ((top - bottom) / side + 2.0) > MOST_CELLS:
        side *= 2.0
    per_side = 1.0 / side
    left, bottom = np.floor(left * per_side), np.floor(bottom * per_side)
    across = int(np.floor(right * per_side) - left) + 1
    cells = across * (int(np.floor(top * per_side) - bottom) + 1)
    for i in range(n):
        column, row = np.floor(along_x[i] * per_side) - left, np.floor(along_y[i] * per_side) - bottom
        cell[i] = int(row * across + column) if weights[i] > 0.0 else cells
    return cell, cells


@njit(cache=True, nogil=True)
def by_cell(states: Array, weights: Array, side: float) -> tuple[Array, Array, np.ndarray]:
    """Particles with weight, sorted by their cells of that side; their weights; where each cell begins, the end last.

    Where a place is not finite, all are in one cell.
    """
    cell, cells = _cells(states, weights, side)
    n = len(cell)
    begin = np.zeros(cells + 2, dtype=np.int64)
    # neighbours are mostly of one cell: what is counted leaves the registers at its end alone
    here, counted = cell[0], 0
    for i in range(n):
        if cell[i] != here:
            begin[here + 1] += counted
            here, counted = cell[i], 0
        counted += 1
    begin[here + 1] += counted
    starts = np.empty(min(cells, n) + 1, dtype=np.int64)
    occupied = 0
    for k in range(cells):
        if begin[k + 1] > 0:
            starts[occupied] = begin[k]
            occupied += 1
        begin[k + 1] += begin[k]
    starts[occupied] = begin[cells]
    order = np.empty(n, dtype=np.int64)
    here, place = cell[0], begin[cell[0]]
    for i in range(n):
        if cell[i] != here:
            begin[here] = place
            here, place = cell[i], begin[cell[i]]
        order[place] = i
        place += 1
    order = order[: starts[occupied]]
    share = np.empty(len(order))
    for i in range(len(order)):
        share[i] = weights[np.uintp(order[i])]
    return gather(states, order, len(order)), share, starts[: occupied + 1]


@njit(cache=True, nogil=True, error_model="numpy")
def _root(covariance: Array) -> None:
    """Lower-triangular root in place; a component that follows from those before gets nothing of its own."""
    d = len(covariance)
    for k in range(d):
        variance = covariance[k, k]
        for c in range(k + 1):
            total = covariance[k, c]
            for m in range(c):
                total -= covariance[k, m] * covariance[c, m]
            if c == k:
                covariance[k, k] = np.sqrt(total) if total > LEAST_PIVOT * variance else 0.0
            else:
                covariance[k, c] = total / covariance[c, c] if covariance[c, c] > 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _smoothed(
    columns: Array,
    weights: Array,
    first: int,
    last: int,
    F: Array,
    root: Array,
    A: Array,
    shift: Array,
    spread: Array,
) -> None:
    """Write A, shift and spread: ``A s + shift + spread n`` moves particles first to last and keeps their moments."""
    d = len(F)
    share = weights[first:last]
    total = total_of(share)
    share = share / total
    effective = 1.0 / total_product(share, share)
    if effective < LEAST_EFFECTIVE:
        return
    bandwidth2 = (4.0 / ((d + 2) * effective)) ** (2.0 / (d + 4))
    mean, covariance = moments_between(columns, share, first)
    kept = np.sqrt(1.0 - bandwidth2)
    # beside the bandwidth, what a sample lacks of its population's covariance
    given = bandwidth2 + 1.0 / (effective - 1.0)
    for r in range(d):
        shift[r] = 0.0
        for c in range(d):
            A[r, c] = kept * F[r, c]
            shift[r] += (1.0 - kept) * F[r, c] * mean[c]
    for r in range(d):
        for c in range(r + 1):
            total = 0.0
            for k in range(d):
                total += root[r, k] * root[c, k]
                if F[r, k] != 0.0:
                    for m in range(d):
                        total += given * F[r, k] * covariance[k, m] * F[c, m]
            spread[r, c] = total
    _root(spread)


@njit(cache=True, nogil=True, error_model="numpy")
def predict(
    states: Array,
    weights: Array,
    starts: np.ndarray,
    chosen: np.ndarray,
    smooth: bool,
    F: Array,
    root: Array,
    draw: float,
    total: int,
) -> Array:
    """Move chosen rows of states sorted by cell by ``F s + v``, v of covariance ``root root'``; ``chosen`` ascends.

    Returns ``total`` rows, column by column in memory; those beyond the chosen ones are not set.
    """
    n, d = len(chosen), states.shape[1]
    columns, moved = states.T, np.empty((d, total))
    noise = np.empty(d * n)
    fill_normal(draw, noise)
    A, shift, spread = F.copy(), np.zeros(d), root.copy()
    kept = np.empty((d, BLOCK))
    begin = cell = 0
    while begin < n:
        while starts[cell + 1] <= chosen[begin]:
            cell += 1
        end = begin + 1
        while end < n and chosen[end] < starts[cell + 1]:
            end += 1
        if smooth:
            copy_rows(A, F)
            copy_rows(spread, root)
            shift[:] = 0.0
        if smooth and end - begin >= LEAST_CHILDREN:
            _smoothed(columns, weights, starts[cell], starts[cell + 1], F, root, A, shift, spread)
        for first in range(begin, end, BLOCK):
            size = min(BLOCK, end - first)
            for c in range(d):
                source, row = columns[c], kept[c]
                for i in range(size):
                    row[i] = source[np.uintp(chosen[first + i])]
            for r in range(d):
                row = moved[r, first : first + size]
                row[:] = shift[r]
                for c in range(d):
                    add_product(row, A[r, c], kept[c, :size])
                    add_product(row, spread[r, c], noise[c * n + first : c * n + first + size])
        begin = end
    return moved.T
