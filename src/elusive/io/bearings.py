"""Bearings and times of arrival from files, gathered by time: read lazily."""

from __future__ import annotations

import difflib
import math
import os
import warnings
from collections.abc import Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from operator import itemgetter

import numpy as np

from elusive.errors import DataError
from elusive.io._opened import existing_file
from elusive.io._table_lines import FORWARDS, TableLine, table_lines
from elusive.io.sensor_files import GEOGRAPHIC, PLACES, Place, Placing
from elusive.io.sources.feed import Feed
from elusive.io.sources.lines import STRICT, comes_once
from elusive.io.sources.order import in_order
from elusive.sensors.arrival_times import ArrivalSet
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.sensors.hybrid import HybridSet

AZIMUTH, ELEVATION, ARRIVAL = "azimuth_deg", "elevation_deg", "arrival_s"
NEEDED = ("time_s|time", "sensor", f"{AZIMUTH}|{ARRIVAL}")
LABEL = "emitter"
BEARING_A_LINE = "one bearing a line"
SUSPECT_AFTER = 50  # azimuths, none of them above 2 pi, after which radians are suspected
Row = tuple[int, float, float, float, Place | None]  # sensor, azimuth, elevation [rad], arrival [s] or NaN; its place


@dataclass(frozen=True)
class BearingSource:
    """What sensors report in the order of time, read afresh at each iteration and never held whole."""

    name: str
    sites: SensorSites
    feed: Feed | None = None
    """Of a live source; None: a recording."""
    moving: bool = False  # whether the lines say where their sensors were

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
            raise DataError(f"{self.name}: holds no bearing; write time_s,sensor,{AZIMUTH}, {BEARING_A_LINE}.")
        yield from ((of, _set_of(kind, time_s, lines)) for of, lines in gathered.items())
        if len(seen) == 1 and not self.moving:
            warnings.warn(
                f"{self.name}: all bearings are of sensor {self.sites.names[seen.pop()]!r}; one sensor gives no "
                "distance, and the track is as good as what is assumed of it. Add another sensor.",
                stacklevel=2,
            )

    def _rows(self) -> Generator[tuple[float, type, str, Row], None, None]:
        feed = self.feed or STRICT
        lines = table_lines(
            self.name, NEEDED, (ELEVATION, LABEL, *PLACES, "z_m", *GEOGRAPHIC), BEARING_A_LINE, self.feed
        )
        with closing(lines):
            rows = feed.each(lines, _Reading(self.sites, ordered=self.feed is None))
            yield from in_order(rows, itemgetter(0), repr, self.feed, lambda row, by_s: (row[0] + by_s, *row[1:]))


class _Reading:
    """Reads lines into rows."""

    def __init__(self, sites: SensorSites, *, ordered: bool) -> None:
        self._placed, self._names, self._ordered = Placing(sites.frame), sites.names, ordered
        self._index = {name: row for row, name in enumerate(sites.names)}
        self._before = -math.inf

    def __call__(self, line: TableLine) -> tuple[float, type, str, Row]:
        """Return a line's time, the kind of its measurement, its label and its row."""
        angles, arrivals = AZIMUTH in line.cells, ARRIVAL in line.cells
        place = self._placed.of(line)
        if place is not None and arrivals:
            raise DataError(f"{line.where}: times of arrival are of sensors that stand; leave the places out.")
        time_s = line.time_s()
        if self._ordered and time_s < self._before:
            raise DataError(
                f"{line.where}, column {line.clock}: {time_s:.10g} comes after {self._before:.10g}; {FORWARDS}."
            )
        self._before = time_s
        if line.cells["sensor"] not in self._index:
            raise DataError(f"{line.where}: {_unknown(line.cells['sensor'], self._names)}")
        label = line.cells.get(LABEL, "")
        if LABEL in line.cells and not label:
            raise DataError(f"{line.where}, column {LABEL}: is empty; name the emitter, or drop the column.")
        may_lack = math.nan if arrivals else None
        row = (
            self._index[line.cells["sensor"]],
            math.radians(line.number(AZIMUTH, most=360, absent=may_lack)) if angles else math.nan,
            math.radians(line.number(ELEVATION, most=90, absent=math.nan)),
            line.number(ARRIVAL, absent=math.nan if angles else None) if arrivals else math.nan,
            place,
        )
        return time_s, HybridSet if angles and arrivals else BearingSet if angles else ArrivalSet, label, row


