"""The way of the ship that a radar stands on, from a log beside the plots: NMEA sentences, or a table."""

from __future__ import annotations

import math
import os
import re
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io._table_lines import table_lines
from elusive.io.nmea import OwnFix, read_own_fixes, text_lines
from elusive.sensors.own_track import OwnTrack

FIRST_LINES = 200  # in which a log of sentences has one
ANY = re.compile(r"[$!][A-Z]{2,5}[A-Z]{3},", re.ASCII)
HEADING_S = 10.0  # for which a heading holds at most, before and after


class OwnShipLog(NamedTuple):
    """Fixes in the order of time."""

    name: str
    time_s: Array  # (n,) after 1970 began
    lonlat_deg: Array  # (n, 2)
    heading_time_s: Array  # (h,)
    heading_rad: Array  # (h,) of the bow, clockwise from true north, without jumps of a turn

    def track(self, frame: LocalFrame, since_s: float) -> OwnTrack:
        """Return the way in a frame, by times that count from ``since_s`` after 1970 began.

        Raises
        ------
        DataError
            If no ship moves like that.
        """
        track = OwnTrack(self.name)
        for time_s, (x, y) in zip(self.time_s - since_s, frame.to_local(self.lonlat_deg), strict=True):
            track.add(float(time_s), float(x), float(y))
        return track

    def heading_at(self, unix_s: float) -> float:
        """Return the heading at a time [rad]; NaN where none was told near it."""
        k = int(np.searchsorted(self.heading_time_s, unix_s))
        near = self.heading_time_s[max(k - 1, 0) : k + 1]
        if not len(near) or np.abs(near - unix_s).min() > HEADING_S:
            return math.nan
        return float(np.interp(unix_s, self.heading_time_s, self.heading_rad))


def read_own_ship(path: str | os.PathLike[str]) -> OwnShipLog:
    """Read a log.

    Parameters
    ----------
    path
        NMEA sentences (:mod:`elusive.io.nmea`), or a table of ``time`` (ISO 8601) or ``time_s`` (after 1970 began),
        ``lon_deg``, ``lat_deg`` and perhaps ``heading_deg``.

    Raises
    ------
    DataError
        If the file cannot be read or tells no place.
    """
    if any(ANY.search(line) for line in islice(text_lines(path), FIRST_LINES)):
        fixes = list(read_own_fixes(path))
    else:
        fixes = _table(Path(path))
    fixes.sort(key=lambda fix: fix.time_s)
    placed = [fix for fix in fixes if not math.isnan(fix.lon_deg)]
    headed = [fix for fix in fixes if not math.isnan(fix.heading_rad)]
    return OwnShipLog(
        str(path),
        np.array([fix.time_s for fix in placed]),
        np.array([(fix.lon_deg, fix.lat_deg) for fix in placed]).reshape(-1, 2),
        np.array([fix.time_s for fix in headed]),
        np.unwrap([fix.heading_rad for fix in headed]),
    )


def _table(path: Path) -> list[OwnFix]:
    needed, found = ("time|time_s", "lon_deg", "lat_deg"), list[OwnFix]()
    with closing(table_lines(path, needed, ("heading_deg",), "one place of the ship a line")) as lines:
        for line in lines:
            time_s = line.time_s()
            lon, lat = line.number("lon_deg", most=360), line.number("lat_deg", most=90)
            heading = line.number("heading_deg", most=360, absent=math.nan)
            found.append(OwnFix(time_s, lon, lat, math.radians(heading % 360)))
    if not found:
        raise DataError(f"{path}: tells no place; write time,lon_deg,lat_deg, one place of the ship a line.")
    return found
