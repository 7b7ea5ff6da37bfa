"""Signals from text: one frame a line, or one sample a line, with or without times and a line of names."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Generator
from contextlib import closing, nullcontext
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io._opened import readable
from elusive.io._table_lines import LATEST_S
from elusive.io.sources.cells import cells_of, mark_of
from elusive.io.sources.feed import Feed
from elusive.io.sources.header import is_number
from elusive.io.sources.lines import STRICT, chained
from elusive.io.sources.order import in_order

NumberedLines = Generator[tuple[int, str], None, None]
Line = tuple[int, float | None, Array]  # number in the file, from 1; time [s]; samples

TIME = "time_s"
# a first column of one of these names is no sample, though it is not said to be seconds
NOT_SAMPLES = ("", "time", "t", "time_ms", "timestamp", "date", "frame", "index")
REPAIR = "repair the line."
LINK = re.compile(r"\w+-\w+-\w+")  # transmitter, receiver, channel


class Table(NamedTuple):
    """How a text file of numbers is laid out, told by its first lines."""

    path: Path
    delimiter: str | None  # None is white space
    skip: int  # lines before the first of numbers
    timed: bool  # the first column is the time [s]
    columns: int  # numbers a line, the time not counted
    opened: Callable[[], NumberedLines]  # lines from the first on, blank ones too
    feed: Feed = STRICT
    named: str = ""  # the line of names, which comes again where a file is begun anew

    def lines(self) -> Generator[Line, None, None]:
        """Yield each line's number in the file, from 1, its time and its samples; live, spoilt lines are left out.

        Live, times that go back are dealt with as :func:`~elusive.io.sources.in_order` does.

        Raises
        ------
        DataError
            If a cell that is not empty is no number, a line has another number of cells, or time does not go forwards.
        """
        before = -math.inf

        def read(numbered: tuple[int, str]) -> Line:
            nonlocal before
            number, text = numbered
            values = self._values(number, text)
            if not self.timed:
                return number, None, values
            time_s = float(values[0])
            if time_s <= before and not self.feed.lenient:
                raise DataError(
                    f"{self.path}, line {number}: {TIME} is {time_s:g} after {before:g}; times must go forwards."
                )
            before = time_s
            return number, time_s, values[1:]

        with closing(self.opened()) as lines:
            known = ("", self.named if self.feed.lenient else "")
            told = (line for line in islice(lines, self.skip, None) if line[1] not in known and line[1][0] != "#")
            rows = self.feed.each(told, read)
            counts_on = self.timed and self.feed.lenient
            yield from in_order(rows, _time, lambda line: 0, self.feed, _moved) if counts_on else rows

    def _values(self, number: int, text: str) -> Array:
        wanted = self.columns + self.timed
        cells = cells_of(text, self.delimiter, wanted)
        where = f"{self.path}, line {number}"
        if len(cells) != wanted:
            raise DataError(f"{where}: has {len(cells)} cells, the first line of numbers {wanted}; {REPAIR}")
        try:
            values = np.array([cell or "nan" for cell in cells], dtype=np.float64)
        except ValueError:
            raise DataError(_bad_cell(where, cells)) from None
        if self.timed and not abs(values[0]) < LATEST_S:
            raise DataError(f"{where}: {TIME} is {cells[0] or 'empty'}; give every line its time in seconds.")
        return values


def open_table(path: Path, live: NumberedLines | None = None, feed: Feed = STRICT) -> Table:
    """Find out from the first lines how a text of numbers is laid out.

    ``live`` are its lines as they come, which are read once; none: those of the file.

    Raises
    ------
    DataError
        If it holds no number, or its first column is named as something other than a sample or ``time_s``.
    """
    names: list[str] | None = None
    named_at, named = 0, ""
    looked = list[tuple[int, str]]()
    opened = (lambda: _lines(path)) if live is None else (lambda: chained(looked, live))
    with nullcontext(live) if live is not None else closing(_lines(path)) as lines:
        for number, text in lines:
            looked.append((number, text))
            told = text.lstrip("# ")
            if not told or (text.startswith("#") and not told.startswith(TIME)):
                continue
            delimiter = mark_of(told)
            cells = cells_of(told, delimiter)
            if names is None and (text.startswith("#") or _is_header(cells)):
                names, named_at, named = cells, number, text
                continue
            if names is not None and names[0].lower() in NOT_SAMPLES:
                raise DataError(
                    f"{path}, line {named_at}: the first column is named {names[0]!r}; name it {TIME} if it is the "
                    "time in seconds, else leave it out."
                )
            timed = names is not None and names[0] == TIME
            if timed and names is not None and len(names) > 2 and all(map(LINK.fullmatch, names[1:])):
                raise DataError(
                    f"{path}, line {named_at}: {names[1]!r} is named as a link of a radio network; track that with "
                    "`elusive track links`."
                )
            if timed and len(cells) < 2:
                raise DataError(f"{path}, line {number}: has a time and no sample; give at least one a line.")
            return Table(path, delimiter, number - 1, timed, len(cells) - timed, opened, feed, named)
    raise DataError(f"{path}: holds no line of numbers; write one frame a line, or one sample a line.")


def _time(line: Line) -> float:
    assert line[1] is not None
    return line[1]


def _moved(line: Line, by_s: float) -> Line:
    return line[0], _time(line) + by_s, line[2]


def _lines(path: Path) -> NumberedLines:
    number = 0
    try:
        with readable(path), path.open(encoding="utf-8-sig") as file:
            for number, line in enumerate(file, 1):
                yield number, line.strip()
    except UnicodeDecodeError:
        raise DataError(f"{path}, after line {number}: is not text in UTF-8; save it as plain text.") from None


def _is_header(cells: list[str]) -> bool:
    """Whether a line names columns: no cell is a number, or they are 0, 1, 2 ..., perhaps after a time's name."""
    rest = cells[1:] if cells[0].lower() in (TIME, *NOT_SAMPLES) else cells
    numbered = rest == [str(k) for k in range(len(rest))]
    return (numbered and len(cells) > 2) or not any(map(is_number, cells))


def _bad_cell(where: str, cells: list[str]) -> str:
    for place, cell in enumerate(cells, 1):
        if cell and not is_number(cell):
            return f"{where}, field {place}: {cell!r:.60} is no number; every cell must be a number."
    return f"{where}: is no line of numbers; {REPAIR}"
