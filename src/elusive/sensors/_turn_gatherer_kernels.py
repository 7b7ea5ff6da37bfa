"""Compiled kernels of a turn of radar video: spokes gathered into cells of half a beam by half a pulse."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array

LEAST_PART = 1e-6  # of a spoke


@njit(cache=True, nogil=True, error_model="numpy")
def gather(
    amplitude: NDArray[Any], passed: Array, received: NDArray[np.bool_], place: Array, width: float, samples: int,
    total: NDArray[np.float32], roots: NDArray[np.float32], counted: Array, lost: NDArray[np.float32],
) -> int:  # fmt: skip
    """Add mean power, and mean root of amplitude, of ``samples`` neighbours of spokes ``(n, m)`` to rows ``(A, R)``.

    A spoke covers ``width`` rows about its ``place``, in rows, and is shared among them. ``counted`` ``(5, A)`` gathers
    how many were received and passed, and the sums of what is ``passed`` ``(n, 3)`` with the latter: time and place.
    NaN is left out: ``lost`` ``(A, R)`` gathers the spokes, and parts of them, that are missing so; of how many cells
    of a spoke is returned.
    """
    rows, columns = total.shape
    share = np.float32(1.0 / samples)
    power, root = np.empty(columns, np.float32), np.empty(columns, np.float32)
    gone, holes = np.empty(columns, np.float32), 0
    for i in range(len(place)):
        power[:], root[:] = 0.0, 0.0
        for j in range(columns):
            for k in range(j * samples, (j + 1) * samples):
                value = np.float32(amplitude[i, k])
                power[j] += value * value
                root[j] += np.sqrt(value)
        before = holes
        for j in range(columns):
            if power[j] == power[j]:
                continue
            if before == holes:
                gone[:] = 0.0
            power[j], root[j] = 0.0, 0.0
            holes += 1
            for k in range(j * samples, (j + 1) * samples):
                value = np.float32(amplitude[i, k])
                if value == value:
                    power[j] += value * value
                    root[j] += np.sqrt(value)
                else:
                    gone[j] += share
        low, high = place[i] - 0.5 * width, place[i] + 0.5 * width
        for a in range(math.floor(low), math.floor(high) + 1):
            part = (min(a + 1.0, high) - max(a, low)) / width if width > 0 else 1.0
            if part < LEAST_PART:
                continue
            row, weight = a % rows, np.float32(part) * share
            line, beside = total[row], roots[row]
            for j in range(columns):
                line[j] += power[j] * weight
                beside[j] += root[j] * weight
            if holes > before:
                for j in range(columns):
                    lost[row, j] += gone[j] * np.float32(part)
            counted[0, row] += part * received[i]
            if row == a:  # what reaches over north is of this turn's other end
                counted[1, row] += part
                for k in range(3):
                    counted[2 + k, row] += part * passed[i, k]
    return holes


@njit(cache=True, nogil=True, error_model="numpy")
def overlap(total: NDArray[np.float32], spokes: Array, tall: int, wide: int) -> NDArray[np.float32]:
    """Mean of ``tall x wide`` neighbouring cells, round the turn; NaN where a row has no spoke, or columns end."""
    rows, columns = total.shape
    found = np.zeros((rows, columns), np.float32)
    for i in range(rows):
        found[i, columns - wide + 1 :] = np.nan
        line, heard = found[i], 0.0
        for a in range(tall):
            here = spokes[(i + a) % rows]
            heard = heard + here if here > 0 else np.nan
        share = np.float32(1 / (heard * wide))
        for a in range(tall):
            row = total[(i + a) % rows]
            for c in range(wide):
                for j in range(columns - wide + 1):
                    line[j] += row[j + c] * share
    return found
