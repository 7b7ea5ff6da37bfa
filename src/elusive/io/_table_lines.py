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
from elusive.io._link_lines import lines_of

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?nan", re.ASCII | re.IGNORECASE)
MOMENT = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d.*", re.ASCII)


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
            advice = "write a decimal point" if cell.count(",") == 1 else "write a finite one"
            raise DataError(f"{self.where}, column {column}: {cell!r:.60} is no number; {advice}.")
        if abs(value) > most:
            raise DataError(f"{self.where}, column {column}: {value:g} is not from {-most:g} to {most:g}.")
        return value

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
    *,
    follow: bool = False,
    idle_s: float | None = None,
) -> Generator[TableLine, None, None]:
    """Yield the lines of a table; blank lines and those that begin with ``#`` are passed over.

    Parameters
    ----------
    path
        CSV, with commas, semicolons or tabs between; ``-``: standard input.
    needed, perhaps
        Columns that must be there, in any order, and others that may; None: any other. Of ``azimuth_deg|arrival_s``
        either must, the first is usual.
    what
        What a line holds: ``one bearing a line``.
    follow, idle_s
        Whether to wait for more where the file ends, and for how long.

    Raises
    ------
    DataError
        If the file cannot be read, is empty, or a line does not fit the header.
    """
    header: list[str] | None = None
    mark = ","  # or a semicolon or a tab, as the header has it
    choices = [names.split("|") for names in needed]
    usual = ",".join(names[0] for names in choices)
    with closing(lines_of(str(path), follow, idle_s)) as lines:
        for number, line in lines:
            if line.startswith("#"):
                continue
            if header is None:
                mark = next((mark for mark in ";\t" if mark in line), ",")
            where, cells = f"{path}, line {number}", [cell.strip() for cell in line.split(mark)]
            if '"' in line:
                cells = [cell.strip('"') for cell in cells]
            if header is None:
                header = cells
                unknown = perhaps is not None and not set(header) <= {*"|".join(needed).split("|"), *perhaps}
                lacking = not all(set(names) & set(header) for names in choices)
                if unknown or lacking or len(set(header)) < len(header):
                    others = [*(name for names in choices for name in names[1:]), *(perhaps or ())]
                    more = f" and perhaps {', '.join(others)}" if others else ""
                    raise DataError(f"{where}: the columns are {line!r:.80}; name them {usual}{more}.")
                continue
            if mark == "\t":  # empty cells at the end were taken for white space
                cells += [""] * (len(header) - len(cells))
            if len(cells) != len(header):
                raise DataError(f"{where}: has {len(cells)} cells for {len(header)} columns: {line!r:.80}; repair it.")
            yield TableLine(where, dict(zip(header, cells, strict=True)))
    if header is None:
        raise DataError(f"{path}: is empty; write {usual}, {what}.")
