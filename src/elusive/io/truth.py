"""Where targets truly are: one table for every system, read from the files that users have."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io._table_lines import NUMBER, TableLine, table_lines
from elusive.io.csv_files import read_lines, write_csv
from elusive.io.sources.cells import mark_of, names_of

Unit = Literal["m", "px", "samples", "degrees"]
PLACES: dict[str, tuple[str, ...]] = {
    "m": ("x_m", "y_m"), "px": ("x_px", "y_px"), "samples": ("x_samples",), "degrees": ("lon_deg", "lat_deg"),
}  # fmt: skip
TIMED = ("m", "degrees")  # what has times, and no frames
HEIGHT = "z_m"
NAMED = ("track", "person", "ship", "emitter", "object")  # columns that tell targets apart, the usual one first


class Truth(NamedTuple):
    """Each target's places over time."""

    names: tuple[str, ...]
    paths: tuple[Array, ...]  # (K, 1 + k) of each: time [s] or number of the frame, then the place; increasing
    by_frame: bool = False  # whether frames are counted, from 0
    lines: int | None = None  # frames that it tells of, where it has a line for each
    longest_gap_s: float = math.inf  # between two times further apart nothing is known
    source: str = "truth"

    @classmethod
    def of_frames(cls, places: ArrayLike) -> Truth:
        """Make one of places in each frame, ``(T, targets, k)``, NaN where a target is absent."""
        dense = np.asarray(places, np.float64)
        numbers = range(dense.shape[1])
        whole = (np.insert(dense[:, n], 0, np.arange(len(dense)), axis=1) for n in numbers)
        paths = (rows[np.isfinite(rows).all(axis=1)] for rows in whole)
        return cls(tuple(str(n + 1) for n in numbers), tuple(paths), by_frame=True, lines=len(dense))

    def distance(self, times_s: Array, places: Array) -> Array:
        """Distances ``(n,)`` of places ``(n, 2)`` to the nearest target at their times; NaN where none is known."""
        apart = np.linalg.norm(places[:, None] - self.at(times_s)[..., :2], axis=2)
        return np.asarray(np.fmin.reduce(apart, axis=1, initial=np.nan))

    def at(self, times_s: ArrayLike, start: int = 0) -> Array:
        """Return all places at times, ``(T,) -> (T, targets, k)``, NaN where a target is absent.

        Between a target's times places are interpolated, before the first and after the last there are none. A truth by
        frames is taken as it is, ``start`` the number of the first.
        """
        times = np.asarray(times_s, np.float64)
        axes = max((path.shape[1] for path in self.paths), default=3) - 1
        places = np.full((len(times), len(self.paths), axes), np.nan)
        for number, path in enumerate(self.paths):
            k = path.shape[1] - 1
            if self.by_frame:
                rows = path[(path[:, 0] >= start) & (path[:, 0] < start + len(times))]
                places[rows[:, 0].astype(np.int64) - start, number, :k] = rows[:, 1:]
            elif len(path):
                found = (np.interp(times, path[:, 0], values, left=np.nan, right=np.nan) for values in path.T[1:])
                places[:, number, :k] = np.column_stack(list(found))
                after = np.clip(np.searchsorted(path[:, 0], times), 1, max(len(path) - 1, 1))
                gaps = np.diff(path[:, 0], append=np.inf)[after - 1]
                places[(gaps > self.longest_gap_s) & ~np.isin(times, path[:, 0]), number] = np.nan
        return places

    def aligned(self, times_s: ArrayLike, start: int = 0, *, whole: bool = True) -> Array:
        """Return all places at a recording's times, as :meth:`at`; ``whole``: the recording was used to its end.

        Raises
        ------
        DataError
            If the truth is not of this recording: frames beyond its last, too few lines, or other times.
        """
        times = np.asarray(times_s, np.float64)
        self.check_frames(start, len(times), whole=whole)
        ends = [end for path in self.paths if len(path) for end in path[[0, -1], 0]]
        if not self.by_frame and ends and len(times) and (min(ends) > times[-1] or max(ends) < times[0]):
            raise DataError(
                f"{self.source}: is of {min(ends):g} to {max(ends):g} s, and the recording of {times[0]:g} to "
                f"{times[-1]:g} s; count both from the same start, in seconds."
            )
        return self.at(times, start)

    def check_frames(self, start: int, frames: int, *, whole: bool = True) -> None:
        """Refuse a truth of other frames than ``frames`` from number ``start`` on; one by times passes.

        Raises
        ------
        DataError
            If so.
        """
        count = start + frames
        if self.lines is not None and self.lines < count:
            raise DataError(
                f"{self.source}: has {self.lines} rows for {count} frames; give one row a frame of the file, nan where "
                "a target is absent."
            )
        numbers = [number for path in self.paths for number in path[:, 0]] if self.by_frame else []
        if whole and numbers and max(numbers) >= count:
            advice = "; if it counts from 1, say so" if min(numbers) == 1 and max(numbers) == count else ""
            raise DataError(
                f"{self.source}: has a target in frame {max(numbers):.0f}, and the recording's last is {count - 1}: "
                f"frames count from 0{advice}."
            )


