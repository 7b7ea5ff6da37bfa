"""Where a ship truly was, in a radar's frame: a table of places, or the AIS positions that it reported.

ITU-R M.1371: a ship under way reports every 2 to 10 s, one at anchor every 3 minutes.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Iterable
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import read_ais
from elusive.io.csv_files import read_lines
from elusive.io.truth import NUMBER

METRES, DEGREES = ("time_s", "x_m", "y_m"), ("time_s", "lon_deg", "lat_deg")
DAY_S = 86_400
LONGEST_GAP_S = 200.0  # somewhat longer than between the reports of a ship at anchor
NAMED = 5  # ships listed where one must be chosen


def truth_in_frame(
    path: str | os.PathLike[str], frame: LocalFrame, *, midnight_unix_s: float = math.nan, mmsi: int | None = None
) -> Array:
    """Read a ship's places in the frame of a radar's tracks.

    Parameters
    ----------
    path
        A table whose first line names ``time_s,x_m,y_m`` (metres east and north of the frame's origin) or
        ``time_s,lon_deg,lat_deg`` (WGS 84), and other columns as it likes; or else a log of AIS sentences.
    frame
        Of the tracks: its origin is the radar's place.
    midnight_unix_s
        Of an AIS log, what the plots' times count from, in seconds after 1970 began: 0 where they are such times
        themselves. NaN: the midnight (UTC) before the first position, from which ASTERIX times count.
    mmsi
        The ship, where a log holds several.

    Returns
    -------
    ndarray
        ``(K, 3)`` time_s, x, y [m], times increasing.

    Raises
    ------
    DataError
        If the file cannot be read, a number is missing, out of its bounds or times do not increase, or the log holds
        several ships and none is named; the sentence says where.
    """
    path = Path(path)
    mark, names = _names(_first_line(path))
    if "time_s" in names:
        if mmsi is not None:
            raise DataError(f"{path}: is a table, and mmsi={mmsi} chooses in an AIS log; leave it out.")
        return _table(path, mark, names, frame)
    return _reported(path, frame, midnight_unix_s, mmsi)


def truth_at(truth: ArrayLike, times_s: ArrayLike, longest_gap_s: float = LONGEST_GAP_S) -> Array:
    """Interpolate a ship's places between its reports.

    Parameters
    ----------
    truth
        ``(K, 3)`` time_s, x, y [m], times increasing.
    times_s
        ``(T,)``.
    longest_gap_s
        Between two reports further apart nothing is known.

    Returns
    -------
    ndarray
        ``(T, 2)`` x, y [m]; NaN where nothing is known.
    """
    known, at = np.asarray(truth, dtype=np.float64), np.asarray(times_s, dtype=np.float64)
    times = known[:, 0]
    places = np.column_stack([np.interp(at, times, column, left=np.nan, right=np.nan) for column in known[:, 1:].T])
    after = np.clip(np.searchsorted(times, at), 1, max(len(times) - 1, 1))
    if len(times) > 1:
        gap = np.diff(times)[after - 1]
        places[(gap > longest_gap_s) & ~np.isin(at, times)] = np.nan
    return places


def _first_line(path: Path) -> str:
    """Return the first line with something on it; a log of AIS sentences may hold any octets."""
    try:
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            return next((line for line in file if _says(line)), "")
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); check the path.") from None


def _says(line: str) -> bool:
    return bool(line.strip()) and not line.startswith("#")


def _names(line: str) -> tuple[str, list[str]]:
    mark = next((mark for mark in ";\t" if mark in line), ",")
    return mark, [name.strip().strip('"') for name in line.split(mark)]


def _table(path: Path, mark: str, names: list[str], frame: LocalFrame) -> Array:
    """Read the columns that are named."""
    wanted = next((columns for columns in (METRES, DEGREES) if set(columns) <= set(names)), None)
    if wanted is None or any(names.count(name) > 1 for name in wanted):
        raise DataError(
            f"{path}: its columns are {','.join(names)!r:.80}; name them {','.join(METRES)} or {','.join(DEGREES)}."
        )
    columns = [names.index(name) for name in wanted]
    rows: list[list[float]] = []
    lines = ((number, line) for number, line in enumerate(read_lines(path), 1) if _says(line))
    for number, line in islice(lines, 1, None):
        where = f"{path}, line {number}"
        cells = [cell.strip() for cell in line.split(mark)]
        if len(cells) != len(names):
            raise DataError(f"{where}: has {len(cells)} cells for {len(names)} columns; repair it.")
        rows.append([_number(cells[k], name, where) for k, name in zip(columns, wanted, strict=True)])
        time_s, first, second = rows[-1]
        if len(rows) > 1 and time_s <= rows[-2][0]:
            raise DataError(
                f"{where}, column time_s: {time_s:g} comes after {rows[-2][0]:g}; sort the lines by time, one a time."
            )
        if wanted is DEGREES and not (abs(first) <= 360 and abs(second) <= 90):
            raise DataError(f"{where}: ({first:g}, {second:g}) is no longitude and latitude in degrees.")
    if not rows:
        raise DataError(f"{path}: holds no place; write {','.join(wanted)}, one a line.")
    table = np.array(rows)
    return np.column_stack([table[:, 0], frame.to_local(table[:, 1:])]) if wanted is DEGREES else table


def _number(cell: str, name: str, where: str) -> float:
    value = float(cell) if NUMBER.fullmatch(cell) else math.nan
    if not math.isfinite(value):
        raise DataError(f"{where}, column {name}: {cell!r:.60} is no number; write a finite one.")
    return value


def _reported(path: Path, frame: LocalFrame, midnight_unix_s: float, mmsi: int | None) -> Array:
    """Take one ship's positions, in the order of time and one for each time."""
    counts: Counter[str] = Counter()
    found = list(read_ais(path, mmsi=mmsi, counts=counts))
    ships = Counter(position.mmsi for position in found)
    if len(ships) > 1:
        raise DataError(f"{path}: holds the positions of {len(ships)} ships ({_listed(ships)}); say which by its MMSI.")
    if math.isnan(midnight_unix_s):
        midnight_unix_s = DAY_S * (min(position.time_s for position in found) // DAY_S)
    table = np.array([(position.time_s, position.lon_deg, position.lat_deg) for position in found])
    times, first = np.unique(table[:, 0], return_index=True)
    return np.column_stack([times - midnight_unix_s, frame.to_local(table[first, 1:])])


def _listed(ships: Counter[int]) -> str:
    """Name the ships with most positions."""
    named: Iterable[str] = (f"{mmsi} with {count}" for mmsi, count in islice(ships.most_common(), NAMED))
    return ", ".join(named) + (", ..." if len(ships) > NAMED else "")
