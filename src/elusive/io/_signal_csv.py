"""Signals from text: one frame a line, or one sample a line, with or without times and a line of names."""

from __future__ import annotations

import math
import re
from collections.abc import Generator
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError

TIME = "time_s"
# a first column of one of these names is no sample, though it is not said to be seconds
NOT_SAMPLES = ("", "time", "t", "time_ms", "timestamp", "date", "frame", "index")
REPAIR = "repair the line."


class Table(NamedTuple):
    """How a text file of numbers is laid out, told by its first lines."""

    path: Path
    delimiter: str | None  # None is white space
    skip: int  # lines before the first of numbers
    timed: bool  # the first column is the time [s]
    columns: int  # numbers a line, the time not counted

    def lines(self) -> Generator[tuple[int, float | None, Array], None, None]:
        """Yield each line's number in the file, from 1, its time and its samples.

        Raises
        ------
        DataError
            If a cell that is not empty is no number, a line has another number of cells, or time does not go forwards.
        """
        wanted, before = self.columns + self.timed, -math.inf
        with closing(_lines(self.path)) as lines:
            for number, text in islice(lines, self.skip, None):
                if not text or text.startswith("#"):
                    continue
                cells = text.split(self.delimiter)
                where = f"{self.path}, line {number}"
                if len(cells) != wanted:
                    raise DataError(f"{where}: has {len(cells)} cells, the first line of numbers {wanted}; {REPAIR}")
                try:
                    values = np.array([cell.strip() or "nan" for cell in cells], dtype=np.float64)
                except ValueError:
                    raise DataError(_bad_cell(where, cells)) from None
                if self.timed and not math.isfinite(values[0]):
                    raise DataError(f"{where}: {TIME} is {cells[0].strip() or 'empty'}; give every line its time.")
                time_s = float(values[0]) if self.timed else None
                if time_s is not None and time_s <= before:
                    raise DataError(f"{where}: {TIME} is {time_s:g} after {before:g}; times must go forwards.")
                before = before if time_s is None else time_s
                yield number, time_s, values[1:] if self.timed else values


def open_table(path: Path) -> Table:
    """Find out from the first lines how a text file of numbers is laid out.

    Raises
    ------
    DataError
        If it holds no number, or its first column is named as something other than a sample or ``time_s``.
    """
    names: list[str] | None = None
    named_at = 0
    with closing(_lines(path)) as lines:
        for number, text in lines:
            told = text.lstrip("# ")
            if not told or (text.startswith("#") and not told.startswith(TIME)):
                continue
            delimiter = next((mark for mark in ";," if mark in told), None)
            cells = [cell.strip() for cell in told.split(delimiter)]
            if names is None and (text.startswith("#") or _is_header(cells)):
                names, named_at = cells, number
                continue
            if names is not None and names[0].lower() in NOT_SAMPLES:
                raise DataError(
                    f"{path}, line {named_at}: the first column is named {names[0]!r}; name it {TIME} if it is the "
                    "time in seconds, else leave it out."
                )
            timed = names is not None and names[0] == TIME
            if timed and len(cells) < 2:
                raise DataError(f"{path}, line {number}: has a time and no sample; give at least one a line.")
            return Table(path, delimiter, number - 1, timed, len(cells) - timed)
    raise DataError(f"{path}: holds no line of numbers; write one frame a line, or one sample a line.")


def _lines(path: Path) -> Generator[tuple[int, str], None, None]:
    number = 0
    try:
        with path.open(encoding="utf-8-sig") as file:
            for number, line in enumerate(file, 1):
                yield number, line.strip()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); check the path.") from None
    except UnicodeDecodeError:
        raise DataError(f"{path}, after line {number}: is not text in UTF-8; save it as plain text.") from None


def _is_header(cells: list[str]) -> bool:
    """Whether a line names columns: no cell is a number, or they are 0, 1, 2 ..., perhaps after a time's name."""
    rest = cells[1:] if cells[0].lower() in (TIME, *NOT_SAMPLES) else cells
    numbered = rest == [str(k) for k in range(len(rest))]
    return (numbered and len(cells) > 2) or not any(_number(cell) is not None for cell in cells)


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def _bad_cell(where: str, cells: list[str]) -> str:
    for place, cell in enumerate(cells, 1):
        if cell.strip() and _number(cell) is None:
            comma = re.fullmatch(r"\s*[-+]?\d+,\d+\s*", cell) is not None
            advice = "write a decimal point" if comma else "every cell must be a number"
            return f"{where}, field {place}: {cell.strip()!r:.60} is no number; {advice}."
    return f"{where}: is no line of numbers; {REPAIR}"
