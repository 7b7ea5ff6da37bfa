"""Cells of a line of text: the mark between them, quotes, and decimal commas as many spreadsheets write them."""

from __future__ import annotations

import re

MARKS = ";\t,"
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?", re.ASCII)


def mark_of(text: str) -> str | None:
    """Return the mark between the cells of a line: a semicolon, a tab or a comma; None is white space."""
    return next((mark for mark in MARKS if mark in text), None)


def cells_of(text: str, mark: str | None, width: int = 0) -> list[str]:
    """Return the cells of a line; where no comma parts them, a number's comma is its decimal point.

    Of ``width`` columns those at the end, if empty between tabs, were taken for white space at the line's end.
    """
    cells = [cell.strip().strip('"') for cell in text.split(mark)]
    if mark == "\t":
        cells += [""] * (width - len(cells))
    if mark == "," or "," not in text:
        return cells
    return [cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell) else cell for cell in cells]


def names_of(text: str, mark: str | None) -> list[str]:
    """Return the names of columns in a first line; one that begins with a capital as if it had none."""
    return [name.lower() if name[:1].isupper() else name for name in cells_of(text, mark)]
