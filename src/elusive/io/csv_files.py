"""Tables as CSV: whole or not at all, one line a row, the same bytes on every system."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterable, Sequence
from typing import TextIO

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