def read_truth(path: str | os.PathLike[str], unit: Unit, *, one_based: bool = False) -> Truth:
    """Read where targets truly are: a table with a row for each target at each time, or ``x y`` a line.

    The table's first line names ``frame`` or ``time_s``, ``track`` where there are several targets, and the place:
    ``x_px, y_px`` in frames, ``x_samples`` along a signal; else ``x_m, y_m`` and perhaps ``z_m``, or ``lon_deg,
    lat_deg``, always with a time. Other columns are passed over. Lines without a time are a frame each: the place of
    each target one after the other, ``nan`` where it is absent.

    Parameters
    ----------
    path
        Text; commas, semicolons or tabs between the cells of a table, white space or commas in lines of places.
    unit
        Of the system's places.
    one_based
        Whether frames of a table, and pixels or samples, count from 1; what is returned counts from 0.

    Raises
    ------
    DataError
        If the columns are others, a line is no such row, a target's times do not increase, or there is none; the
        sentence gives the line.
    """
    first = next((line for line in map(_bare, read_lines(path)) if line), "")
    names = names_of(first, mark_of(first))
    if unit in TIMED or (_named(first) and not _places_alone(re.split(r"[\s,;]+", first))):
        return _table(path, unit, names, one_based)
    return _lines(path, len(PLACES[unit]), unit, one_based)


def write_truth(path: str | os.PathLike[str], truth: Truth, unit: Unit) -> None:
    """Write a table that :func:`read_truth` reads back exactly, in the order of time."""
    axes = max((table.shape[1] for table in truth.paths), default=1 + len(PLACES[unit])) - 1
    rows = [(row[0], number, row) for number, table in enumerate(truth.paths) for row in table.tolist()]
    clock = "frame" if truth.by_frame else "time_s"
    cells = (
        (round(time) if truth.by_frame else time, truth.names[number], *row[1:])
        for time, number, row in sorted(rows, key=lambda row: row[:2])
    )
    write_csv(path, (clock, NAMED[0], *(*PLACES[unit], HEIGHT)[:axes]), cells)


def _check_unit(path: str | os.PathLike[str], names: Sequence[str], unit: Unit) -> None:
    """Refuse places in another unit, and frames where times are needed."""
    other = next((places for key, places in PLACES.items() if key != unit and set(places) <= set(names)), None)
    if other is not None and not set(PLACES[unit]) <= set(names):
        raise DataError(f"{path}: its places are {','.join(other)}; here they are {','.join(PLACES[unit])}.")
    if unit in TIMED and "frame" in names and "time_s" not in names:
        raise DataError(f"{path}: counts frames; here a target is at a place at a time, time_s.")


def _named(line: str) -> bool:
    """Tell whether a first line is one of names."""
    return line.lstrip('"')[:1].isalpha() and line[:3].lower() not in ("nan", "inf")


