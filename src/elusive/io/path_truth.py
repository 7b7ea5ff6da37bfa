"""Reads where targets truly were, or are to go: tables of times, names and places, in metres."""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io._table_lines import table_lines

PLACE = ("x_m", "y_m")
TRUTH_COLUMNS = ("time_s", "person", *PLACE)


class PathTruth(NamedTuple):
    """Each target's places over time."""

    names: tuple[str, ...]
    paths: tuple[Array, ...]  # (K, 3) time_s, x, y [m] of each target, times increasing; (K, 4) with heights

    def interpolated(self, times_s: ArrayLike) -> Array:
        """Interpolate all places, ``(T,) -> (T, P, 2 or 3)`` [m]; NaN before a target's first time, after its last."""
        times = np.asarray(times_s, np.float64)
        places = np.full((len(times), len(self.paths), max(path.shape[1] for path in self.paths) - 1), np.nan)
        for target, path in enumerate(self.paths):
            for axis, values in enumerate(path.T[1:]):
                places[:, target, axis] = np.interp(times, path[:, 0], values, left=np.nan, right=np.nan)
        return places


def read_path_truth(path: str | os.PathLike[str], place: tuple[str, str] = PLACE, name: str = "person") -> PathTruth:
    """Read where targets truly were.

    Parameters
    ----------
    path
        CSV under a header that names ``time_s``, ``x_m``, ``y_m``, perhaps ``z_m``, and ``person`` where there are
        several targets; other columns are passed over. A target's times increase.
    place, name
        Other names of these columns.

    Raises
    ------
    DataError
        If the header lacks a column, a line is no such row, a target's times do not increase, or there is none; the
        sentence gives the line.
    """
    rows: dict[str, list[list[float]]] = {}
    for line in table_lines(path, ("time_s", *place), None, "a time a line"):
        row = [line.number(column) for column in ("time_s", *place, "z_m") if column in line.cells]
        earlier = rows.setdefault(line.cells.get(name, "1"), [])
        if earlier and row[0] <= earlier[-1][0]:
            raise DataError(f"{line.where}: the time {row[0]:g} s comes after {earlier[-1][0]:g} s; times increase.")
        earlier.append(row)
    if not rows:
        raise DataError(f"{path}: holds no place; write time_s,{','.join(place)}, a time a line.")
    return PathTruth(tuple(rows), tuple(np.array(path) for path in rows.values()))


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
