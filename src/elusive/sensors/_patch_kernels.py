"""Compiled kernels of what targets add to the cells about them: separable patches, their moments, their likelihood."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._kernels import add_product
from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True, error_model="numpy")
def lay(
    x: Array, y: Array, amplitude: Array, pitch: tuple[float, float], psf: float, p: int, shape: tuple[int, int]
) -> tuple[NDArray[np.int64], Array]:
    """First row and column of each target's patch, ``(N, 2)``, and its values down and across, ``(N, 2, 2 p + 1)``.

    A cell holds the product of the two. A target whose patch misses the frame adds nothing, to a patch at its border.
    """
    n, width = len(x), 2 * p + 1
    corner = np.zeros((n, 2), dtype=np.int64)
    bells = np.zeros((n, 2, width))
    half = 0.5 / (psf * psf)
    for i in range(n):
        column, row = np.floor(x[i] / pitch[0] + 0.5), np.floor(y[i] / pitch[1] + 0.5)
        if not (-p <= column < shape[1] + p and -p <= row < shape[0] + p):
            corner[i, 0] = int(max(row, 0.0)) if row < shape[0] else shape[0] - 1
            corner[i, 1] = int(max(column, 0.0)) if column < shape[1] else shape[1] - 1
            continue
        corner[i, 0], corner[i, 1] = int(row) - p, int(column) - p
        for k in range(width):
            off_y, off_x = (row - p + k) * pitch[1] - y[i], (column - p + k) * pitch[0] - x[i]
            bells[i, 0, k] = amplitude[i] * np.exp(-half * off_y * off_y)
            bells[i, 1, k] = np.exp(-half * off_x * off_x)
    return corner, bells


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def moments(
    corner: NDArray[np.int64], bells: Array, weights: Array, first: tuple[int, int], mean: Array, square: Array
) -> None:
    """Add weighted patches, and their squares, to images whose first cell is ``first``."""
    width = bells.shape[2]
    for i in range(len(corner)):
        if weights[i] == 0.0:
            continue
        row, column = corner[i, 0] - first[0], corner[i, 1] - first[1]
        for k in range(width):
            height = bells[i, 0, k]
            one, two = weights[i] * height, weights[i] * height * height
            for m in range(width):
                across = bells[i, 1, m]
                mean[row + k, column + m] += one * across
                square[row + k, column + m] += two * across * across


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def log_ratio(corner: NDArray[np.int64], bells: Array, first: tuple[int, int], left: Array, precision: Array) -> Array:
    """Sum over each patch of ``h (z - h / 2) / v``; ``left`` holds z / v and ``precision`` 1 / v, 0 where masked."""
    width = bells.shape[2]
    ratio = np.empty(len(corner))
    for i in range(len(corner)):
        row, column = corner[i, 0] - first[0], corner[i, 1] - first[1]
        total = 0.0
        for k in range(width):
            height, cross, square = bells[i, 0, k], 0.0, 0.0
            for m in range(width):
                across = bells[i, 1, m]
                cross += across * left[row + k, column + m]
                square += across * across * precision[row + k, column + m]
            total += height * (cross - 0.5 * height * square)
        ratio[i] = total
    return ratio


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def overlap(
    corner: NDArray[np.int64],
    bells: Array,
    other_corner: NDArray[np.int64],
    other_bells: Array,
    first: tuple[int, int],
    precision: Array,
) -> Array:
    """Sum over the cells of ``h g / v`` of patches h and others g, ``(N, M)``; ``precision`` as in ``log_ratio``."""
    width, others = bells.shape[2], len(other_corner)
    # the others' values cell by cell of the rectangle, one beside the other: the inner loops run over them
    down, across = np.zeros((precision.shape[0], others)), np.zeros((precision.shape[1], others))
    for j in range(others):
        for k in range(width):
            row, column = other_corner[j, 0] + k - first[0], other_corner[j, 1] + k - first[1]
            if 0 <= row < len(down):
                down[row, j] = other_bells[j, 0, k]
            if 0 <= column < len(across):
                across[column, j] = other_bells[j, 1, k]
    found, along = np.zeros((len(corner), others)), np.empty(others)
    for i in range(len(corner)):
        total = found[i]
        for k in range(width):
            row = corner[i, 0] - first[0] + k
            along[:] = 0.0
            for m in range(width):
                column = corner[i, 1] - first[1] + m
                add_product(along, bells[i, 1, m] * precision[row, column], across[column])
            for j in range(others):
                total[j] += bells[i, 0, k] * down[row, j] * along[j]
    return found


@njit(cache=True, nogil=True, fastmath={"contract"})
def template_sums(left: Array, precision: Array, taps_x: Array, taps_y: Array) -> tuple[Array, Array]:
    """Sum ``g z / v`` and ``g^2 / v`` about each cell, g the product of the taps, by two 1-D passes."""
    rows, columns = left.shape
    p = len(taps_x) // 2
    cross, square = np.zeros((rows, columns)), np.zeros((rows, columns))
    first, second = np.empty(columns), np.empty(columns)
    for r in range(rows):
        first[:] = 0.0
        second[:] = 0.0
        for m in range(-min(p, columns - 1), min(p, columns - 1) + 1):
            tap = taps_x[m + p]
            reach = columns - abs(m)
            begin, source = max(0, -m), max(0, m)
            add_product(first[begin : begin + reach], tap, left[r, source : source + reach])
            add_product(second[begin : begin + reach], tap * tap, precision[r, source : source + reach])
        for k in range(max(-p, r - rows + 1), min(p, r) + 1):
            add_product(cross[r - k], taps_y[k + p], first)
            add_product(square[r - k], taps_y[k + p] * taps_y[k + p], second)
    return cross, square
