"""Lines of a table in CSV under a header that names its columns: read lazily, refused with file, line and column."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Generator, Sequence
from contextlib import closing
from datetime import UTC, datetime
from typing import NamedTuple

from elusive.errors import DataError
from elusive.io.sources.cells import cells_of, mark_of, names_of
from elusive.io.sources.feed import Feed
from elusive.io.sources.lines import STRICT, lines_of

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?nan", re.ASCII | re.IGNORECASE)
MOMENT = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d.*", re.ASCII)

LATEST_S = 1e11  # the year 5138
FORWARDS = "sort the lines by time, and if times count down, subtract them from the first"  # where they run backwards


class TableLine(NamedTuple):
    """A line's cells by column."""

    where: str
    cells: dict[str, str]

    def number(self, column: str, *, most: float = math.inf, absent: float | None = None) -> float:
        """Return a cell's number; ``absent`` where there is none, if that may be.

        Raises
        ------
        DataError
            If it is no finite number, or greater than ``most`` either way.
        """
        cell = self.cells.get(column, "")
        if absent is not None and cell.lower() in ("", "nan"):
            return absent
        value = float(cell) if NUMBER.fullmatch(cell) else math.nan
        if not math.isfinite(value):
            raise DataError(f"{self.where}, column {column}: {cell!r:.60} is no number; write a finite one.")
        if abs(value) > most:
            raise DataError(f"{self.where}, column {column}: {value:g} is not from {-most:g} to {most:g}.")
        return value

    @property
    def clock(self) -> str:
        """The column that has the time: ``time_s``, or ``time``, a date and time."""
        return "time_s" if "time_s" in self.cells else "time"

    def time_s(self) -> float:
        """Return the line's time, which a date and time are since 1970.

        Raises
        ------
        DataError
            If it is no time, or later than any in seconds.
        """
        if self.clock == "time":
            return self.moment("time")
        time_s = self.number("time_s")
        if abs(time_s) >= LATEST_S:
            raise DataError(
                f"{self.where}, column time_s: {time_s:.14g} would be seconds of another age; milliseconds since 1970? "
                "Give times in seconds."
            )
        return time_s

    def moment(self, column: str) -> float:
        """Return a cell's date and time as seconds since 1970; UTC where it names no offset.

        Raises
        ------
        DataError
            If it is no date and time as ISO 8601 writes them.
        """
        cell = self.cells[column]
        try:
            moment = datetime.fromisoformat(cell if MOMENT.fullmatch(cell) else "")
            return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
        except (ValueError, OverflowError):
            raise DataError(
                f"{self.where}, column {column}: {cell!r:.60} is no date and time; write 2026-05-01T12:00:00Z."
            ) from None


def table_lines(
    path: str | os.PathLike[str],
    needed: Sequence[str],
    perhaps: Sequence[str] | None,
    what: str,
    feed: Feed | None = None,
) -> Generator[TableLine, None, None]:
    """Yield the lines of a table; blank lines and those that begin with ``#`` are passed over.

    Parameters
    ----------
    path
        CSV, with commas, semicolons or tabs between, and decimal commas unless it has commas between; or what else
        :func:`~elusive.io.sources.lines_of` reads.
    needed, perhaps
        Columns that must be there, in any order and case, and others that may; None: any other. Of
        ``azimuth_deg|arrival_s`` either must, the first is usual. A column without a name, as of rows that are
        numbered, is not read.
    what
        What a line holds: ``one bearing a line``.
    feed
        Live: whether to wait for more, and what is done with lines that cannot be used.

    Raises
    ------
    DataError
        If the file cannot be read, is empty, or a line does not fit the header.
    """
    table = Table(str(path), needed, perhaps)
    with closing(lines_of(str(path), feed)) as lines:
        for number, line in lines:
            if line.startswith("#"):
                continue
            if table.header is None:
                table.read_header(number, line)
                continue
            yield from (feed or STRICT).each([(number, line)], table.read)
    if table.header is None:
        usual = ",".join(names.split("|")[0] for names in needed)
        raise DataError(f"{path}: is empty; write {usual}, {what}.")


class Table:
    """The columns of a table, once its header has come."""

    def __init__(self, name: str, needed: Sequence[str], perhaps: Sequence[str] | None) -> None:
        self.name, self._needed, self._perhaps = name, needed, perhaps
        self.header: list[str] | None = None
        self._mark = ","  # or a semicolon or a tab, as the header has it

    def read_header(self, number: int, line: str) -> None:
        """Take the names of the columns from the first line."""
        self._mark = mark_of(line) or ","
        header = names_of(line, self._mark)
        choices = [names.split("|") for names in self._needed]
        named, there = {name for names in choices for name in names}, [name for name in header if name]
        unknown = self._perhaps is not None and not set(there) <= {*named, *self._perhaps}
        lacking = not all(set(names) & set(there) for names in choices)
        if unknown or lacking or len(set(there)) < len(there):
            others = [*(name for names in choices for name in names[1:]), *(self._perhaps or ())]
            more = f" and perhaps {', '.join(others)}" if others else ""
            usual = ",".join(names[0] for names in choices)
            raise DataError(f"{self.name}, line {number}: the columns are {line!r:.80}; name them {usual}{more}.")
        self.header = header

    def read(self, numbered: tuple[int, str]) -> TableLine:
        """Read a line under the header."""
        number, line = numbered
        where, header = f"{self.name}, line {number}", self.header or []
        cells = cells_of(line, self._mark, len(header))
        if len(cells) != len(header):
            raise DataError(f"{where}: has {len(cells)} cells for {len(header)} columns: {line!r:.80}; repair it.")
        return TableLine(where, {name: cell for name, cell in zip(header, cells, strict=True) if name})
