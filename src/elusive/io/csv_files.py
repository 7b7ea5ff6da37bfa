"""Tables as CSV: written whole or not at all, one line a row, the same bytes on every system; read line by line."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TextIO

from elusive.errors import DataError
from elusive.io._opened import readable
from elusive.io.atomic import atomic_path

Row = Iterable[object]


def csv_text(header: Sequence[str], rows: Iterable[Row]) -> str:
    """Return a table as CSV; a float in full, unless its row gives it as text."""
    text = io.StringIO()
    _write(text, header, rows)
    return text.getvalue()


def write_csv(path: str | os.PathLike[str], header: Sequence[str], rows: Iterable[Row]) -> None:
    """Write a table as CSV.

    Raises
    ------
    DataError
        If the file cannot be written.
    """
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        _write(file, header, rows)


def write_results(path: str | os.PathLike[str], header: Sequence[str], rows: Iterable[Row]) -> None:
    """Write results as CSV, floats with four significant digits, those that are no number left empty.

    Raises
    ------
    DataError
        If the file cannot be written.
    """
    write_csv(path, header, ([_short(value) for value in row] for row in rows))


def _write(file: TextIO, header: Sequence[str], rows: Iterable[Row]) -> None:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)


def _short(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else f"{value:.4g}"


def number_text(value: float) -> str:
    """Write a number so that it reads back exactly, NaN as nothing."""
    # The repr of a Python float is the shortest text that reads back exactly; a NumPy scalar's names its type.
    return "" if math.isnan(value) else repr(float(value))


def read_lines(path: str | os.PathLike[str]) -> list[str]:
    """Read a text file's lines, line ends kept; the sentence of a failure says why."""
    try:
        with readable(path), Path(path).open(encoding="utf-8-sig", newline="") as file:
            return list(file)
    except UnicodeDecodeError:
        raise DataError(f"{path}: is not text in UTF-8; save it as plain text.") from None


def first_line(path: Path) -> str:
    """Return the first line of a file with something on it that is no remark; octets that are no text are let pass."""
    with readable(path), path.open(encoding="utf-8-sig", errors="replace") as file:
        return next((line for line in file if line.strip() and not line.startswith("#")), "")


def records_of(path: str | os.PathLike[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield the number of each whole line and its cells, the header's too; one without its end was being written.

    Raises
    ------
    DataError
        If the file is no CSV; the sentence gives the line.
    """
    lines = read_lines(path)
    reader = csv.reader(lines if not lines or lines[-1].endswith("\n") else lines[:-1], strict=True)
    try:
        for cells in reader:
            yield reader.line_num, cells
    except csv.Error as error:
        raise DataError(f"{path}, line {reader.line_num}: is not CSV ({error}); repair the line.") from None
