"""Lines of a table of radar plots: where each lies, by range and bearing or as a place, and where the radar was."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from decimal import Decimal
from itertools import chain, groupby
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io._radar_columns import COLUMNS, DEGREES, NEEDED, RANGES_M, RadarColumns
from elusive.io._table_lines import FORWARDS, TableLine, table_lines
from elusive.io.sources import Feed, in_order
from elusive.io.sources.lines import STRICT
from elusive.sensors.own_track import OwnTrack
from elusive.sensors.radar_scans import TURN_RAD, RadarPlot, RadarScan, scan_of

# A degree to more digits than a float has, so that bearings survive being written in degrees.
DEGREE_RAD = Decimal("0.01745329251994329576923690768488612713442872")
FURTHEST_M = 1e6  # of a plot's place


class TableStart(NamedTuple):
    """What a table's first lines say of it."""

    columns: RadarColumns
    left: tuple[str, ...]  # columns that are not read
    fix: tuple[float, float] | None  # first longitude and latitude of the radar, where the table tells them
    time_s: float


@dataclass(frozen=True)
class PlotTable:
    """A table of plots, its own ship's fixes handed to a track as its lines are read."""

    path: str | os.PathLike[str]
    frame: LocalFrame | None = None  # of places in degrees
    own: OwnTrack | None = None  # takes the table's fixes, or is known beforehand
    heading_at: Callable[[float], float] | None = None  # of a time in the table, where the table tells none [rad]
    feed: Feed | None = None  # live: how it is followed

    def start(self) -> TableStart | None:
        """Return what the first lines say of the table; None without a line."""
        with closing(self._lines()) as lines:
            line = next(lines, None)
            if line is None:
                return None
            columns = RadarColumns.of(line)
            left, own, fix = columns.left(list(line.cells)), columns.own, None
            time_s = line.time_s()
            if own is not None and own[0] in DEGREES:
                told = next((one for one in chain([line], lines) if one.cells[own[0]]), None)
                fix = None if told is None else _pair(told, own)
        return TableStart(columns, left, fix, time_s)

    def scans(self) -> Iterator[RadarScan]:
        """Gather equal times; a time without a plot is a scan without one."""
        with closing(self._rows()) as rows:
            for time_s, group in groupby(rows, key=itemgetter(0)):
                yield scan_of(time_s, [plot for _, plot in group if plot is not None])

    def plots(self) -> Iterator[RadarPlot]:
        """Yield the plots alone."""
        with closing(self._rows()) as rows:
            yield from (plot for _, plot in rows if plot is not None)

    def _lines(self) -> Generator[TableLine, None, None]:
        return table_lines(self.path, NEEDED, None, "one plot a line", self.feed)

    def _rows(self) -> Generator[tuple[float, RadarPlot | None], None, None]:
        """Yield each line's time and plot, None where the line says that there is none at that time."""
        with closing(self._lines()) as lines:
            read = _Reading(self, ordered=self.feed is None)
            rows = (self.feed or STRICT).each(lines, read)
            yield from in_order(rows, itemgetter(0), repr, self.feed, read.moved)

    def plot_of(self, line: TableLine, time_s: float, columns: RadarColumns, *, empty: bool) -> RadarPlot | None:
        """Return a line's plot, its radar's place taken in."""
        if columns.own is not None and self.own is not None and line.cells[columns.own[0]]:
            self.own.add(time_s, *self._local(line, columns.own))
            self.own.to_true_north = columns.polar and columns.own[0] in DEGREES
        if empty:
            return None
        heading = self._heading(line, time_s, columns)
        if self.own is not None:
            self.own.heading_rad = heading
        if columns.polar:
            range_m, bearing_rad = _measured(line, columns, heading)
        else:
            x, y = self._local(line, columns.measured)
            own = None if self.own is None else self.own.at(time_s)
            if own is not None:
                x, y = x - own.x_m, y - own.y_m
            range_m, bearing_rad = math.hypot(x, y), math.atan2(x, y) % TURN_RAD
            if range_m > FURTHEST_M:
                raise DataError(
                    f"{line.where}: lies {range_m / 1000:.0f} km from the radar; check the radar's place, and that "
                    f"{' and '.join(columns.measured)} are the plot's."
                )
            bearing_rad = bearing_rad if bearing_rad < TURN_RAD else 0.0
        doppler = line.number("doppler_mps", absent=math.nan)
        return RadarPlot(time_s, range_m, bearing_rad, doppler, 0.0 if math.isnan(heading) else heading)

    def _heading(self, line: TableLine, time_s: float, columns: RadarColumns) -> float:
        """Return the ship's heading [rad]; NaN where it is not told."""
        if columns.heading is not None:
            return math.radians(line.number(columns.heading, most=360, absent=math.nan))
        return math.nan if self.heading_at is None else self.heading_at(time_s)

    def _local(self, line: TableLine, names: tuple[str, str]) -> tuple[float, float]:
        """Return a line's place in metres."""
        if names[0] not in DEGREES:
            return _pair(line, names)
        if self.frame is None:
            raise DataError(
                f"{line.where}: tells places in degrees, and not where the radar is; give its place (--radar-lat-deg, "
                "--radar-lon-deg)."
            )
        x, y = self.frame.to_local(np.array(_pair(line, names)))[0].tolist()
        return x, y


