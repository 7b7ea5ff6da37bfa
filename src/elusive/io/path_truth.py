"""Reads where one target truly was, or is to go: tables of times and places in metres."""

from __future__ import annotations

import math
import os
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io._table_lines import table_lines

PLACE = ("x_m", "y_m")
A_TIME = "a time a line"


class PathTruth(NamedTuple):
    """A path."""

    times_s: Array  # (K,), increasing
    places_m: Array  # (K, 3) east, north, up; up is NaN where the table has none

    def interpolated(self, times_s: ArrayLike) -> Array:
        """Interpolate the place, ``(T,) -> (T, 3)`` [m]; NaN before the first time and after the last."""
        times = np.asarray(times_s, np.float64)
        axes = (np.interp(times, self.times_s, axis, left=np.nan, right=np.nan) for axis in self.places_m.T)
        return np.column_stack(list(axes))


def read_path_truth(path: str | os.PathLike[str]) -> PathTruth:
    """Read where a target truly was.

    Parameters
    ----------
    path
        CSV under a header that names ``time_s``, ``x_m``, ``y_m`` and perhaps ``z_m``; other columns are passed over.
        Times increase.

    Raises
    ------
    DataError
        If the header lacks a column, a line is no such row, times do not increase, or there is none; the sentence
        gives the line.
    """
    rows: list[tuple[float, ...]] = []
    for line in table_lines(path, ("time_s", *PLACE), None, A_TIME):
        row = (*(line.number(name) for name in ("time_s", *PLACE)), line.number("z_m", absent=math.nan))
        if rows and row[0] <= rows[-1][0]:
            raise DataError(f"{line.where}: the time {row[0]:g} s comes after {rows[-1][0]:g} s; times increase.")
        rows.append(row)
    if not rows:
        raise DataError(f"{path}: holds no place; write time_s,{','.join(PLACE)}, {A_TIME}.")
    table = np.array(rows)
    return PathTruth(table[:, 0], table[:, 1:])


def read_way(path: str | os.PathLike[str]) -> Array:
    """Read the corners of a path, ``(n, 2)`` east and north [m]: CSV under a header that names ``x_m`` and ``y_m``.

    Raises
    ------
    DataError
        If the header lacks a column, a line is no place, or there is none.
    """
    corners = [[line.number(name) for name in PLACE] for line in table_lines(path, PLACE, None, "a corner a line")]
    if not corners:
        raise DataError(f"{path}: holds no place; write {','.join(PLACE)}, a corner a line.")
    return np.array(corners)
