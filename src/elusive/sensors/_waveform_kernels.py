"""Compiled kernel of the noise-object sensor: a map summed over what each state's object covers."""

from __future__ import annotations

import numpy as np

from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True)
def covered_sums(values: Array, x: Array, y: Array, width: int, height: int, circular: bool) -> Array:
    """Sum ``values (rows, columns)`` over the samples within half an object of each ``(x, y)``, ``(N,)``.

    A sample off the frame adds nothing unless the frame is circular; nor does a place that is no finite number.
    """
    rows, columns = values.shape
    out = np.zeros(len(x))
    for i in range(len(x)):
        if not (np.isfinite(x[i]) and np.isfinite(y[i])):
            continue
        left, top = np.ceil(x[i] - 0.5 * width), np.ceil(y[i] - 0.5 * height)
        if circular:
            left -= columns * np.floor(left / columns)
            top -= rows * np.floor(top / rows)
        elif not (-width < left < columns and -height < top < rows):
            continue
        total = 0.0
        for r in range(int(top), int(top) + height):
            if circular:
                r %= rows
            elif not 0 <= r < rows:
                continue
            for c in range(int(left), int(left) + width):
                if circular:
                    total += values[r, c % columns]
                elif 0 <= c < columns:
                    total += values[r, c]
        out[i] = total
    return out
