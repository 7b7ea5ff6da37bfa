"""A radar's own way through its recording: from its table's columns or from a log beside it, laid under its scans."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io._radar_columns import DEGREES
from elusive.io._radar_lines import PlotTable, TableStart
from elusive.io.own_ship import OwnShipLog, read_own_ship
from elusive.io.sources import Feed
from elusive.sensors.own_track import OwnTrack
from elusive.sensors.radar_scans import TURN_RAD, OwnShip, RadarScan

SAILING_MPS, ALONG = 2.0, math.cos(math.radians(45))  # of a ship whose bow points about where it goes
NORTH_DEG = 1e-3  # to a place north of another


class OwnWay(NamedTuple):
    """Where the radar of a recording is told to be."""

    name: str
    place_deg: tuple[float, float] | None  # origin of the frame; None: not told
    moving: bool
    polar: bool  # plots are told by range and bearing
    log: OwnShipLog | None
    since_s: float  # what the recording's times count from, after 1970 began

    @property
    def frame(self) -> LocalFrame | None:
        """The frame of places."""
        return None if self.place_deg is None else LocalFrame.at(*self.place_deg)

    def track(self) -> OwnTrack | None:
        """Return the way, to be filled as a table is read where that tells it; None: the radar rests."""
        if self.log is not None:
            assert self.frame is not None
            track = self.log.track(self.frame, self.since_s)
            track.to_true_north = self.polar
            return track
        return OwnTrack(self.name) if self.moving else None

    def table(self, path: str | os.PathLike[str], track: OwnTrack | None, feed: Feed | None = None) -> PlotTable:
        """Return a table that is read with this way."""
        heading = None
        if self.log is not None and len(self.log.heading_time_s):
            log = self.log
            heading = lambda time_s: log.heading_at(time_s + self.since_s)  # noqa: E731
        return PlotTable(path, self.frame, track, heading, feed)

    def placed(self, scans: Iterable[RadarScan], track: OwnTrack | None, headings: Counter[str]) -> Iterator[RadarScan]:
        """Lay the way under scans; without a known velocity of the radar a range rate says nothing.

        Counts the scans in which the ship sails with a heading, and those in which that is ``astray``.
        """
        for scan in scans:
            own = None if track is None else track.at(scan.time_s)
            if own is None or track is None:
                yield scan
                continue
            if math.isnan(own.vx_mps):
                scan = scan._replace(doppler_mps=np.full_like(scan.doppler_mps, math.nan))
                own = OwnShip(own.x_m, 0.0, own.y_m, 0.0)
            astray = math.atan2(own.vx_mps, own.vy_mps) - track.heading_rad
            if math.hypot(own.vx_mps, own.vy_mps) > SAILING_MPS and not math.isnan(astray):
                headings["sailing"] += 1
                headings["astray"] += math.cos(astray) < ALONG
            if track.to_true_north and self.frame is not None:
                turned = (scan.bearing_rad + north_at(self.frame, own.x_m, own.y_m)) % TURN_RAD
                scan = scan._replace(bearing_rad=np.where(turned < TURN_RAD, turned, 0.0))
            yield scan._replace(own=own)


def own_way(
    name: str,
    start: TableStart | None,
    place_deg: tuple[float, float] | None,
    own_ship: str | os.PathLike[str] | None,
    since_1970: Callable[[], float],
) -> OwnWay:
    """Return what is told of the radar's way.

    Parameters
    ----------
    name
        Of the recording.
    start
        Of its table; None: it is none.
    place_deg
        Longitude and latitude of the origin, where they are given.
    own_ship
        Log beside it.
    since_1970
        Says when its times begin to count; NaN: not known.

    Raises
    ------
    DataError
        If the two contradict each other, or places in degrees have no origin.
    """
    columns = None if start is None else start.columns
    told = columns is not None and columns.own is not None
    if own_ship is None:
        origin = place_deg or (None if start is None else start.fix)
        if origin is None and columns is not None and {columns.measured[0], *(columns.own or ())} & set(DEGREES):
            raise DataError(f"{name}: tells places in degrees, and not where the radar is; give its place (place_deg).")
        return OwnWay(name, origin, told, columns is None or columns.polar, None, math.nan)
    if told:
        raise DataError(f"{name}: tells in its own columns where the radar was; leave own_ship out, or those columns.")
    since_s = since_1970()
    if math.isnan(since_s):
        raise DataError(
            f"{name}: its times count from a moment that it does not say, and {own_ship} has times of day; write the "
            "column time, as 2026-05-01T12:00:00Z."
        )
    log = read_own_ship(own_ship)
    lon, lat = log.lonlat_deg[0].tolist()
    polar = columns is None or columns.polar
    return OwnWay(name, place_deg or (lon, lat), True, polar, log, since_s)


def north_at(frame: LocalFrame, x_m: float, y_m: float) -> float:
    """Return the angle from the frame's north to true north at a place, clockwise [rad]."""
    (lon, lat), *_ = frame.to_lonlat(np.array([[x_m, y_m]])).tolist()
    step = -NORTH_DEG if lat > 0 else NORTH_DEG  # towards the equator, so that no pole is passed
    x, y = (frame.to_local(np.array([[lon, lat + step]]))[0] - (x_m, y_m)).tolist()
    return math.atan2(x, y) if step > 0 else math.atan2(-x, -y)
