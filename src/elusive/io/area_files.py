"""A watched area from a file: its corners in turn, a line each."""

from __future__ import annotations

import csv
import math
import os

from elusive.errors import DataError, ParameterError
from elusive.geometry.areas import Area
from elusive.io.csv_files import read_lines


def read_area(path: str | os.PathLike[str]) -> Area:
    """Read a polygon: a corner a line, x and y [m], in turn.

    Parameters
    ----------
    path
        Text with commas or white space between the two numbers; a first line ``x_m,y_m``, blank lines and lines from
        ``#`` are left out. A last corner that repeats the first is as well.

    Raises
    ------
    DataError
        If a line is no corner, or the corners make no polygon; the sentence says where.
    """
    corners: list[tuple[float, float]] = []
    for line, text in enumerate(read_lines(path), 1):
        cells = [cell.strip() for cell in (next(csv.reader([text])) if "," in text else text.split())]
        if not any(cells) or cells[0].startswith("#") or (not corners and cells == ["x_m", "y_m"]):
            continue
        try:
            x, y = map(float, cells)
        except ValueError:
            x, y = math.nan, math.nan
        if not (math.isfinite(x) and math.isfinite(y)):
            raise DataError(f"{path}, line {line}: {text.strip()!r:.60} is no corner; write x and y in metres.")
        corners.append((x, y))
    if len(corners) > 1 and corners[0] == corners[-1]:
        corners.pop()
    try:
        return Area(corners_m=tuple(corners))
    except ParameterError as error:
        raise DataError(f"{path}: {error}") from None
