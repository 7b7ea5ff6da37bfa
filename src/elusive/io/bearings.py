"""Bearings from files, gathered by time, and the places of the sensors that took them: tables in CSV, read lazily."""

from __future__ import annotations

import difflib
import math
import os
import warnings
from collections.abc import Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elusive.errors import DataError
from elusive.io._link_lines import lines_of
from elusive.io.csv_files import read_lines
from elusive.io.truth import NUMBER
from elusive.sensors.bearing_sets import BearingSet, SensorSites

COLUMNS = ("time_s", "sensor", "azimuth_deg", "elevation_deg")
SENSOR_COLUMNS = ("sensor", "x_m", "y_m", "z_m")
SUSPECT_AFTER = 50  # azimuths, none of them above 2 pi, after which radians are suspected
DEGREE = math.pi / 180


@dataclass(frozen=True)
class BearingSource:
    """Bearings of one emitter in the order of time, read afresh at each iteration and never held whole in memory."""

    name: str
    sites: SensorSites
    follow: bool = False
    idle_s: float | None = None

    def __iter__(self) -> Iterator[BearingSet]:
        """Yield the bearings of each time.

        A time is complete once a later one comes, or at the end.

        Warns
        -----
        UserWarning
            If the azimuths look like radians, or all are of one sensor, whose distance cannot be told.

        Raises
        ------
        DataError
            If a line cannot be read, names an unknown sensor or goes back in time, or there is none; the sentence
            says where.
        """
        time_s, gathered = math.nan, list[tuple[int, float, float]]()
        count, greatest, seen = 0, 0.0, set[int]()
        with closing(_rows(self)) as rows:
            for now_s, sensor, azimuth, elevation in rows:
                if gathered and now_s != time_s:
                    yield _set_of(time_s, gathered)
                    gathered = []
                time_s = now_s
                gathered.append((sensor, azimuth * DEGREE, elevation * DEGREE))
                count, greatest = count + 1, max(greatest, abs(azimuth))
                seen.add(sensor)
                if count == SUSPECT_AFTER and greatest <= 2 * math.pi:
                    warnings.warn(
                        f"{self.name}: none of the first {count} azimuths is above {greatest:.3g}; they are read as "
                        "degrees and look like radians. Convert them if they are.",
                        stacklevel=2,
                    )
        if not gathered:
            raise DataError(f"{self.name}: holds no bearing; write {','.join(COLUMNS[:3])}, one bearing a line.")
        yield _set_of(time_s, gathered)
        if len(seen) == 1:
            warnings.warn(
                f"{self.name}: all bearings are of sensor {self.sites.names[seen.pop()]!r}; one sensor gives no "
                "distance, and the track is as good as what is assumed of it. Add another sensor.",
                stacklevel=2,
            )


def open_bearings(
    path: str | os.PathLike[str], sites: SensorSites, *, follow: bool = False, idle_s: float | None = None
) -> BearingSource:
    """Open a table of bearings without reading it.

    Parameters
    ----------
    path
        CSV, its first line ``time_s,sensor,azimuth_deg`` and, where measured, ``elevation_deg``; a bearing a line.
        Times do not go back; ``sensor`` is a name of the table of sensors; the azimuth is clockwise from north (-360
        to 360), the elevation above the horizon (-90 to 90, or empty). ``-``: standard input.
    sites
        From :func:`read_sensors`.
    follow
        Whether to wait for more where the file ends.
    idle_s
        With ``follow``: end after this time without a new line; None waits for ever.

    Raises
    ------
    DataError
        If there is no such file.
    """
    if str(path) != "-" and not Path(path).is_file():
        raise DataError(f"{path}: {'is a folder' if Path(path).is_dir() else 'there is no such file'}; check the path.")
    return BearingSource(str(path), sites, follow, idle_s)


