"""The way of the ship that a radar stands on, from fixes as they come: its place and velocity at the time of a scan."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right

import numpy as np

from elusive.errors import DataError
from elusive.sensors.radar_scans import OwnShip

WINDOW_S = 5.0  # of fixes before and after a time, that tell the velocity
REPEATED_S = 2.5  # for which a fix may be repeated by plots that come between two of them
AHEAD_S = 30.0  # beyond the fixes, at most
FASTEST_MPS, ROOM_M = 60.0, 30.0  # of a ship, and of a fix that jumps


class OwnTrack:
    """Fixes in the order of time; a radar without one stays at the origin.

    Parameters
    ----------
    name
        Of what they come from, for the sentences of failures.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._times: list[float] = []
        self._places: list[tuple[float, float]] = []
        self.heading_rad = math.nan  # of the bow, as told last
        self.to_true_north = False  # whether bearings are from north at the radar, which is not the frame's

    def add(self, time_s: float, x_m: float, y_m: float) -> None:
        """Take in a fix.

        Raises
        ------
        DataError
            If no ship gets there in time from the fix before.
        """
        if self._times:
            gap_s, (x, y) = time_s - self._times[-1], self._places[-1]
            away = math.hypot(x_m - x, y_m - y)
            if gap_s < 0 or (away == 0 and gap_s < REPEATED_S and len(self._times) > 1):
                return
            if away > FASTEST_MPS * gap_s + ROOM_M:
                raise DataError(
                    f"{self._name}: the radar would move {away:.3g} m in {gap_s:.3g} s before {time_s:g} s; give its "
                    "own places, in metres as x_m, y_m or in degrees as lon_deg, lat_deg, and those of plots under "
                    "other names."
                )
            if gap_s == 0:
                return
        self._times.append(time_s)
        self._places.append((x_m, y_m))

    @property
    def moves(self) -> bool:
        """Whether there are fixes, and not all at one place."""
        return len(set(self._places)) > 1

    def at(self, time_s: float) -> OwnShip | None:
        """Return where the ship is: between two fixes, or ahead of the latest; None: there is none.

        Its velocity is NaN where a single fix is known.

        Raises
        ------
        DataError
            If no fix is near that time.
        """
        times, places = self._times, self._places
        if not times:
            return None
        after = bisect_right(times, time_s)
        low, high = max(after - 1, 0), min(after, len(times) - 1)
        if not times[low] - AHEAD_S <= time_s <= times[high] + AHEAD_S:
            raise DataError(
                f"{self._name}: says nothing of the radar's place within {AHEAD_S:g} s of {time_s:g} s; give a log of "
                "the same time (UTC)."
            )
        first = min(bisect_left(times, time_s - WINDOW_S), low)
        last = max(bisect_right(times, time_s + WINDOW_S), high + 1)
        when, where = np.array(times[first:last]) - time_s, np.array(places[first:last])
        if len(when) < 2:
            return OwnShip(places[low][0], math.nan, places[low][1], math.nan)
        off = when - when.mean()
        vx, vy = (off @ (where - where.mean(axis=0)) / (off @ off)).tolist()
        if low < high:
            share = (time_s - times[low]) / (times[high] - times[low])
            x, y = ((1 - share) * a + share * b for a, b in zip(places[low], places[high], strict=True))
        else:
            ahead = time_s - times[low]
            x, y = places[low][0] + ahead * vx, places[low][1] + ahead * vy
        return OwnShip(x, vx, y, vy)