def open_bearings(
    path: str | os.PathLike[str], sites: SensorSites | None, *, feed: Feed | None = None
) -> BearingSource:
    """Open a table of bearings, of times of arrival, or of both, without reading it.

    Parameters
    ----------
    path
        CSV, its first line ``time_s,sensor,azimuth_deg`` and, where measured, ``elevation_deg``; a bearing a line.
        In place of ``time_s`` a column ``time`` may have date and time as ISO 8601 writes them, which become seconds
        since 1970. Times do not go back; ``sensor`` is a name of the table of sensors; the azimuth is clockwise from
        north (-360 to 360), the elevation above the horizon (-90 to 90, or empty). ``arrival_s`` beside or in place of
        ``azimuth_deg`` is when a signal came in: since its emission or, where that is not known, since any instant
        that is common to the sensors at that time. ``emitter``, where there is that column, names whose a line is.
        ``x_m``, ``y_m`` and perhaps ``z_m``, or ``lon_deg`` and ``lat_deg``, say where a line's sensor was
        that moves. ``-``: standard input; live also ``tcp://``, ``udp://``, ``mqtt://``, lines or JSON objects.
    sites
        From :func:`~elusive.io.sensor_files.read_sensors`; None: those that the lines themselves name and place.
    feed
        Live: how it is followed. A late or repeated line, or one that cannot be used, is left out and counted.

    Raises
    ------
    DataError
        If there is no such file, or no sensor has a place.
    """
    if not comes_once(str(path)):
        existing_file(path)
    if feed is not None or str(path) == "-":
        if sites is None:
            raise DataError(
                "--sensors: is needed live, to know which sensors there are; name them and a place of each."
            )
        return BearingSource(str(path), sites, feed)
    found = _named_sites(str(path), sites)
    return BearingSource(str(path), found or sites or _none_placed(), moving=found is not None)


def _none_placed() -> SensorSites:
    raise DataError("--sensors: is missing, and the lines do not say where sensors are; give it, or columns x_m, y_m.")


def _named_sites(path: str, sites: SensorSites | None) -> SensorSites | None:
    """Return the sensors that the lines of a file name, each at its mean place; None if they tell no places."""
    placed, places = Placing(sites.frame if sites else None), dict[str, list[Place]]()
    perhaps = (ELEVATION, LABEL, *PLACES, "z_m", *GEOGRAPHIC)
    for line in table_lines(path, NEEDED, perhaps, BEARING_A_LINE):
        place = placed.of(line)
        if place is None:
            return None
        places.setdefault(line.cells["sensor"], []).append(place)
    means = np.array([np.mean(of, axis=0) for of in places.values()]).reshape(-1, 3)
    return SensorSites(tuple(places), means, placed.frame) if places else None


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
    *columns, placed = zip(*rows, strict=True)
    sensor, azimuth, elevation, arrival = (np.array(column) for column in columns)
    bearing, came = np.isfinite(azimuth), np.isfinite(arrival)
    places = None if placed[0] is None else np.array(placed)[bearing]
    bearings = BearingSet(time_s, sensor[bearing], azimuth[bearing], elevation[bearing], places)
    arrivals = ArrivalSet(time_s, sensor[came], arrival[came])
    return bearings if kind is BearingSet else arrivals if kind is ArrivalSet else HybridSet(time_s, bearings, arrivals)
