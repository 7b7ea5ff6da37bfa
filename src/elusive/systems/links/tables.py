"""The tables of people tracked through a radio network, written frame by frame: tracks, events, and both as netCDF."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np

from elusive.errors import DataError
from elusive.io import TrackRow, write_netcdf
from elusive.io.tracks import cells_of, columns, fault_of
from elusive.systems.links.track import LinkResult
from elusive.tracking.people import Event

if TYPE_CHECKING:
    import xarray as xr

EVENT_COLUMNS = ("time_s", "track", "event", "x_m", "y_m")
ROWS_AT_ONCE = 4096  # appended to the netCDF file


def rows_of(result: LinkResult) -> list[TrackRow]:
    """Return a frame's rows of the table; one of status ``none`` where there is no track."""
    rows = [
        TrackRow(
            result.time_s, one.track, one.status, one.existence, one.x_m, one.y_m, one.vx_mps, one.vy_mps, one.sd_x_m,
            one.sd_y_m,
        )
        for one in result.tracks
    ]  # fmt: skip
    return rows or [TrackRow(result.time_s, None, "none", 0.0)]


class LinkTables:
    """Writes ``tracks.csv`` and ``events.csv`` as the frames go; the files are closed with the block.

    Parameters
    ----------
    folder
        Where to; files of these names are replaced.

    Raises
    ------
    DataError
        If the system refuses to write, or a row contradicts itself.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._number = folder, 0
        with _refused(folder), ExitStack() as stack:
            self._tracks, self._events = (
                stack.enter_context((folder / name).open("w", encoding="utf-8", newline=""))
                for name in ("tracks.csv", "events.csv")
            )
            self._table, self._log = (csv.writer(file, lineterminator="\n") for file in (self._tracks, self._events))
            self._table.writerow(columns("m"))
            self._log.writerow(EVENT_COLUMNS)
            self._open = stack.pop_all()

    def __enter__(self) -> Self:
        """Return the tables."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the files."""
        with _refused(self._folder):
            self._open.close()

    def append(self, result: LinkResult, rows: Sequence[TrackRow]) -> None:
        """Write one more frame's rows, of :func:`rows_of`, and its events."""
        for row in rows:
            self._number += 1
            fault = fault_of(row)
            if fault:
                raise DataError(f"{self._folder / 'tracks.csv'}: row {self._number} of the tracks {fault}.")
        with _refused(self._folder):
            self._table.writerows(cells_of(row)[: len(columns("m"))] for row in rows)
            self._log.writerows(_event_row(result.time_s, event) for event in result.events)

    def flush(self) -> None:
        """Hand what has been written to the system, for others to read."""
        with _refused(self._folder):
            self._tracks.flush()
            self._events.flush()


class LinkDataset:
    """Writes the rows of tracks as netCDF, some thousand at a time.

    Parameters
    ----------
    path
        The file.
    title, config
        Its attributes.

    Raises
    ------
    DataError
        If the system refuses to write.
    """

    def __init__(self, path: Path, title: str, config: str) -> None:
        self._path, self._attributes = path, {"title": title, "config": config}
        self._rows: list[TrackRow] = []
        self._begun = False

    def append(self, rows: Sequence[TrackRow]) -> None:
        """Take in one more frame's rows; those without a track are left out."""
        if not self._begun:
            with _refused(self._path):
                write_netcdf(self._path, _dataset([], self._attributes), unlimited=("row",))
            self._begun = True
        self._rows += [row for row in rows if row.track is not None]
        if len(self._rows) >= ROWS_AT_ONCE:
            self.flush()

    def flush(self) -> None:
        """Write the rows that have not been written yet."""
        if self._rows:
            with _refused(self._path):
                _extend(self._path, _dataset(self._rows, self._attributes))
        self._rows = []


def _dataset(rows: Sequence[TrackRow], attributes: dict[str, str]) -> xr.Dataset:
    import xarray as xr

    state = np.array([(row.x, row.vx, row.y, row.vy) for row in rows]).reshape(-1, 4)
    deviation = np.array([(row.sd_x, row.sd_y) for row in rows]).reshape(-1, 2)
    return xr.Dataset(
        {
            "track": ("row", np.array([row.track for row in rows], np.int64)),
            "status": ("row", np.array([row.status for row in rows], dtype="U9")),
            "existence": ("row", np.array([row.existence for row in rows], np.float64)),
            "state": (("row", "component"), state, {"units": "m, m/s, m, m/s"}),
            "deviation": (("row", "axis"), deviation, {"units": "m"}),
        },
        coords={
            "time": ("row", np.array([row.time_s for row in rows], np.float64), {"units": "s"}),
            "component": ["x", "vx", "y", "vy"],
            "axis": ["x", "y"],
        },
        attrs=attributes,
    )


def _extend(path: Path, dataset: xr.Dataset) -> None:
    """Append a dataset's rows to those in a file."""
    import h5netcdf  # type: ignore[import-untyped]

    with h5netcdf.File(path, "a") as file:
        start = file.dimensions["row"].size
        stop = start + dataset.sizes["row"]
        file.resize_dimension("row", stop)
        for name, variable in dataset.variables.items():
            if "row" in variable.dims:
                file[name][start:stop] = variable.values


def _event_row(time_s: float, event: Event) -> tuple[str, ...]:
    x, y = event.position
    return f"{time_s:.3f}", str(event.track), event.what, f"{x:.3f}", f"{y:.3f}"


@contextmanager
def _refused(path: Path) -> Iterator[None]:
    """Turn a refusal of the system into a sentence."""
    try:
        yield
    except OSError as error:
        raise DataError(
            f"{path}: cannot be written ({error.strerror or error}); check space and permissions."
        ) from None
