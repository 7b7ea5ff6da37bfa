"""Compiled kernels of a covariance that depends on distance alone: its blocks by parity, and their sum over voxels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array

HALF = 0.5**0.5  # square root of the share that a voxel has of itself and its mirror image


@njit(cache=True, nogil=True)
def parity_block(table: Array, p: int, q: int) -> Array:
    """Return the covariance between images odd (1) or even (0) along y (p) and x (q), lower triangle.

    ``table`` is the covariance of two voxels by rows and columns between them.
    """
    rows, columns = table.shape
    height = rows // 2 if p else (rows + 1) // 2
    width = columns // 2 if q else (columns + 1) // 2
    signs = 1.0 - 2.0 * p, 1.0 - 2.0 * q
    block = np.zeros((height * width, height * width))
    for a in range(height):
        for b in range(width):
            own = (HALF if 2 * a == rows - 1 else 1.0) * (HALF if 2 * b == columns - 1 else 1.0)
            for c in range(a + 1):
                down, mirrored_down = a - c, rows - 1 - c - a
                middle = HALF if 2 * c == rows - 1 else 1.0
                for d in range(width if c < a else b + 1):
                    along, mirrored_along = abs(b - d), columns - 1 - d - b
                    value = table[down, along] + signs[0] * table[mirrored_down, along]
                    value += signs[1] * (table[down, mirrored_along] + signs[0] * table[mirrored_down, mirrored_along])
                    other = middle * (HALF if 2 * d == columns - 1 else 1.0)
                    block[a * width + b, c * width + d] = value * own * other
    return block


@njit(cache=True, nogil=True)
def add_parity_block(block: Array, shape: tuple[int, int], p: int, q: int, factor: float, target: NDArray[Any]) -> None:
    """Add what a block, given by its lower triangle, is between voxels to the lower triangle of ``target``."""
    rows, columns = shape
    width = columns // 2 if q else (columns + 1) // 2
    for i in range(len(block)):
        for j in range(i):
            block[j, i] = block[i, j]
    down, row_of = _shares(rows, p)
    along, column_of = _shares(columns, q)
    for r in range(rows):
        for c in range(columns):
            share = factor * down[r] * along[c]
            if share == 0.0:
                continue
            line = block[row_of[r] * width + column_of[c]]
            row = target[r * columns + c]
            for s in range(r + 1):
                part = share * down[s]
                if part == 0.0:
                    continue
                first = row_of[s] * width
                for t in range(columns if s < r else c + 1):
                    row[s * columns + t] += part * along[t] * line[first + column_of[t]]


@njit(cache=True, nogil=True)
def _shares(length: int, odd: int) -> tuple[Array, NDArray[np.int64]]:
    """Component of each voxel of a line in its image of one parity, and that image's number."""
    share, number = np.empty(length), np.zeros(length, dtype=np.int64)
    for k in range(length):
        mirrored = length - 1 - k
        if k == mirrored:
            share[k] = 0.0 if odd else 1.0
        else:
            share[k] = -HALF if odd and k > mirrored else HALF
        if k != mirrored or not odd:
            number[k] = min(k, mirrored)
    return share, number
