"""What a table of numbers holds, by its columns: seen before it is tracked, units and all."""

from __future__ import annotations

import math
import re
from itertools import chain, islice
from pathlib import Path

from elusive.checks import Finding, Looked
from elusive.checks.units import like_kilometres, like_radians

MOST_LINES, MOST_COLUMNS, HEAD_CHARACTERS, WORDS = 100_000, 6, 1 << 20, 20
LINK = re.compile(r"(\w+)-(\w+)-(\w+)")  # a column of a radio network's log: transmitter-receiver-channel
DIRECTIONS = re.compile(r"\w*(azimuth|bearing)\w*_deg")
RANGE = "range_m"
WHOLE = 1e4  # numbers from here on, times since 1970 among them, are not rounded


def look_at_table(path: Path) -> Looked | None:
    """Return how many lines a text file has, from what to what its first columns go, and what is wrong with it.

    None of what is no text.
    """
    try:
        with path.open(encoding="utf-8") as file:
            first = file.readline(HEAD_CHARACTERS).strip().lstrip("\ufeff")
            lines = [line.split(",", MOST_COLUMNS)[:MOST_COLUMNS] for line in islice(file, MOST_LINES)]
    except (OSError, UnicodeDecodeError):
        return None
    names = [name.strip() for name in first.split(",")]
    named = any(_number(name) is None for name in names)
    if len(names) < 2 or (named and not all(name.isprintable() and name for name in names)):
        # numbers in another layout may be a log of some radio or radar
        if any(letter.isdigit() for letter in chain(first, *chain.from_iterable(lines[:WORDS]))):
            return None
        return Looked("", (_doubt("table", f"{path.name}: holds no numbers; its first line is {first!r:.60}."),))
    count = len(lines) + (not named)
    many = f"{'More than ' if len(lines) == MOST_LINES else ''}{count} line{'s' * (count != 1)}"
    if not named:
        every = [value for value in map(_number, chain(names, *lines)) if value is not None]
        return Looked(f"{many} of {len(names)} numbers{_reach(every)}.", ())
    shown = [name for name in names if LINK.fullmatch(name) is None][:MOST_COLUMNS]
    columns = {name: _values([line[k] for line in lines if k < len(line)])
               for k, name in enumerate(names[:MOST_COLUMNS]) if name in shown}  # fmt: skip
    told = [f"{name}{_reach(columns.get(name, []))}" for name in shown]
    links = [match.groups() for match in map(LINK.fullmatch, names) if match is not None]
    if links:
        nodes, channels = {end for link in links for end in link[:2]}, {link[2] for link in links}
        told.append(
            f"levels of {len(links)} links among {len(nodes)} nodes, {len(channels)} channel{'s' * (len(channels) > 1)}"
        )
    left = len(names) - len(shown) - len(links)
    more = f", and {left} more column{'s' * (left > 1)}" if left else ""
    doubts = [_wrong_unit(name, values) for name, values in columns.items()]
    if not count:
        doubts.append(_doubt("lines", f"{path.name}: holds no line below the names of its columns."))
    return Looked(f"{many}: {', '.join(told)}{more}.", tuple(one for one in doubts if one is not None))


def _doubt(name: str, sentence: str, remedy: str = "") -> Finding:
    return Finding(f"table.{name}", False, math.nan, math.nan, sentence, remedy)


def _wrong_unit(name: str, values: list[float]) -> Finding | None:
    if not values:
        return None
    reach = f"{min(values):.3g} to {max(values):.3g}"
    if DIRECTIONS.fullmatch(name) and like_radians(min(values), max(values), len(values)):
        return _doubt("radians", f"{name} {reach} looks like radians.", "Convert it to degrees.")
    if name == RANGE and like_kilometres(max(values), len(values)):
        return _doubt(
            "ranges", f"{name} {reach} looks like nautical miles or kilometres.",
            "Convert it to metres, or name it range_nmi or range_km.",
        )  # fmt: skip
    return None


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _values(cells: list[str]) -> list[float]:
    return [value for value in map(_number, cells) if value is not None]


def _reach(values: list[float]) -> str:
    if not values:
        return ""
    low, high = _said(min(values)), _said(max(values))
    return f" {low}" if low == high else f" {low} to {high}"


def _said(value: float) -> str:
    return f"{value:.10g}" if value.is_integer() or abs(value) >= WHOLE else f"{value:.4g}"