def read_sensors(path: str | os.PathLike[str]) -> SensorSites:
    """Read where sensors stand.

    Parameters
    ----------
    path
        CSV, its first line ``sensor,x_m,y_m`` and perhaps ``z_m``, a sensor a line [m east, north, up].

    Raises
    ------
    DataError
        If the file cannot be read, a line is no place, a name comes twice, or there is none; the sentence says where.
    """
    header: list[str] | None = None
    names: list[str] = []
    places: list[list[float]] = []
    for number, line in enumerate(read_lines(path), 1):
        if not line.strip() or line.startswith("#"):
            continue
        where = f"{path}, line {number}"
        if header is None:
            header = _header(line, SENSOR_COLUMNS, where)
            continue
        record = _record(line, header, where)
        if not record["sensor"] or record["sensor"] in names:
            raise DataError(f"{where}: the sensor's name {record['sensor']!r:.60} is empty or taken; give another.")
        names.append(record["sensor"])
        places.append([_number(record.get(name, "0"), name, where) for name in SENSOR_COLUMNS[1:]])
    if not names:
        raise DataError(f"{path}: holds no sensor; write {','.join(SENSOR_COLUMNS[:3])}, one sensor a line.")
    return SensorSites(tuple(names), np.array(places))


def _rows(source: BearingSource) -> Generator[tuple[float, int, float, float], None, None]:
    header: list[str] | None = None
    index = {name: row for row, name in enumerate(source.sites.names)}
    before = -math.inf
    with closing(lines_of(source.name, source.follow, source.idle_s)) as lines:
        for number, line in lines:
            if line.startswith("#"):
                continue
            where = f"{source.name}, line {number}"
            if header is None:
                header = _header(line, COLUMNS, where)
                continue
            record = _record(line, header, where)
            time_s = _number(record["time_s"], "time_s", where)
            if time_s < before:
                raise DataError(f"{where}, column time_s: {time_s:g} comes after {before:g}; sort the lines by time.")
            before = time_s
            if record["sensor"] not in index:
                raise DataError(f"{where}: {_unknown(record['sensor'], source.sites.names)}")
            azimuth = _number(record["azimuth_deg"], "azimuth_deg", where)
            if abs(azimuth) > 360:
                raise DataError(f"{where}, column azimuth_deg: {azimuth:g} is not from -360 to 360 degrees.")
            cell = record.get("elevation_deg", "")
            elevation = math.nan if cell.lower() in ("", "nan") else _number(cell, "elevation_deg", where)
            if abs(elevation) > 90:
                raise DataError(f"{where}, column elevation_deg: {elevation:g} is not from -90 to 90 degrees.")
            yield time_s, index[record["sensor"]], azimuth, elevation
    if header is None:
        raise DataError(f"{source.name}: is empty; write {','.join(COLUMNS[:3])}, one bearing a line.")


def _header(line: str, columns: tuple[str, ...], where: str) -> list[str]:
    names = [cell.strip().strip('"') for cell in line.split(",")]
    missing = [name for name in columns[:3] if name not in names]
    if missing or len(set(names)) < len(names) or not set(names) <= set(columns):
        raise DataError(
            f"{where}: the columns are {','.join(names)!r:.80}; name them {','.join(columns[:3])} and perhaps "
            f"{columns[3]}."
        )
    return names


def _record(line: str, header: list[str], where: str) -> dict[str, str]:
    cells = [cell.strip().strip('"') for cell in line.split(",")]
    if len(cells) != len(header):
        raise DataError(f"{where}: has {len(cells)} cells for {len(header)} columns: {line!r:.80}; repair it.")
    return dict(zip(header, cells, strict=True))


def _number(cell: str, name: str, where: str) -> float:
    value = float(cell) if NUMBER.fullmatch(cell) else math.nan
    if not math.isfinite(value):
        raise DataError(f"{where}, column {name}: {cell!r:.60} is no number; write a finite one.")
    return value


def _unknown(name: str, names: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(names)[:80]}."
    return f"there is no sensor {name!r:.60}; {hint}"


def _set_of(time_s: float, rows: list[tuple[int, float, float]]) -> BearingSet:
    sensor, azimuth, elevation = zip(*rows, strict=True)
    return BearingSet(time_s, np.array(sensor), np.array(azimuth), np.array(elevation))
