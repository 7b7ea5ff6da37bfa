"""A recording of bearings tracked as a whole, or live: each time as it comes, at constant memory."""

from __future__ import annotations

import csv
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.gaussian.factor_graph import UNEVEN, FactorGraphFilter, FactorGraphState
from elusive.io import TrackRow, atomic_folder, existing_folder
from elusive.io.bearings import BearingSource
from elusive.io.path_truth import PathTruth
from elusive.io.tracks import cells_of, columns
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.parameters import BearingTracking, have_elevations
from elusive.systems.bearings.results import (
    HEIGHT_COLUMNS,
    BearingOutcome,
    height_cells,
    outcome_of,
    track_row,
    write_outcome,
)

__all__ = ["LiveFix", "follow_bearings", "track_bearings_recording"]


class LiveFix(NamedTuple):
    """A time that has been tracked and written."""

    row: TrackRow
    sensors: int  # that reported
    latency_s: float  # from the time's last line to its row in the file
    remarks: tuple[str, ...]  # that are new


def track_bearings_recording(
    source: BearingSource,
    sites: SensorSites,
    parameters: BearingTracking,
    out: Path | None,
    *,
    truth: PathTruth | None = None,
    on_time: Callable[[int], None] | None = None,
) -> BearingOutcome:
    """Track an emitter through a recording and write ``tracks.csv``, ``result.nc`` and the report.

    With elevations ``heights.csv`` stands beside them. The report is ``report.html`` and ``report.png``;
    ``config.yaml`` repeats the run. Nothing is left in ``out`` if the recording cannot be used.

    Parameters
    ----------
    source
        From :func:`~elusive.io.bearings.open_bearings`.
    sites
        Where the sensors stand.
    parameters
        What to do.
    out
        Folder for the results; None writes nothing.
    truth
        Where the emitter truly was; scores only.
    on_time
        Called with the number of times read.

    Raises
    ------
    ParameterError
        If the estimator cannot do what is asked.
    DataError
        If a line cannot be used.
    """
    parameters.choice(live=False)
    sets: list[BearingSet] = []
    with _heard() as said:
        for one in source:
            sets.append(one)
            if on_time is not None:
                on_time(len(sets))
    remarks = [*said(), *parameters.remarks(elevations=have_elevations(sets), live=False)]
    with nullcontext() if out is None else atomic_folder(out) as folder:
        estimates = parameters.estimate(sets, sites)
        outcome = outcome_of(source.name, sets, sites, parameters, estimates, remarks, truth)
        if folder is not None:
            write_outcome(folder, outcome, parameters.to_yaml())
    return outcome


def follow_bearings(
    source: BearingSource,
    sites: SensorSites,
    parameters: BearingTracking,
    out: Path,
    on_fix: Callable[[LiveFix], None],
) -> None:
    """Track an emitter while its bearings come: a time's row stands in the file before the next is read.

    The first time decides whether there are elevations. A time is complete when a later one comes.

    Parameters
    ----------
    source
        Opened with ``follow``, or standard input.
    sites
        Where the sensors stand.
    parameters
        What to do.
    out
        Folder for ``tracks.csv``, ``config.yaml`` and, with elevations, ``heights.csv``.
    on_fix
        Called after each time. What it raises ends the run; what is written by then stays.

    Raises
    ------
    ParameterError
        If the estimator cannot do what is asked.
    DataError
        If the folder holds an earlier run's track, or a line cannot be used.
    """
    parameters.choice(live=True)
    for name in ("tracks.csv", "heights.csv"):
        if (out / name).exists():
            raise DataError(f"{out / name}: is there already, of an earlier run; name another folder.")
    with _heard() as said:
        sets = iter(source)
        first = next(sets)
        solid = have_elevations([first])
        live = _Live(parameters.on(sites, elevations=solid, live=True))
        folder = existing_folder(out)
        (folder / "config.yaml").write_text(parameters.to_yaml(), encoding="utf-8")
        remarks = parameters.remarks(elevations=solid, live=True)
        with _table(folder / "tracks.csv", columns("m")) as write, _heights(folder, live.names) as write_height:
            for measurement in _chained(first, sets):
                began = time.perf_counter()
                mean, covariance, told = live.step(measurement)
                row = track_row(measurement.time_s, live.names, mean, covariance, told=told)
                write(cells_of(row)[: len(columns("m"))])
                if write_height is not None:
                    write_height(height_cells(measurement.time_s, live.names, mean, covariance))
                reported = len(set(measurement.sensor.tolist()))
                on_fix(LiveFix(row, reported, time.perf_counter() - began, (*remarks, *said())))
                remarks = ()


