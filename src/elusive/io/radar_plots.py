"""Radar plots from files, as scans: a table in CSV, read and written exactly, or ASTERIX category 048."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import islice

from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io._opened import existing_file
from elusive.io._own_way import OwnWay, own_way
from elusive.io._radar_columns import COLUMNS
from elusive.io._radar_lines import PlotTable
from elusive.io.asterix import asterix_plots, summarize_asterix
from elusive.io.asterix_live import is_asterix, live_asterix_plots
from elusive.io.sources import Feed
from elusive.sensors.own_track import OwnTrack
from elusive.sensors.radar_rotation import MOST, rotation_of
from elusive.sensors.radar_scans import RadarPlot, RadarScan, scans_by_rotation

TABLES = (".csv", ".tsv", ".txt")
LIVE_JUDGED = 30  # plots by which times are judged live
UNIX_S = 1e8  # a time from here on counts from 1970, not from a midnight


@dataclass(frozen=True)
class RadarSource:
    """A radar's scans, read afresh at each iteration and never held whole in memory."""

    name: str
    _read: Callable[[Counter[str], Counter[str]], Iterator[RadarScan]] = field(repr=False)
    rotation_s: float | None = None
    """Period of the antenna, given or estimated; None: plots of equal times are a scan."""
    estimated: bool = False
    """Whether the period was estimated."""
    ignored: tuple[str, ...] = ()
    """Columns of a table that are not read."""
    place_deg: tuple[float, float] | None = None
    """Longitude and latitude of the frame's origin: as given, or the first that is told of the radar."""
    places: bool = False
    """Whether plots are told by places in metres."""
    moving: bool = False
    """Whether the radar's own places are told over time."""
    since_1970: Callable[[], float] = field(default=lambda: math.nan, repr=False)
    """Says when its times begin to count, in seconds after 1970 began; NaN where it does not tell."""
    counts: Counter[str] = field(default_factory=Counter)
    """What the latest iteration met in an ASTERIX file, so far: see :func:`~elusive.io.asterix.asterix_plots`."""
    headings: Counter[str] = field(default_factory=Counter)
    """Scans of the latest iteration in which the radar's ship sailed with a heading, and went ``astray`` of it."""

    def __iter__(self) -> Iterator[RadarScan]:
        """Yield the scans in the order of time.

        Raises
        ------
        DataError
            If a plot cannot be read, times go backwards, or there is no plot; the sentence says where.
        """
        plots = 0
        self.counts.clear()
        self.headings.clear()
        for scan in self._read(self.counts, self.headings):
            plots += len(scan.range_m)
            yield scan
        if plots == 0:
            raise DataError(f"{self.name}: holds no plot; write {','.join(COLUMNS)}, one plot a line.")


