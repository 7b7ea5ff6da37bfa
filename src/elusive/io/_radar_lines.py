"""Lines of a table of radar plots: time, range, bearing and Doppler in the units that the header names."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from contextlib import closing
from decimal import Decimal
from itertools import groupby
from operator import itemgetter
from pathlib import Path

from elusive.errors import DataError
from elusive.io._table_lines import TableLine, table_lines
from elusive.sensors.radar_scans import TURN_RAD, RadarPlot, RadarScan, scan_of

COLUMNS = ("time_s", "range_m", "bearing_deg", "doppler_mps")
RANGES_M = {"range_m": 1, "range_km": 1000, "range_nmi": 1852}
NEEDED = ("time_s|time", "|".join(RANGES_M), "bearing_deg")
# A degree to more digits than a float has, so that bearings survive being written in degrees.
DEGREE_RAD = Decimal("0.01745329251994329576923690768488612713442872")


def columns_left(path: Path) -> tuple[str, ...]:
    """Return the columns that are not read, from the first line; of two that say the same the first is read."""
    with closing(table_lines(path, NEEDED, None, "one plot a line")) as lines:
        line = next(lines, None)
    return () if line is None else tuple(name for name in line.cells if name not in _columns_of(line))


def table_scans(path: Path) -> Iterator[RadarScan]:
    """Gather equal times; a time without a plot is a scan without one."""
    with closing(_rows(path)) as rows:
        for time_s, group in groupby(rows, key=itemgetter(0)):
            yield scan_of(time_s, (plot for _, plot in group if plot is not None))


def table_plots(path: Path) -> Iterator[RadarPlot]:
    """Yield the plots alone."""
    with closing(_rows(path)) as rows:
        yield from (plot for _, plot in rows if plot is not None)


def _rows(path: Path) -> Generator[tuple[float, RadarPlot | None], None, None]:
    """Yield each line's time and plot, None where the line says that there is none at that time."""
    before, earlier, alone = -math.inf, "", False
    with closing(table_lines(path, NEEDED, None, "one plot a line")) as lines:
        for line in lines:
            clock, *measured = _columns_of(line)
            time_s = line.moment(clock) if clock == "time" else line.number(clock)
            empty = not any(line.cells.get(name) for name in measured)
            if time_s < before or (time_s == before and (empty or alone)):
                fault = "must go forwards" if time_s < before else "without a plot stands alone"
                raise DataError(
                    f"{line.where}, column {clock}: {line.cells[clock]} comes after {earlier}; a time {fault}."
                )
            before, earlier, alone = time_s, line.cells[clock], empty
            yield time_s, None if empty else _plot(line, time_s, measured[0])


def _columns_of(line: TableLine) -> tuple[str, ...]:
    """Return the names of the columns that are read: time, range, bearing, Doppler."""
    first = (next(name for name in names.split("|") if name in line.cells) for names in NEEDED)
    return (*first, COLUMNS[3])


def _plot(line: TableLine, time_s: float, distance: str) -> RadarPlot:
    """Return a line's plot; ``distance`` names the column of its range."""
    range_m, degrees = RANGES_M[distance] * line.number(distance), line.number("bearing_deg")
    if range_m < 0:
        raise DataError(f"{line.where}, column {distance}: {line.cells[distance]} is below 0; give the distance.")
    text = line.cells["bearing_deg"]
    if not 0 <= degrees <= 360:
        raise DataError(f"{line.where}, column bearing_deg: {text} is not from 0 to 360 degrees clockwise from north.")
    return RadarPlot(time_s, range_m, radians_of(text), line.number("doppler_mps", absent=math.nan))


def radians_of(degrees: str) -> float:
    """Return an angle written in degrees, below a whole turn [rad]."""
    angle = float(Decimal(degrees) * DEGREE_RAD) if float(degrees) else 0.0
    return angle if angle < TURN_RAD else 0.0
