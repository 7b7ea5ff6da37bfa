"""Tables in text under a line of names: commas, semicolons or tabs between, remarks after ``#``."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator

from elusive.errors import DataError
from elusive.io.csv_files import read_lines
from elusive.io.truth import NUMBER

Row = tuple[str, dict[str, str]]  # where it stands, and its cells by name


def names_in(line: str) -> tuple[str, list[str]]:
    """Return what stands between the cells of a line, and the names in it."""
    mark = next((mark for mark in ";\t" if mark in line), ",")
    return mark, [name.strip().strip('"') for name in line.split(mark)]


def says_something(line: str) -> bool:
    """Whether a line is more than blank or a remark."""
    return bool(line.strip()) and not line.startswith("#")


def read_columns(path: str | os.PathLike[str]) -> tuple[list[str], Iterator[Row]]:
    """Return the names of a table's columns and, lazily, its rows.

    Raises
    ------
    DataError
        If the file cannot be read, or a row has more or fewer cells than there are names; the sentence says where.
    """
    lines = ((number, line) for number, line in enumerate(read_lines(path), 1) if says_something(line))
    mark, names = names_in(next(lines, (0, ""))[1])

    def rows() -> Iterator[Row]:
        for number, line in lines:
            where, cells = f"{path}, line {number}", [cell.strip() for cell in line.split(mark)]
            if len(cells) != len(names):
                raise DataError(f"{where}: has {len(cells)} cells for {len(names)} columns; repair it.")
            yield where, dict(zip(names, cells, strict=True))

    return names, rows()


def finite(record: dict[str, str], name: str, where: str) -> float:
    """Return a cell's number.

    Raises
    ------
    DataError
        If it is none, or not finite.
    """
    cell = record[name]
    value = float(cell) if NUMBER.fullmatch(cell) else math.nan
    if not math.isfinite(value):
        raise DataError(f"{where}, column {name}: {cell!r:.60} is no number; write a finite one.")
    return value
