"""Bearings and times of arrival from files, gathered by time, and the places of the sensors: read lazily."""

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
from elusive.io._table_lines import table_lines
from elusive.sensors.arrival_times import ArrivalSet
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.sensors.hybrid import HybridSet

NEEDED, AZIMUTH, ELEVATION, ARRIVAL = ("time_s", "sensor"), "azimuth_deg", "elevation_deg", "arrival_s"
LABEL = "emitter"
SENSOR_COLUMNS = ("x_m", "y_m", "z_m")
BEARING_A_LINE = "one bearing a line"
SUSPECT_AFTER = 50  # azimuths, none of them above 2 pi, after which radians are suspected
Row = tuple[int, float, float, float]  # sensor, azimuth, elevation [rad], arrival [s]; NaN where there is none


@dataclass(frozen=True)
class BearingSource:
    """What sensors report in the order of time, read afresh at each iteration and never held whole."""

    name: str
    sites: SensorSites
    follow: bool = False
    idle_s: float | None = None

    def __iter__(self) -> Iterator[PlaceSet]:
        """Yield what is reported at each time.

        A time is complete once a later one comes, or at the end. The columns decide what is yielded: a BearingSet, an
        ArrivalSet, or with both kinds of column a HybridSet.

        Warns
        -----
        UserWarning
            If the azimuths look like radians, or all are of one sensor, which gives no distance.

        Raises
        ------
        DataError
            If a line cannot be read, names an unknown sensor or goes back in time, or there is none, or the lines name
            emitters; the sentence says where.
        """
        for label, measurement in self.labelled():
            if label:
                raise DataError(
                    f"{self.name}: names emitters in its column {LABEL}; here one is needed: give the lines of "
                    f"{label!r:.60} alone, without that column."
                )
            yield measurement

    def labelled(self) -> Iterator[tuple[str, PlaceSet]]:
        """Yield what is reported of each emitter at each time, and its label; empty where the lines name none.

        Warns and raises as iteration does.
        """
        gathered, time_s, seen = dict[str, list[Row]](), math.nan, set[int]()
        azimuths, greatest = 0, 0.0
        kind: type = BearingSet
        with closing(self._rows()) as rows:
            for now_s, kind, label, row in rows:
                if gathered and now_s != time_s:
                    yield from ((of, _set_of(kind, time_s, lines)) for of, lines in gathered.items())
                    gathered = {}
                time_s = now_s
                gathered.setdefault(label, []).append(row)
                seen.add(row[0])
                if math.isfinite(row[1]):
                    azimuths, greatest = azimuths + 1, max(greatest, abs(math.degrees(row[1])))
                    if azimuths == SUSPECT_AFTER and greatest <= 2 * math.pi:
                        warnings.warn(
                            radians_suspected(self.name, f"the first {azimuths} azimuths", greatest), stacklevel=2
                        )
        if not gathered:
            raise DataError(f"{self.name}: holds no bearing; write {','.join((*NEEDED, AZIMUTH))}, {BEARING_A_LINE}.")
        yield from ((of, _set_of(kind, time_s, lines)) for of, lines in gathered.items())
        if len(seen) == 1:
            warnings.warn(
                f"{self.name}: all bearings are of sensor {self.sites.names[seen.pop()]!r}; one sensor gives no "
                "distance, and the track is as good as what is assumed of it. Add another sensor.",
                stacklevel=2,
            )

    def _rows(self) -> Generator[tuple[float, type, str, Row], None, None]:
        index = {name: row for row, name in enumerate(self.sites.names)}
        before = -math.inf
        lines = table_lines(
            self.name,
            NEEDED,
            (ELEVATION, LABEL),
            BEARING_A_LINE,
            either=(AZIMUTH, ARRIVAL),
            follow=self.follow,
            idle_s=self.idle_s,
        )
        with closing(lines):
            for line in lines:
                angles, arrivals = AZIMUTH in line.cells, ARRIVAL in line.cells
                time_s = line.number("time_s")
                if time_s < before:
                    raise DataError(
                        f"{line.where}, column time_s: {time_s:g} comes after {before:g}; sort the lines by time."
                    )
                before = time_s
                if line.cells["sensor"] not in index:
                    raise DataError(f"{line.where}: {_unknown(line.cells['sensor'], self.sites.names)}")
                label = line.cells.get(LABEL, "")
                if LABEL in line.cells and not label:
                    raise DataError(f"{line.where}, column {LABEL}: is empty; name the emitter, or drop the column.")
                may_lack = math.nan if arrivals else None
                row = (
                    index[line.cells["sensor"]],
                    math.radians(line.number(AZIMUTH, most=360, absent=may_lack)) if angles else math.nan,
                    math.radians(line.number(ELEVATION, most=90, absent=math.nan)),
                    line.number(ARRIVAL, absent=math.nan if angles else None) if arrivals else math.nan,
                )
                yield time_s, HybridSet if angles and arrivals else BearingSet if angles else ArrivalSet, label, row


def open_bearings(
    path: str | os.PathLike[str], sites: SensorSites, *, follow: bool = False, idle_s: float | None = None
) -> BearingSource:
    """Open a table of bearings, of times of arrival, or of both, without reading it.

    Parameters
    ----------
    path
        CSV, its first line ``time_s,sensor,azimuth_deg`` and, where measured, ``elevation_deg``; a bearing a line.
        Times do not go back; ``sensor`` is a name of the table of sensors; the azimuth is clockwise from north (-360
        to 360), the elevation above the horizon (-90 to 90, or empty). ``arrival_s`` beside or in place of
        ``azimuth_deg`` is when a signal came in: since its emission or, where that is not known, since any instant
        that is common to the sensors at that time. ``emitter``, where there is that column, names whose a line is.
        ``-``: standard input.
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
    needed = ("sensor", *SENSOR_COLUMNS[:2])
    places = dict[str, list[float]]()
    for line in table_lines(path, needed, SENSOR_COLUMNS[2:], "one sensor a line"):
        name = line.cells["sensor"]
        if not name or name in places:
            raise DataError(f"{line.where}: the sensor's name {name!r:.60} is empty or taken; give another.")
        places[name] = [line.number(column) for column in SENSOR_COLUMNS if column in line.cells]
    if not places:
        raise DataError(f"{path}: holds no sensor; write {','.join(needed)}, one sensor a line.")
    table = np.zeros((len(places), 3))
    for row, place in zip(table, places.values(), strict=True):
        row[: len(place)] = place
    return SensorSites(tuple(places), table)


def radians_suspected(name: str, which: str, greatest: float) -> str:
    """Say that azimuths of a file look like radians."""
    return (
        f"{name}: none of {which} is above {greatest:.3g}; they are read as degrees and look like radians. Convert "
        "them if they are."
    )


def _unknown(name: str, names: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(names)[:80]}."
    return f"there is no sensor {name!r:.60}; {hint}"


def _set_of(kind: type, time_s: float, rows: list[Row]) -> PlaceSet:
    sensor, azimuth, elevation, arrival = (np.array(column) for column in zip(*rows, strict=True))
    bearing, came = np.isfinite(azimuth), np.isfinite(arrival)
    bearings = BearingSet(time_s, sensor[bearing], azimuth[bearing], elevation[bearing])
    arrivals = ArrivalSet(time_s, sensor[came], arrival[came])
    return bearings if kind is BearingSet else arrivals if kind is ArrivalSet else HybridSet(time_s, bearings, arrivals)
