"""Compiled kernels of the searches over a whole stack of evidence; both see ``(T, rows, columns)``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._kernels import copy_row
from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True)
def straight_maximum(evidence: Array, back: NDArray[np.int64], circular: bool) -> tuple[Array, NDArray[np.int32]]:
    """Largest sum along a straight trajectory into each cell of the last frame, and the velocity that has it.

    ``back (V, T, 2)`` is how many rows and columns velocity v moves from each frame to the last. Beyond the border
    there is no evidence, unless the frame is circular.
    """
    frames, rows, columns = evidence.shape
    best = np.full((rows, columns), -np.inf)
    velocity = np.zeros((rows, columns), dtype=np.int32)
    total = np.empty((rows, columns))
    for v in range(len(back)):
        total[:] = 0.0
        for k in range(frames):
            down, right = back[v, k]
            if circular:
                down, right = down % rows, right % columns
            for r in range(rows):
                source = r - down
                if circular:
                    source = source % rows
                elif source < 0 or source >= rows:
                    continue
                line = evidence[k, source]
                for c in range(max(right, 0), min(columns, columns + right)):
                    total[r, c] += line[c - right]
                if circular:
                    for c in range(right):
                        total[r, c] += line[c - right + columns]
        for r in range(rows):
            for c in range(columns):
                if total[r, c] > best[r, c]:
                    best[r, c] = total[r, c]
                    velocity[r, c] = v
    return best, velocity


@njit(cache=True, nogil=True)
def best_moves(
    evidence: Array, down_most: int, right_most: int, circular: bool, moves: NDArray[np.uint8] | NDArray[np.uint16]
) -> Array:
    """Score of the best path into each cell of the last frame; ``moves (T - 1, rows, columns)`` gets the way back.

    Moves are numbered with the one along columns running fastest, the most negative first. The maximum over the box
    is taken along columns, then along rows; of equal ones the smaller move is taken.
    """
    frames, rows, columns = evidence.shape
    side = 2 * right_most + 1
    score: Array = evidence[0].copy()
    along = np.empty((rows, columns))
    right = np.empty((rows, columns), dtype=np.int64)
    for k in range(1, frames):
        _best_shift(score, along, right, right_most, circular)
        for r in range(rows):
            for c in range(columns):
                score[r, c] = along[r, c]
                moves[k - 1, r, c] = down_most * side + right_most + right[r, c]
            for i in range(1, 2 * down_most + 1):
                down = _nearest(i)
                source = r - down
                if circular:
                    source = source % rows
                elif source < 0 or source >= rows:
                    continue
                for c in range(columns):
                    if along[source, c] > score[r, c]:
                        score[r, c] = along[source, c]
                        moves[k - 1, r, c] = (down + down_most) * side + right_most + right[source, c]
            for c in range(columns):
                score[r, c] += evidence[k, r, c]
    return score


@njit(cache=True, nogil=True)
def _best_shift(score: Array, along: Array, right: NDArray[np.int64], reach: int, circular: bool) -> None:
    rows, columns = score.shape
    for r in range(rows):
        copy_row(along[r], score[r])
        right[r] = 0
        for i in range(1, 2 * reach + 1):
            move = _nearest(i)
            for c in range(columns):
                source = c - move
                if circular:
                    source = source % columns
                elif source < 0 or source >= columns:
                    continue
                if score[r, source] > along[r, c]:
                    along[r, c] = score[r, source]
                    right[r, c] = move


@njit(cache=True, nogil=True)
def _nearest(i: int) -> int:
    """Return the i-th move by size: 0, -1, 1, -2, 2, ..."""
    return i // 2 if i % 2 == 0 else -(i // 2) - 1
