"""Radar plots from files, as scans: a table in CSV, read and written exactly, or ASTERIX category 048."""

from __future__ import annotations

import csv
import math
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from decimal import Context, Decimal
from itertools import islice
from pathlib import Path

import numpy as np

from elusive.errors import DataError
from elusive.io._own_way import own_way
from elusive.io._radar_columns import COLUMNS, OWN
from elusive.io._radar_lines import DEGREE_RAD, PlotTable, radians_of
from elusive.io.asterix import asterix_plots, summarize_asterix
from elusive.io.atomic import atomic_path
from elusive.io.csv_files import number_text
from elusive.sensors.own_track import OwnTrack
from elusive.sensors.radar_rotation import MOST, rotation_of
from elusive.sensors.radar_scans import TURN_RAD, RadarPlot, RadarScan, scans_by_rotation

TABLES = (".csv", ".tsv", ".txt")
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
    file = Path(path)
    if not file.is_file():
        raise DataError(f"{path}: {'is a folder' if file.is_dir() else 'there is no such file'}; check the path.")
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
        found = rotation_of(_first(plots(Counter(), way.track())))
        if table and not found.needed:
            turn_s = None
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


def _first(plots: Iterator[RadarPlot]) -> list[RadarPlot]:
    """Return the first plots; a fault among them is left to whoever reads on, where it does not hide them all."""
    found: list[RadarPlot] = []
    try:
        found.extend(islice(plots, MOST))
    except DataError:
        if not found:
            raise
    return found


def write_radar_plots_csv(path: str | os.PathLike[str], scans: Iterable[RadarScan], *, moving: bool = False) -> None:
    """Write scans as CSV, whole or not at all; :func:`open_radar_plots` reads back the same numbers.

    Parameters
    ----------
    path
        File to write.
    scans
        In the order of time, taken one by one. Each plot is written with its own time.
    moving
        Whether the radar's own places are written, at each plot's time.

    Raises
    ------
    DataError
        If a scan contradicts itself or comes before another, or the file cannot be written.
    """
    before = -math.inf
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*COLUMNS, *OWN[0]] if moving else COLUMNS)
        for number, scan in enumerate(scans, 1):
            fault, times_s = _fault_of(scan, before), scan.times_s if len(scan.times_s) else [scan.time_s]
            if fault:
                raise DataError(f"{path}: scan {number} {fault}.")
            before = float(times_s[-1])
            if not len(scan.times_s):
                writer.writerow([number_text(scan.time_s), "", "", "", *_own(scan, scan.time_s, moving)])
            for time_s, range_m, bearing_rad, doppler_mps in zip(*scan.plots, strict=True):
                numbers = number_text(time_s), number_text(range_m), _degrees_text(bearing_rad)
                writer.writerow([*numbers, number_text(doppler_mps), *_own(scan, time_s, moving)])


def _own(scan: RadarScan, time_s: float, moving: bool) -> list[str]:
    """Write where the radar is at a time of its scan."""
    x, vx, y, vy = scan.own
    later = time_s - scan.time_s
    return [number_text(x + later * vx), number_text(y + later * vy)] if moving else []


def _fault_of(scan: RadarScan, before: float) -> str | None:
    times_s, range_m, bearing_rad, doppler_mps = (np.asarray(part) for part in scan.plots)
    if not times_s.shape == range_m.shape == bearing_rad.shape == doppler_mps.shape == (times_s.size,):
        return "has arrays of different lengths; give each plot a time, a range, a bearing and a Doppler or NaN"
    every = times_s if times_s.size else np.array([scan.time_s])
    if not np.isfinite(every).all() or every[0] <= before or (np.diff(every) < 0).any():
        return f"has the time {every[0]:g} after {before:g}; times must be finite and go forwards"
    if not (np.isfinite(range_m) & (range_m >= 0)).all():
        return "has a range below 0 or not finite"
    if not ((bearing_rad >= 0) & (bearing_rad < TURN_RAD)).all():
        return "has a bearing outside 0 to 2 pi; give it in radians clockwise from north"
    return "has an infinite Doppler; leave unknown ones NaN" if np.isinf(doppler_mps).any() else None


def _degrees_text(angle_rad: float) -> str:
    """Write an angle in degrees, in the fewest digits that read back exactly."""
    degrees = Decimal(float(angle_rad)) / DEGREE_RAD
    # 15 digits are as many as survive in a float, 19 part any two floats that are neighbours
    texts = (f"{Context(prec=digits).plus(degrees).normalize():f}" for digits in range(15, 21))
    return next(text for text in texts if radians_of(text) == float(angle_rad))
