"""Reads where one target truly was: a table of times and places, in metres, with heights where they are known."""

from __future__ import annotations

import csv
import math
import os
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.csv_files import read_lines
from elusive.io.truth import NUMBER

COLUMNS = ("time_s", "x_m", "y_m", "z_m")


class PathTruth(NamedTuple):
    """A path."""

    times_s: Array  # (K,), increasing
    places_m: Array  # (K, 3) east, north, up; up is NaN where the table has none

    def at(self, times_s: ArrayLike) -> Array:
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
    rows: list[list[float]] = []
    header: list[str] | None = None
    for line, text in enumerate(read_lines(path), 1):
        if not text.strip() or text.startswith("#"):
            continue
        cells = [cell.strip() for cell in next(csv.reader([text]))]
        where = f"{path}, line {line}"
        if header is None:
            header = cells
            if not set(COLUMNS[:3]) <= set(header) or len(set(header)) < len(header):
                raise DataError(f"{where}: the columns are {text.strip()!r:.80}; name them {','.join(COLUMNS[:3])}.")
            continue
        if len(cells) != len(header):
            raise DataError(f"{where}: has {len(cells)} cells, the header {len(header)}; write one a column.")
        record = dict(zip(header, cells, strict=True))
        told = [record[name] for name in COLUMNS if name in record]
        values = [float(cell) if NUMBER.fullmatch(cell) else math.nan for cell in told]
        if not all(map(math.isfinite, values)):
            raise DataError(f"{where}: {text.strip()!r:.80} has no time and place; write finite numbers.")
        if rows and values[0] <= rows[-1][0]:
            raise DataError(f"{where}: the time {values[0]:g} s comes after {rows[-1][0]:g} s; times increase.")
        rows.append(values if len(values) == len(COLUMNS) else [*values, math.nan])
    if not rows:
        raise DataError(f"{path}: holds no place; write {','.join(COLUMNS[:3])}, a time a line.")
    table = np.array(rows)
    return PathTruth(table[:, 0], table[:, 1:])
