"""What a table of numbers holds, by its columns: seen before it is tracked, units and all."""

from __future__ import annotations

import math
from itertools import chain, islice
from pathlib import Path

from elusive.checks import Looked

MOST_LINES, MOST_COLUMNS, HEAD_CHARACTERS = 100_000, 6, 1 << 20


def look_at_table(path: Path) -> Looked | None:
    """Return how many lines a text file has, and from what to what its first columns go; None of what is no table."""
    try:
        with path.open(encoding="utf-8") as file:
            head = file.readline(HEAD_CHARACTERS).strip().lstrip("\ufeff")
            lines = [line.split(",", MOST_COLUMNS)[:MOST_COLUMNS] for line in islice(file, MOST_LINES)]
    except (OSError, UnicodeDecodeError):
        return None
    names = [name.strip() for name in head.split(",")]
    named = any(_number(name) is None for name in names)
    if len(names) < 2 or (named and not all(name.isprintable() and name for name in names)):
        return None
    count = len(lines) + (not named)
    many = f"{'More than ' if len(lines) == MOST_LINES else ''}{count} line{'s' * (count != 1)}"
    if not named:
        every = [value for value in map(_number, chain(names, *lines)) if value is not None]
        return Looked(f"{many} of {len(names)} numbers{_reach(every)}.", ())
    columns = [_column(name, [line[k] for line in lines if k < len(line)]) for k, name in enumerate(names)][
        :MOST_COLUMNS
    ]
    more = f", and {len(names) - MOST_COLUMNS} more columns" if len(names) > MOST_COLUMNS else ""
    return Looked(f"{many}: {', '.join(columns)}{more}.", ())


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _column(name: str, cells: list[str]) -> str:
    values = [value for value in map(_number, cells) if value is not None]
    return f"{name}{_reach(values)}"


def _reach(values: list[float]) -> str:
    if not values:
        return ""
    low, high = min(values), max(values)
    return f" {low:.10g}" if low == high else f" {low:.10g} to {high:.10g}"