class _Live:
    """A filter of any kind, a time after another, as a state that begins x, vx, y, vy."""

    def __init__(self, estimator: Any) -> None:
        self._filter = estimator
        self._rng = np.random.default_rng(0)  # filters of bearings draw nothing
        self._state = estimator.init(self._rng)
        self._graph = isinstance(estimator, FactorGraphFilter)
        self._latest: float | None = None
        self._interval = 0.0
        self.names: tuple[str, ...] = ("x", "vx", "y", "vy") if self._graph else tuple(estimator.state_names)

    def step(self, measurement: BearingSet) -> tuple[Array, Array, bool]:
        """Return mean, covariance and whether a place is told."""
        for _ in range(self._skipped(measurement.time_s) if self._graph else 0):
            self._state = self._filter.step(self._state, measurement.time_s, None, self._rng)
        state = self._state = self._filter.step(self._state, measurement.time_s, measurement, self._rng)
        if isinstance(state, FactorGraphState):
            return _of_graph(state, self._interval or 1.0)
        told = state.started if hasattr(state, "started") else state.pending is None
        return state.mean, state.covariance, bool(told)

    def _skipped(self, time_s: float) -> int:
        """Count the steps without bearings before this one; the first interval is the step."""
        before, self._latest = self._latest, time_s
        if before is None:
            return 0
        self._interval = self._interval or time_s - before
        steps = (time_s - before) / self._interval
        if round(steps) < 1 or abs(steps - round(steps)) > UNEVEN * round(steps):
            raise DataError(
                f"bearings at {time_s:g} s: come {time_s - before:g} s after the last, and the factor graph counts "
                f"steps of {self._interval:g} s; give even times, or use --filter iekf or fixed-lag."
            )
        return round(steps) - 1


def _of_graph(state: FactorGraphState, interval_s: float) -> tuple[Array, Array, bool]:
    mean = np.empty(4)
    mean[::2], mean[1::2] = state.mean, state.velocity / interval_s
    variance = np.empty(4)
    variance[::2], variance[1::2] = state.variance, state.velocity_variance / interval_s**2
    return mean, np.diag(variance), bool(state.fixes >= 1)


@contextmanager
def _heard() -> Iterator[Callable[[], tuple[str, ...]]]:
    """Gather what a reader warns of; gives what is to be called for the sentences since the last call."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)

        def said() -> tuple[str, ...]:
            sentences = tuple(str(warning.message) for warning in caught)
            caught.clear()
            return sentences

        yield said


@contextmanager
def _table(path: Path, header: tuple[str, ...]) -> Iterator[Callable[[list[str]], None]]:
    """Give what writes a line, which is in the file at once."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)

        def write(cells: list[str]) -> None:
            writer.writerow(cells)
            file.flush()

        yield write


@contextmanager
def _heights(folder: Path, names: tuple[str, ...]) -> Iterator[Callable[[list[str]], None] | None]:
    if "z" not in names:
        yield None
        return
    with _table(folder / "heights.csv", HEIGHT_COLUMNS) as write:
        yield write


def _chained(first: BearingSet, sets: Iterator[BearingSet]) -> Iterator[BearingSet]:
    yield first
    yield from sets