def _places_alone(names: Sequence[str]) -> bool:
    """Tell whether names are of places and nothing else, as over lines of ``x y``."""
    return all(name[:1] in ("x", "y", "X", "Y") for name in names)


def _table(path: str | os.PathLike[str], unit: Unit, names: Sequence[str], one_based: bool) -> Truth:
    _check_unit(path, names, unit)
    timed = unit in TIMED or ("time_s" in names and "frame" not in names)
    needed = ("time_s" if timed else "frame", *PLACES[unit])
    places = [*PLACES[unit], *([HEIGHT] if unit == "m" and HEIGHT in names else [])]
    name = next((name for name in NAMED if name in names), None)
    less = 1.0 if one_based else 0.0
    rows: dict[str, list[list[float]]] = {}
    for line in table_lines(path, needed, None, "a target's place a line"):
        time = line.time_s() if timed else _frame(line, one_based)
        row = [time, *(line.number(place) - less for place in places)]
        target = "1" if name is None else line.cells[name]
        earlier = rows.setdefault(target, [])
        if earlier and time <= earlier[-1][0]:
            when, last = (f"{at:g} s" if timed else f"frame {at + less:g}" for at in (time, earlier[-1][0]))
            if time == earlier[-1][0]:
                advice = "leave one of the rows out" if name else "tell several targets apart in a column track"
                raise DataError(f"{line.where}: target {target} is there twice at {when}; {advice}.")
            raise DataError(f"{line.where}: {when} comes after {last}; a target's times increase.")
        earlier.append(row)
    if not rows:
        raise DataError(f"{path}: holds no place; write {','.join(needed)}, a target's place a line.")
    paths = tuple(np.array(found) for found in rows.values())
    return Truth(tuple(rows), paths, by_frame=not timed, source=str(path))


def _frame(line: TableLine, one_based: bool) -> float:
    """Return a frame's number, from 0."""
    number = line.number("frame")
    least = 1 if one_based else 0
    if number < least or number != math.floor(number):
        raise DataError(f"{line.where}, column frame: {number:g} is no frame; they are whole numbers from {least}.")
    return number - least


def _bare(line: str) -> str:
    return line.partition("#")[0].strip()


def _lines(path: str | os.PathLike[str], axes: int, unit: Unit, one_based: bool) -> Truth:
    """Read the places in each frame from a line each."""
    write = "write x y" if axes == 2 else "write a number of samples"
    is_what = "is no pair of numbers" if axes == 2 else "is no place"
    rows: list[list[float]] = []
    named = False
    for number, line in enumerate(read_lines(path), 1):
        text, where = _bare(line), f"{path}, line {number}"
        if not text:
            continue
        # commas and spaces between words at once are decimal commas
        mixed = "," in text and re.search(r"[^\s,]\s+[^\s,]", text)
        words = [] if mixed else re.split(r"\s*,\s*|\s+", text)
        if not rows and not named and words and _places_alone(words):
            _check_unit(path, words, unit)
            named = True
            continue
        if not words or len(words) % axes or not all(map(NUMBER.fullmatch, words)):
            raise DataError(
                f"{where}: {text!r:.80} {is_what}; {write}, or nan where a target is absent; or a table whose first "
                f"line is frame,track,{','.join(PLACES[unit])}."
            )
        values = [float(word) for word in words]
        places = np.reshape(values, (-1, axes))
        if np.isinf(places).any() or (np.isnan(places).any(axis=1) != np.isnan(places).all(axis=1)).any():
            raise DataError(f"{where}: {text!r:.80} is half a position; {write}, or nan where a target is absent.")
        if rows and len(values) != len(rows[0]):
            raise DataError(
                f"{where}: {text!r:.80} has {len(places)} places, the first line {len(rows[0]) // axes}; write one a "
                "target in every line, nan where it is absent."
            )
        rows.append(values)
    if not rows:
        raise DataError(f"{path}: holds no position; {write}, one line a frame.")
    places = np.reshape(rows, (len(rows), -1, axes)) - (1.0 if one_based else 0.0)
    return Truth.of_frames(places)._replace(source=str(path))
