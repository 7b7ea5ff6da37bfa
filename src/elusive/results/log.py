"""The tracks of a recording over time: written to ``tracks.csv`` as they come, kept for all else at constant memory."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self, TextIO

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.added_file import HeldFile
from elusive.io.atomic import refused
from elusive.io.csv_files import csv_text, records_of, write_csv
from elusive.results.spool import Records, Spool
from elusive.results.table import CONFIRMED, HEAD, STATUSES, Columns, Unit, columns_of
from elusive.tracking.track import Step, Track


class ByTrack(NamedTuple):
    """All rows, track by track."""

    numbers: NDArray[np.int64]  # (K,) of the tracks, increasing
    sizes: NDArray[np.int64]  # (K,) rows of each
    rows: Records  # (N,) each track's in the order of time

    def __iter__(self) -> Iterator[tuple[int, Records]]:  # type: ignore[override]
        """Yield each track's number and rows."""
        stops = np.cumsum(self.sizes)
        for number, size, stop in zip(self.numbers.tolist(), self.sizes, stops, strict=True):
            yield number, self.rows[stop - size : stop]


class TrackLog:
    """Takes the steps of a recording and gives its tracks, as columns.

    Parameters
    ----------
    state_names
        Of the tracks' means: ``x, vx, y, vy, ...``.
    unit
        Of places: ``m``, ``px`` or ``samples``; velocities are in them a second.
    added
        Names, with their units, of what the system adds to a track in ``extra``; ``score`` for the track's own.
    step_values
        Names, with their units, of what is known of every step, with tracks or without.
    path
        Of the CSV file that the rows are written to as they come; it is closed with the block.
    live
        Whether a run goes on where the system refuses to write: lines of the file are held until it takes them, and
        steps that cannot be kept beside it are left out. Else that is a DataError.
    keeps
        Whether all rows and steps are kept, to be asked for; else they are in the file alone.

    Raises
    ------
    ParameterError
        If the names do not make a table.
    """

    def __init__(
        self,
        state_names: Sequence[str],
        unit: Unit,
        added: Sequence[str] = (),
        step_values: Sequence[str] = (),
        path: Path | None = None,
        *,
        live: bool = False,
        keeps: bool = True,
    ) -> None:
        self.columns = Columns(tuple(state_names), unit, tuple(added)).checked()
        folder = None if path is None else path.parent
        self.step_values = tuple(step_values)
        self._rows = Spool(self.columns.dtype, folder)
        self._steps = Spool(np.dtype([(name, np.float64) for name in ("time_s", *step_values)]), folder)
        self.latest: list[list[Any]] = []
        """Cells of the last step's rows, where they are written to a file."""
        self._latest_s = -math.inf
        self._live, self._keeps, self._is_left_out = live, keeps, False
        self._said: list[str] = []
        self._file: TextIO | HeldFile | None = None
        self._path = path
        if path is not None and live:
            self._file = HeldFile(path, csv_text(self.columns.names, ()), self.note)
        elif path is not None:
            with refused(path):
                self._file = path.open("w", encoding="utf-8", newline="")
                self._write([self.columns.names])

    def __enter__(self) -> Self:
        """Return the log."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the CSV file; the log still gives what it holds.

        Raises
        ------
        DataError
            If the system refuses to write what is left.
        """
        file, self._file = self._file, None
        if file is not None:
            with refused(self._path):
                file.close()

    def append(self, step: Step, **values: float) -> None:
        """Take in a step's tracks, and the values that were named for every step.

        Raises
        ------
        DataError
            If time runs backwards, a track contradicts itself, or the system refuses to write.
        """
        if not step.time_s >= self._latest_s:
            raise DataError(f"tracks at {step.time_s} s: come after those at {self._latest_s:g} s; sort them by time.")
        self._latest_s = step.time_s
        rows = self.columns.rows(step, len(self._steps))
        self.latest = []
        with refused(self._path):
            if self._has_room(rows, step.time_s):
                known = (values.get(name, math.nan) for name in self.step_values)
                self._steps.extend(np.array([(step.time_s, *known)], self._steps.dtype))
                self._rows.extend(rows)
            if self._file is not None and len(rows):
                self.latest = list(self.columns.cells(rows))
                self._write(self.latest)

    def _has_room(self, rows: Records, time_s: float) -> bool:
        """Whether a step is kept: live, not where the system refuses; that is said when it begins and ends."""
        if not self._keeps:
            return False
        try:
            self._steps.make_room(1)
            self._rows.make_room(len(rows))
        except DataError as error:
            if not self._live:
                raise
            if not self._is_left_out:
                self._said.append(f"{error} Tracking goes on; result.nc will lack the steps from {time_s:g} s on.")
            self._is_left_out = True
            return False
        if self._is_left_out:
            self._said.append(f"tracks: are kept again from {time_s:g} s on.")
        self._is_left_out = False
        return True

    def note(self, sentence: str) -> None:
        """Take a sentence in among those that are said."""
        self._said.append(sentence)

    def said(self) -> tuple[str, ...]:
        """Return what is to be said of its files since the last call."""
        said = tuple(self._said)
        self._said.clear()
        return said

    def flush(self) -> None:
        """Hand what has been written to the system, for others to read.

        Raises
        ------
        DataError
            If the system refuses to write it.
        """
        if self._file is not None:
            with refused(self._path):
                self._file.flush()

    @property
    def rows(self) -> Records:
        """All rows in the order of time, ``(N,)`` records of :class:`~elusive.results.table.Columns`."""
        return self._rows.records()

    @property
    def steps(self) -> Records:
        """All steps, ``(T,)`` records of ``time_s`` and the values of every step."""
        return self._steps.records()

    @property
    def times_s(self) -> Array:
        """Times of all steps, ``(T,)``."""
        return np.asarray(self.steps["time_s"])

    def by_track(self) -> ByTrack:
        """Return all rows track by track."""
        numbers, sizes = self._rows.counts("track")
        return ByTrack(numbers, sizes, self._rows.sorted_by("track", numbers, sizes))

    def confirmed(self) -> dict[int, Records]:
        """Return all rows of each track that was ever confirmed, by its number."""
        return {number: rows for number, rows in self.by_track() if (rows["status"] == CONFIRMED).any()}

    def only(self, tracks: Sequence[int]) -> TrackLog:
        """Return a log of the same steps, with these tracks alone."""
        log = TrackLog(self.columns.state_names, self.columns.unit, self.columns.added, self.step_values)
        rows = self.rows
        log._steps.extend(self.steps)
        log._rows.extend(rows[np.isin(rows["track"], tracks)])
        return log

    def csv_text(self) -> str:
        """Return what stands in ``tracks.csv``."""
        return csv_text(self.columns.names, self.columns.cells(self.rows))

    def _write(self, lines: Any) -> None:
        assert self._file is not None
        csv.writer(self._file, lineterminator="\n").writerows(lines)


