"""The table of tracks along a signal, one row a time and track: its CSV form, written and read."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from typing import NamedTuple

from elusive.errors import DataError
from elusive.io.csv_files import number_text, write_csv
from elusive.io.tracks import NO_TRACK, records_of

COLUMNS = ("time_s", "track", "status", "score", "x_sample", "vx_sample")


class SignalTrackRow(NamedTuple):
    """One track at one time; a row of status ``none`` says only the highest score of a frame without one.

    The time is in seconds, and the velocity in samples a second; where the recording has no clock, the time is the
    frame's number and the velocity in samples a frame. The score is accumulated evidence in deviations of noise's.
    """

    time_s: float
    track: int | None
    status: str
    score: float  # NaN where it is not known
    x: float = math.nan
    vx: float = math.nan


def write_signal_tracks_csv(path: str | os.PathLike[str], rows: Iterable[SignalTrackRow]) -> None:
    """Write tracks along a signal as CSV, whole or not at all; numbers are written so that they read back exactly.

    Raises
    ------
    DataError
        If a row contradicts itself, or the file cannot be written.
    """
    table = list(rows)
    for number, row in enumerate(table, 1):
        fault = _fault_of(row)
        if fault:
            raise DataError(f"{path}: row {number} of the tracks {fault}.")
    write_csv(path, COLUMNS, (_cells(row) for row in table))


def _cells(row: SignalTrackRow) -> list[str]:
    track = "" if row.track is None else str(int(row.track))
    return [number_text(row.time_s), track, row.status, *map(number_text, row[3:])]


def read_signal_tracks_csv(path: str | os.PathLike[str]) -> list[SignalTrackRow]:
    """Read what :func:`write_signal_tracks_csv` wrote.

    Raises
    ------
    DataError
        If the columns are others, or a row cannot be read; the sentence gives the line and its text.
    """
    rows: list[SignalTrackRow] = []
    for record in records_of(path, (COLUMNS,), "tracks along a signal"):
        row = SignalTrackRow(record.time_s, record.track, record.status, *record.numbers)
        fault = _fault_of(row)
        if fault:
            raise DataError(f"{record.where} {fault}: {record.text!r:.80}.")
        rows.append(row)
    return rows


def _fault_of(row: SignalTrackRow) -> str | None:
    """Say how a row contradicts itself, or None."""
    if not math.isfinite(row.time_s):
        return f"has the time {row.time_s}; give a finite one"
    if any(math.isinf(value) for value in row[3:]):
        return "has an infinite number; leave unknown ones NaN"
    if not row.status or not row.status.isprintable():
        return f"has the status {row.status!r}; give it a plain name"
    if (row.track is None) != (row.status == NO_TRACK):
        return (
            f"has the track {row.track} and the status {row.status!r}; status none, and it alone, goes without a track"
        )
    if row.track is None and not (math.isnan(row.x) and math.isnan(row.vx)):
        return "has a position but no track; status none goes without"
    if row.track is not None and math.isnan(row.x):
        return f"gives track {row.track} no position; a track needs x_sample"
    return None