class _Reading:
    """Reads lines into times and plots."""

    def __init__(self, table: PlotTable, *, ordered: bool) -> None:
        self._table, self._ordered = table, ordered
        self._columns: RadarColumns | None = None
        self._before, self._earlier, self._alone = -math.inf, "", False

    def __call__(self, line: TableLine) -> tuple[float, RadarPlot | None]:
        """Return a line's time and plot, None where it says that there is none."""
        columns = self._columns = self._columns or RadarColumns.of(line)
        clock, time_s = line.clock, line.time_s()
        empty = not any(line.cells.get(name) for name in (*columns.measured, COLUMNS[3]))
        before = self._before
        if self._ordered and (time_s < before or (time_s == before and (empty or self._alone))):
            fault = f"must go forwards: {FORWARDS}" if time_s < before else "without a plot stands alone"
            raise DataError(
                f"{line.where}, column {clock}: {line.cells[clock]} comes after {self._earlier}; a time {fault}."
            )
        self._before, self._earlier, self._alone = time_s, line.cells[clock], empty
        return time_s, self._table.plot_of(line, time_s, columns, empty=empty)

    def moved(self, row: tuple[float, RadarPlot | None], by_s: float) -> tuple[float, RadarPlot | None]:
        """Return a row at a later time.

        Raises
        ------
        DataError
            If the radar's own way goes by these times too.
        """
        if self._columns is not None and self._columns.own is not None:
            raise DataError(f"{self._table.path}: the clock went back, by which the radar's own way goes; start anew.")
        time_s, plot = row
        return time_s + by_s, None if plot is None else plot._replace(time_s=plot.time_s + by_s)


def _pair(line: TableLine, names: tuple[str, str]) -> tuple[float, float]:
    degrees = names[0] in DEGREES
    return line.number(names[0], most=360 if degrees else math.inf), line.number(
        names[1], most=90 if degrees else math.inf
    )


def _measured(line: TableLine, columns: RadarColumns, heading_rad: float) -> tuple[float, float]:
    """Return range and bearing from north."""
    distance, angle = columns.measured
    range_m, degrees, text = RANGES_M[distance] * line.number(distance), line.number(angle), line.cells[angle]
    if range_m < 0:
        raise DataError(f"{line.where}, column {distance}: {line.cells[distance]} is below 0; give the distance.")
    relative = angle == "relative_bearing_deg"
    if not (-180 if relative else 0) <= degrees <= 360:
        whence = "the bow" if relative else "north"
        raise DataError(f"{line.where}, column {angle}: {text} is not from 0 to 360 degrees clockwise from {whence}.")
    if not relative:
        return range_m, radians_of(text)
    if math.isnan(heading_rad):
        raise DataError(
            f"{line.where}: its bearing is from the bow, and no heading is told at that time; give heading_deg, or a "
            "log of the own ship with headings (HDT)."
        )
    bearing = (math.radians(degrees) + heading_rad) % TURN_RAD
    return range_m, bearing if bearing < TURN_RAD else 0.0


def radians_of(degrees: str) -> float:
    """Return an angle written in degrees, below a whole turn [rad]."""
    angle = float(Decimal(degrees) * DEGREE_RAD) if float(degrees) else 0.0
    return angle if angle < TURN_RAD else 0.0