def write_tracks_csv(path: str | os.PathLike[str], log: TrackLog) -> None:
    """Write the tracks of a log as CSV, whole or not at all.

    Raises
    ------
    DataError
        If the file cannot be written.
    """
    write_csv(path, log.columns.names, log.columns.cells(log.rows))


def read_tracks_csv(path: str | os.PathLike[str]) -> TrackLog:
    """Read a table of tracks, of any of the units; times without a track are not in it.

    A last line without its end is left out: of a run that was killed, or is being written now.

    Raises
    ------
    DataError
        If the columns are others, or a line cannot be read; the sentence gives the line and its text.
    """
    lines = records_of(path)
    header = next(lines, (1, []))[1]
    columns = columns_of(header)
    if columns is None:
        usual = ",".join(Columns(("x", "vx", "y", "vy"), "m").names)
        raise DataError(
            f"{path}, line 1: the columns are {','.join(header) or 'missing'!r:.200}; tracks have {usual}, or the "
            "same in px or samples."
        )
    log = TrackLog(columns.state_names, columns.unit, columns.added)
    pending: list[Track] = []
    latest_s = math.nan
    for line, cells in lines:
        where = f"{path}, line {line}"
        if len(cells) != len(header):
            raise DataError(f"{where}: has {len(cells)} cells for {len(header)} columns; repair it.")
        time_s, track = _track(columns, dict(zip(header, cells, strict=True)), where)
        if pending and time_s != latest_s:
            log.append(Step(latest_s, None, None, tuple(pending)))
            pending = []
        pending.append(track)
        latest_s = time_s
    if pending:
        log.append(Step(latest_s, None, None, tuple(pending)))
    return log


def _track(columns: Columns, record: dict[str, str], where: str) -> tuple[float, Track]:
    numbers: dict[str, float] = {}
    for name, cell in record.items():
        if name != "status":
            try:
                numbers[name] = float(cell) if cell else math.nan
            except ValueError:
                raise DataError(f"{where}, column {name}: {cell!r:.80} is no number.") from None
    status = next((status for status in STATUSES if status == record["status"]), None)
    if status is None or not record["track"].isdecimal() or not math.isfinite(numbers["time_s"]):
        raise DataError(f"{where}: needs a finite time_s, a track's number and a status of {', '.join(STATUSES)}.")
    d = len(columns.state_names)
    mean, covariance = np.full(d, np.nan), np.full((d, d), np.nan)
    for k, name in enumerate(columns.state_names):
        column = next(column for column in columns.names[len(HEAD) :] if column.startswith(f"{name}_"))
        mean[k] = numbers[column]
        covariance[k, k] = numbers.get(f"sd_{name}_{columns.unit}", math.nan) ** 2
    if "y" in columns.axes:
        x, y = columns.state_names.index("x"), columns.state_names.index("y")
        shared = numbers["correlation_xy"] * math.sqrt(covariance[x, x] * covariance[y, y])
        covariance[x, y] = covariance[y, x] = shared
    extra = {name: numbers[name] for name in columns.added if name != "score"}
    score = numbers.get("score", math.nan)
    return numbers["time_s"], Track(int(record["track"]), status, numbers["existence"], mean, covariance, score, extra)
