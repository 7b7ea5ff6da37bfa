"""Reads where people truly were: a table of times, people and places, in metres."""

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

COLUMNS = ("time_s", "person", "x_m", "y_m")


class PeopleTruth(NamedTuple):
    """Each person's places over time."""

    names: tuple[str, ...]
    paths: tuple[Array, ...]  # (K, 3) time_s, x, y [m] of each person, times increasing

    def at(self, times_s: ArrayLike) -> Array:
        """Interpolate everybody's place, ``(T,) -> (T, P, 2)`` [m]; NaN before their first time, after their last."""
        times = np.asarray(times_s, dtype=np.float64)
        places = np.full((len(times), len(self.paths), 2), np.nan)
        for person, path in enumerate(self.paths):
            for axis in (0, 1):
                places[:, person, axis] = np.interp(times, path[:, 0], path[:, 1 + axis], left=np.nan, right=np.nan)
        return places


def read_people_truth(path: str | os.PathLike[str]) -> PeopleTruth:
    """Read where people truly were.

    Parameters
    ----------
    path
        CSV under a header that names ``time_s``, ``x_m`` and ``y_m``, and ``person`` where there are several; a line a
        time and person. A person's times increase.

    Raises
    ------
    DataError
        If the header lacks a column, a line is no such row, or a person's times do not increase; the sentence gives
        the line.
    """
    rows: dict[str, list[tuple[float, float, float]]] = {}
    header: list[str] | None = None
    for line, text in enumerate(read_lines(path), 1):
        if not text.strip() or text.startswith("#"):
            continue
        cells = [cell.strip() for cell in next(csv.reader([text]))]
        where = f"{path}, line {line}"
        if header is None:
            header = cells
            if not {"time_s", "x_m", "y_m"} <= set(header) or len(set(header)) < len(header):
                raise DataError(f"{where}: the columns are {text.strip()!r:.80}; name them {','.join(COLUMNS)}.")
            continue
        if len(cells) != len(header):
            raise DataError(f"{where}: has {len(cells)} cells, the header {len(header)}; write one a column.")
        record = dict(zip(header, cells, strict=True))
        numbers = [record[name] for name in ("time_s", "x_m", "y_m")]
        values = [float(text) if NUMBER.fullmatch(text) else math.nan for text in numbers]
        if not all(map(math.isfinite, values)):
            raise DataError(f"{where}: {text.strip()!r:.80} has no time and place; write numbers.")
        person = rows.setdefault(record.get("person", "1"), [])
        if person and values[0] <= person[-1][0]:
            raise DataError(
                f"{where}: the time is {values[0]:g} s after {person[-1][0]:g} s; a person's times increase."
            )
        person.append((values[0], values[1], values[2]))
    if not rows:
        raise DataError(f"{path}: holds no place; write {','.join(COLUMNS)}, a line a time and person.")
    return PeopleTruth(tuple(rows), tuple(np.array(path) for path in rows.values()))
