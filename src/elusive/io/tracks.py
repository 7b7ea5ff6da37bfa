"""The tidy table of tracks, one row a time and track: its CSV form, written and read."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from typing import Literal, NamedTuple

from elusive.errors import DataError
from elusive.io import csv_files
from elusive.io.csv_files import number_text, write_csv

Unit = Literal["px", "m"]
NO_TRACK = "none"
GEOGRAPHIC = ("lon_deg", "lat_deg")


class TrackRow(NamedTuple):
    """One track at one time, in the unit of its table; NaN where a number is not known.

    A row of status ``none`` says only how probable a target is: its track is None and it has no position. The time
    is in seconds, or the frame's number where the recording has no rate.
    """

    time_s: float
    track: int | None
    status: str
    existence: float
    x: float = math.nan
    y: float = math.nan
    vx: float = math.nan
    vy: float = math.nan
    sd_x: float = math.nan
    sd_y: float = math.nan
    lon_deg: float = math.nan
    lat_deg: float = math.nan


def columns(unit: Unit) -> tuple[str, ...]:
    """Names of the table's columns in a unit, longitude and latitude not counted."""
    if unit not in ("px", "m"):
        raise DataError(f"unit={unit!r}: a table of tracks is in 'px' or 'm'.")
    speed = {"px": "px", "m": "mps"}[unit]
    kinematic = (f"x_{unit}", f"y_{unit}", f"vx_{speed}", f"vy_{speed}", f"sd_x_{unit}", f"sd_y_{unit}")
    return ("time_s", "track", "status", "existence", *kinematic)


def write_tracks_csv(path: str | os.PathLike[str], rows: Iterable[TrackRow], unit: Unit = "px") -> None:
    """Write tracks as CSV, whole or not at all; numbers are written so that they read back exactly.

    Parameters
    ----------
    path
        File to write.
    rows
        The table, in the order to write. ``lon_deg, lat_deg`` become columns where any row has them.
    unit
        ``px``: x_px, y_px, vx_px, ... (pixels, pixels a frame or a second); ``m``: x_m, y_m, vx_mps, ...

    Raises
    ------
    DataError
        If a row contradicts itself, or the file cannot be written.
    """
    names = columns(unit)
    table = list(rows)
    for number, row in enumerate(table, 1):
        fault = fault_of(row)
        if fault:
            raise DataError(f"{path}: row {number} of the tracks {fault}.")
    if any(not math.isnan(row.lon_deg) for row in table):
        names = (*names, *GEOGRAPHIC)
    write_csv(path, names, (cells_of(row)[: len(names)] for row in table))


def read_tracks_csv(path: str | os.PathLike[str], unit: Unit = "px") -> list[TrackRow]:
    """Read what :func:`write_tracks_csv` wrote, in the same unit.

    Raises
    ------
    DataError
        If the columns are not those of the unit, or a row cannot be read; the sentence gives the line and its text.
    """
    names = columns(unit)
    rows: list[TrackRow] = []
    for record in records_of(path, (names, (*names, *GEOGRAPHIC)), f"tracks in {unit}"):
        row = TrackRow(record.time_s, record.track, record.status, *record.numbers)
        fault = fault_of(row)
        if fault:
            raise DataError(f"{record.where} {fault}: {record.text!r:.80}.")
        rows.append(row)
    return rows


def fault_of(row: TrackRow) -> str | None:
    """Say how a row contradicts itself, or None."""
    if not math.isfinite(row.time_s):
        return f"has the time {row.time_s}; give a finite one"
    if not 0.0 <= row.existence <= 1.0:
        return f"has the existence {row.existence}; a probability is from 0 to 1"
    if not row.status or not row.status.isprintable():
        return f"has the status {row.status!r}; give it a plain name"
    if (row.track is None) != (row.status == NO_TRACK):
        return (
            f"has the track {row.track} and the status {row.status!r}; status none, and it alone, goes without a track"
        )
    if any(math.isinf(value) for value in row[4:]):
        return "has an infinite number; leave unknown ones NaN"
    if row.track is not None and (math.isnan(row.x) or math.isnan(row.y)):
        return f"gives track {row.track} no position; a track needs x and y"
    if row.track is None and not all(math.isnan(value) for value in row[4:]):
        return "has a position but no track; status none goes without"
    if row.sd_x < 0.0 or row.sd_y < 0.0:
        return f"has a negative standard deviation ({row.sd_x}, {row.sd_y})"
    if math.isnan(row.lon_deg) != math.isnan(row.lat_deg):
        return "has one of lon_deg and lat_deg; give both or none"
    if abs(row.lon_deg) > 180.0 or abs(row.lat_deg) > 90.0:
        return f"has lon_deg {row.lon_deg}, lat_deg {row.lat_deg}; they are at most 180 and 90 in size"
    return None


class Record(NamedTuple):
    """A line of a table of tracks."""

    where: str
    text: str
    time_s: float
    track: int | None
    status: str
    numbers: list[float]  # of the columns after these three


def records_of(path: str | os.PathLike[str], headers: Sequence[tuple[str, ...]], what: str) -> Iterator[Record]:
    """Yield the lines of a table of tracks whose columns are one of some headers.

    Raises
    ------
    DataError
        If the columns are others, or a line cannot be read; the sentence gives the line and its text.
    """
    records = csv_files.records_of(path)
    _, header = next(records, (1, []))
    if tuple(header) not in headers:
        held = ",".join(header) or "missing"
        raise DataError(f"{path}, line 1: the columns are {held}; {what} have {','.join(headers[0])}.")
    for line, cells in records:
        where, text = f"{path}, line {line}", ",".join(cells)
        if len(cells) != len(header):
            raise DataError(f"{where}: has {len(cells)} cells for {len(header)} columns: {text!r:.80}; repair it.")
        numbers = _numbers(cells, header, where)
        track = int(cells[1]) if cells[1] else None
        yield Record(where, text, numbers[0], track, cells[2], numbers[2:])


def cells_of(row: TrackRow) -> list[str]:
    """Write a row as the cells of a line, longitude and latitude last."""
    track = "" if row.track is None else str(int(row.track))
    return [number_text(row.time_s), track, row.status, *map(number_text, row[3:])]


def _numbers(cells: list[str], header: list[str], where: str) -> list[float]:
    numbers = []
    for name, cell in zip(header, cells, strict=True):
        if name == "status":
            continue
        try:
            numbers.append(float(cell) if cell else math.nan)
            whole = name != "track" or not cell or str(int(cell)) == cell
        except ValueError:
            whole = False
        if not whole:
            kind = "whole number" if name == "track" else "number"
            raise DataError(f"{where}, column {name}: {cell!r:.80} is no {kind}.")
    return numbers
