"""Where the radar's own ship is and heads at the time of each spoke, of what its instruments said before and after."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.io.nmea import OwnSentences

STALE_S = 10.0  # after which what was heard says nothing any more
KEPT = 256  # of each instrument's latest
MAX_INSTRUMENTS = 32
# which sentence of several instruments is believed: the lower
RANKS = {"HDT": 0, "THS": 0, "HDG": 1, "HDM": 2, "GGA": 0, "RMC": 0, "GLL": 1}


class _Heard(NamedTuple):
    times_s: deque[float]
    values: deque[tuple[float, ...]]


class OwnShip:
    """Listens to sentences and says heading and position at any time, by the clock of their reception.

    Of several instruments the best that is not silent counts, and of equals the first that was heard: receivers and
    compasses differ, and a mixture would jump.
    """

    def __init__(self) -> None:
        self._sentences = OwnSentences()
        self._headings: dict[str, _Heard] = {}
        self._positions: dict[str, _Heard] = {}

    def hear(self, came_s: float, sentence: str) -> None:
        """Take in a sentence; what does not concern the own ship is passed over."""
        fix = self._sentences.read(came_s, sentence)
        if fix is None or math.isnan(came_s):
            return
        is_place = math.isnan(fix.heading_rad)
        heard = self._positions if is_place else self._headings
        if fix.instrument not in heard:
            if len(heard) >= MAX_INSTRUMENTS:
                return
            heard[fix.instrument] = _Heard(deque(maxlen=KEPT), deque(maxlen=KEPT))
        known = heard[fix.instrument]
        if not known.times_s or came_s >= known.times_s[-1]:
            known.times_s.append(came_s)
            known.values.append((fix.lon_deg, fix.lat_deg) if is_place else (fix.heading_rad,))

    def known_until_s(self, awaited: bool) -> float:
        """Return until when both heading and position have been heard.

        Parameters
        ----------
        awaited
            Whether one of which nothing was heard so far may still come; else it does not count, and the time is
            infinite where neither was heard.
        """
        latest = [max(k.times_s[-1] for k in of.values()) for of in (self._headings, self._positions) if of]
        return -math.inf if awaited and len(latest) < 2 else min(latest, default=math.inf)

    @property
    def headings(self) -> list[str]:
        """The instruments that told headings, the best first."""
        return sorted(self._headings, key=_rank)

    @property
    def positions(self) -> list[str]:
        """The instruments that told positions, the best first."""
        return sorted(self._positions, key=_rank)

    def heading_rad(self, unix_s: Array) -> Array:
        """Return the heading at times that go forwards, clockwise from north, 0 to below 2 pi; NaN where unknown."""
        heard = _best(self._headings, unix_s)
        if heard is None:
            return np.full(len(unix_s), np.nan)
        values = np.unwrap(np.array(heard.values)[:, 0])
        return np.mod(_between(unix_s, np.array(heard.times_s), values), 2 * np.pi)

    def lonlat_deg(self, unix_s: Array) -> Array:
        """Return longitude and latitude at times that go forwards, ``(n, 2)``; NaN where unknown."""
        heard = _best(self._positions, unix_s)
        if heard is None:
            return np.full((len(unix_s), 2), np.nan)
        times_s, values = np.array(heard.times_s), np.array(heard.values)
        lon = _between(unix_s, times_s, np.unwrap(values[:, 0], period=360.0))
        return np.column_stack([np.mod(lon + 180.0, 360.0) - 180.0, _between(unix_s, times_s, values[:, 1])])


def _rank(instrument: str) -> int:
    return RANKS[instrument[-3:]]


def _best(heard: dict[str, _Heard], unix_s: Array) -> _Heard | None:
    """Return the best instrument that was not silent round some times."""
    first_s, last_s = unix_s[0] - STALE_S, unix_s[-1] + STALE_S
    fresh = [name for name, known in heard.items() if known.times_s[-1] >= first_s and known.times_s[0] <= last_s]
    return heard[min(fresh, key=_rank)] if fresh else None


def _between(unix_s: Array, times_s: Array, values: Array) -> Array:
    known = (unix_s >= times_s[0] - STALE_S) & (unix_s <= times_s[-1] + STALE_S)
    return np.where(known, np.interp(unix_s, times_s, values), np.nan)