def open_radar_plots(
    path: str | os.PathLike[str],
    *,
    rotation_s: float | None = None,
    radar: tuple[int, int] | None = None,
    place_deg: tuple[float, float] | None = None,
    own_ship: str | os.PathLike[str] | None = None,
) -> RadarSource:
    """Open a radar's plots without reading them all.

    Parameters
    ----------
    path
        ``.csv``, ``.tsv``, ``.txt``: a line of names, then a plot a line: ``time_s``, or ``time`` as ISO 8601 writes
        it, not going backwards; where the plot lies: ``range_m``, ``range_km`` or ``range_nmi`` with ``bearing_deg``,
        from 0 to 360 clockwise from north, or ``relative_bearing_deg``, from the bow; or ``x_m, y_m``, or ``lon_deg,
        lat_deg``; and, where measured, ``doppler_mps``, positive away from the radar, as a radar that moves sees it.
        Where the radar was, if it moves: ``own_x_m, own_y_m`` or ``own_lon_deg, own_lat_deg``, for which beside range
        and bearing ``x_m, y_m`` and ``lon_deg, lat_deg`` stand as well; and ``heading_deg`` of its bow, from true
        north. Other columns are not read. Commas, semicolons or tabs between. A time without range, bearing and
        Doppler is a scan without a plot. Any other file: ASTERIX, raw or as captured from a network (pcap, pcapng);
        see :func:`~elusive.io.asterix.asterix_plots`.
    rotation_s
        Period of the antenna. Given, each of its turns is a scan
        (:func:`~elusive.sensors.radar_scans.scans_by_rotation`). Else plots of equal times are; where plots have times
        of their own, the period is estimated (:mod:`elusive.sensors.radar_rotation`).
    radar
        The radar's two codes (SAC, SIC), for an ASTERIX file that holds several.
    place_deg
        Longitude and latitude of the origin of places: of the radar, if it rests. None: the first that is told.
    own_ship
        Log of the ship that the radar stands on: see :func:`~elusive.io.own_ship.read_own_ship`.

    Returns
    -------
    RadarSource
        The scans. ASTERIX times are seconds after the midnight (UTC) before the first report, ISO times after 1970.

    Raises
    ------
    DataError
        If there is no such file, an argument does not fit it, or plots have times of their own that say no period.
    """
    file = existing_file(path)
    name = str(path)
    table = file.suffix.lower() in TABLES
    if table and radar is not None:
        raise DataError(f"{path}: radar={radar} chooses in an ASTERIX file, and this is a table; leave it out.")
    start = PlotTable(file).start() if table else None

    def since_1970() -> float:
        if start is None:
            return math.nan if table else summarize_asterix(file).midnight_unix_s
        return 0.0 if start.time_s > UNIX_S else math.nan

    way = own_way(name, start, place_deg, own_ship, since_1970)

    def plots(counts: Counter[str], track: OwnTrack | None) -> Iterator[RadarPlot]:
        return way.table(file, track).plots() if table else asterix_plots(file, radar, counts)

    turn_s = rotation_s
    if turn_s is None:
        first = _first(plots(Counter(), way.track()))
        found = rotation_of(first)
        if table and not found.needed:
            turn_s = None
        elif found.period_s is None and rotation_of(_mirrored(first)).period_s is not None:
            raise DataError(
                f"{path}: its bearings fall as the antenna turns, and antennas turn clockwise: bearings look counted "
                "anticlockwise, and ships would be drawn mirrored; take them from 360 degrees, or give rotation_s, the "
                "antenna's period, if it turns the other way."
            )
        elif found.period_s is None:
            raise DataError(
                f"{path}: its plots have each their own time, and with their bearings these do not fit one antenna "
                "that turns clockwise at a steady rate and no other; give rotation_s, the antenna's period, or all "
                "plots of a scan one time."
            )
        else:
            turn_s = found.period_s

    def scans(counts: Counter[str], headings: Counter[str]) -> Iterator[RadarScan]:
        track = way.track()
        if turn_s is None:
            return way.placed(way.table(file, track).scans(), track, headings)
        return way.placed(scans_by_rotation(plots(counts, track), turn_s, name), track, headings)

    return RadarSource(
        name, scans, turn_s, turn_s is not None and rotation_s is None, () if start is None else start.left,
        way.place_deg, start is not None and start.columns.measured[0] == "x_m", way.moving, since_1970,
    )  # fmt: skip


def _mirrored(plots: list[RadarPlot]) -> list[RadarPlot]:
    """Return plots as they are if bearings count the other way round."""
    return [plot._replace(bearing_rad=-plot.bearing_rad, heading_rad=-plot.heading_rad) for plot in plots]


def _first(plots: Iterator[RadarPlot]) -> list[RadarPlot]:
    """Return the first plots; a fault among them is left to whoever reads on, where it does not hide them all."""
    found: list[RadarPlot] = []
    try:
        found.extend(islice(plots, MOST))
    except DataError:
        if not found:
            raise
    return found


def follow_radar_plots(
    source: str,
    feed: Feed,
    *,
    rotation_s: float | None = None,
    place_deg: tuple[float, float] | None = None,
    radar: tuple[int, int] | None = None,
) -> Iterator[RadarScan]:
    """Yield the scans of a table as it is written: each once a later plot has come.

    Parameters
    ----------
    source
        Where its lines come from, see :func:`~elusive.io.sources.lines_of`; the columns as :func:`open_radar_plots`
        takes them. Or ``asterix+udp://host:port``.
    feed
        How it is followed; late, repeated and spoilt lines are left out and counted.
    rotation_s, place_deg, radar
        As :func:`open_radar_plots` takes them; none is estimated. Without ``radar`` it is the one that reports first.

    Raises
    ------
    DataError
        If plots have times of their own and no period is given, or no place where it is needed.
    """
    frame, track = None if place_deg is None else LocalFrame.at(*place_deg), OwnTrack(source)
    if is_asterix(source):
        if rotation_s is None:
            raise DataError(f"{source}: reports have each their own time; give --rotation-s, the antenna's period.")
        turns = scans_by_rotation(live_asterix_plots(source, feed, radar), rotation_s, source)
        yield from OwnWay(source, place_deg, True, True, None, math.nan).placed(turns, track, Counter())
        return
    table = PlotTable(source, frame, track, None, feed)
    scans = _equal_times(table, source) if rotation_s is None else scans_by_rotation(table.plots(), rotation_s, source)
    yield from OwnWay(source, place_deg, True, True, None, math.nan).placed(scans, track, Counter())


def _equal_times(table: PlotTable, name: str) -> Iterator[RadarScan]:
    """Gather plots of equal times, once the first of them do not say that each has its own."""
    first = list[RadarPlot]()
    for scan in table.scans():
        if len(first) < LIVE_JUDGED:
            first += [RadarPlot(*map(float, plot)) for plot in zip(*scan.plots, strict=True)]
            if len(first) >= LIVE_JUDGED and rotation_of(first).needed:
                raise DataError(f"{name}: plots have each their own time; give --rotation-s, the antenna's period.")
        yield scan
