"""AIS reports beside a radar's recording: a log of sentences, or a table, on the recording's clock."""

from __future__ import annotations

import math
import os
from contextlib import closing, suppress
from pathlib import Path

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io._opened import existing_file, readable
from elusive.io._table_lines import Table, TableLine, table_lines
from elusive.io.ais import KNOT_MPS, AisPosition, read_ais
from elusive.io.csv_files import first_line
from elusive.io.sources import Feed

TABLES = (".csv", ".tsv", ".txt")
NEEDED = ("time|time_s", "mmsi", "lon_deg", "lat_deg")
PERHAPS = ("sog_mps", "sog_kn", "cog_deg")
FASTEST_MPS, FURTHEST_M = 60.0, 200_000.0


def read_ais_reports(path: str | os.PathLike[str], since_1970_s: float) -> list[AisPosition]:
    """Read what ships report, with times that count as the recording's do.

    Parameters
    ----------
    path
        ``.csv``, ``.tsv`` or ``.txt`` that names ``mmsi, lon_deg, lat_deg`` and ``time_s`` (as the plots count it) or
        ``time`` (ISO 8601), perhaps ``sog_mps`` or ``sog_kn``, and ``cog_deg``; else a log as
        :func:`~elusive.io.ais.read_ais` takes it.
    since_1970_s
        When the recording's times begin to count, after 1970 began; NaN: it does not say.

    Raises
    ------
    DataError
        If the file cannot be read, a report is none, or times of day meet a recording without a date.
    """
    file = Path(path)
    table = file.suffix.lower() in TABLES and _named(file)
    dated, found = True, list[AisPosition]()
    if table:
        with closing(table_lines(file, NEEDED, PERHAPS, "a report a line")) as lines:
            for line in lines:
                dated = "time" in line.cells
                found.append(_report(line))
        if not found:
            raise DataError(f"{path}: holds no report; write {','.join(NEEDED[1:])} and time, a report a line.")
    else:
        found = list(read_ais(file))
    if not dated:
        return found
    if math.isnan(since_1970_s):
        raise DataError(
            f"{path}: tells times of day, and the plots' times count from a moment that they do not say; write the "
            "plots' column time, as 2026-05-01T12:00:00Z, or reports as a table of time_s."
        )
    return [one._replace(time_s=one.time_s - since_1970_s) for one in found]


def _report(line: TableLine) -> AisPosition:
    """Read a line of a table."""
    time_s = line.time_s()
    number = line.number("mmsi")
    if not (number == int(number) and 0 < number < 1e9):
        raise DataError(f"{line.where}: mmsi {number:g} is none; write its nine digits.")
    speed = line.number("sog_mps", absent=math.nan)
    speed = KNOT_MPS * line.number("sog_kn", absent=math.nan) if math.isnan(speed) else speed
    if speed < 0 or speed > FASTEST_MPS:
        raise DataError(f"{line.where}: a speed of {speed:.3g} m/s is no ship's; write sog_mps, or sog_kn in knots.")
    course = math.radians(line.number("cog_deg", most=360, absent=math.nan))
    lon, lat = line.number("lon_deg", most=360), line.number("lat_deg", most=90)
    return AisPosition(time_s, int(number), lon, lat, speed, course)


class GrowingReports:
    """A table as :func:`read_ais_reports` takes it that is written while it is read, on the clock of live plots.

    Parameters
    ----------
    path
        The table.
    frame
        Of places.
    feed
        Counts the lines that cannot be used, which are left out.

    Raises
    ------
    DataError
        If there is no such table.
    """

    def __init__(self, path: str | os.PathLike[str], frame: LocalFrame, feed: Feed) -> None:
        self._path, self._frame, self._feed = existing_file(path), frame, feed
        if self._path.suffix.lower() not in TABLES or not _named(self._path):
            raise DataError(f"{path}: live, reports are read of a table; write {','.join(NEEDED[1:])} and time.")
        self._begin()
        self._stamp: os.stat_result | None = None  # of the file that was read

    def _begin(self) -> None:
        self._table, self._octets, self._lines = Table(str(self._path), NEEDED, PERHAPS), 0, 0

    def since(self) -> list[tuple[AisPosition, Array, Array]]:
        """Return the reports of the lines that were completed since the last look, as :func:`in_frame` does.

        Raises
        ------
        DataError
            If the table cannot be read, or its columns are others.
        """
        octets = b""  # of a file between its removal and the next
        with readable(self._path), suppress(FileNotFoundError), self._path.open("rb") as file:
            now = os.fstat(file.fileno())
            if self._stamp is not None and (now.st_size < self._octets or not os.path.samestat(now, self._stamp)):
                self._feed.say(f"{self._path}: is another file now, or got shorter; it is read from its start.")
                self._begin()
            self._stamp = now
            file.seek(self._octets)
            octets = file.read()
        octets = octets[: octets.rfind(b"\n") + 1]
        self._octets += len(octets)
        found = list[AisPosition]()
        for line in octets.decode("utf-8-sig", errors="replace").splitlines():
            self._lines += 1
            if not line.strip() or line.startswith("#"):
                continue
            if self._table.header is None:
                self._table.read_header(self._lines, line.strip())
                continue
            found += self._feed.each([(self._lines, line)], lambda one: _report(self._table.read(one)))
        near = [one for one in found if np.hypot(*self._placed(one)) < FURTHEST_M]
        return in_frame(near, self._frame, str(self._path)) if near else []

    def _placed(self, report: AisPosition) -> Array:
        (place,) = self._frame.to_local(np.array([(report.lon_deg, report.lat_deg)]))
        return np.asarray(place)


def in_frame(reports: list[AisPosition], frame: LocalFrame, name: str) -> list[tuple[AisPosition, Array, Array]]:
    """Return reports with place and velocity, ``(2,)`` each [m, m/s], NaN where it is not told; far ones are left out.

    Raises
    ------
    DataError
        If all are far.
    """
    places = frame.to_local(np.array([(one.lon_deg, one.lat_deg) for one in reports]))
    away = np.hypot(*places.T)
    near = away < FURTHEST_M
    if not near.any():
        turned = frame.to_local(np.array([(one.lat_deg, one.lon_deg) for one in reports if abs(one.lon_deg) <= 90]))
        swapped = len(turned) and np.median(np.hypot(*turned.T)) < FURTHEST_M
        advice = "lon_deg and lat_deg look exchanged." if swapped else "check the places and --radar-lon-deg."
        raise DataError(
            f"{name}: all {len(reports)} reports lie {away.min() / 1000:.0f} km or more from the radar; {advice}"
        )
    found = []
    for report, place, kept in zip(reports, places, near, strict=True):
        course = 0.0 if report.sog_mps == 0 else report.cog_rad
        if kept:
            found.append((report, place, report.sog_mps * np.array([math.sin(course), math.cos(course)])))
    return found


def _named(file: Path) -> bool:
    """Whether a table, not sentences, stands in a file of text."""
    return set("!$\\").isdisjoint(first_line(file))
