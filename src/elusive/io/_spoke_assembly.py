"""Spokes put together from packets: with their times, and with the heading and place that sentences among them tell."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.io._asterix_video import CATEGORY, VideoMessages
from elusive.io._internet import Datagram
from elusive.io._navico import NavicoPackets, is_navico
from elusive.io._octet_order import OctetOrder
from elusive.io._own_ship import OwnShip
from elusive.io._sentences import Sentences
from elusive.io._spoke_clock import TURN_RAD, SpokeClock
from elusive.io._spoke_parts import SpokeParts
from elusive.sensors.spokes import Spokes

ASTERIX, NAVICO = "packets of ASTERIX category 240", "packets of a Navico"  # as they are counted
TOGETHER = 32  # spokes that are handed over at once
HOLD_S = 1.0  # for which spokes wait, so that heading and position are known before and after them
MAX_HELD = 4096  # parts that wait
DAY_S = 86_400.0
AHEAD_S = 2.0  # by which two clocks may differ without a remark


class UntimedError(Exception):
    """Nothing tells the times of spokes."""


class _Timed(NamedTuple):
    part: SpokeParts
    time_s: Array  # (n,) of each spoke
    came_s: Array  # (n,) the same by the clock of whoever received it


class Assembly:
    """Takes packets, gives spokes of one radar.

    Parameters
    ----------
    counts
        What was met; added to.
    radar
        The one to read where a source holds several; else the first that comes.
    rotation_s
        Period of the antenna, for spokes of which nothing tells a time.
    from_bow
        Whether azimuths of category 240 count from the bow, and not from north as the standard has it.
    """

    def __init__(
        self,
        counts: Counter[str],
        radar: str | None = None,
        rotation_s: float | None = None,
        from_bow: bool = False,
    ) -> None:
        self.radar, self.own, self.ahead_s = radar, OwnShip(), math.nan
        self._counts, self._rotation_s = counts, rotation_s
        self._sentences, self._messages, self._navico = Sentences(), VideoMessages(from_bow), NavicoPackets()
        self._clock, self._order = SpokeClock(), OctetOrder()
        self._untimed: list[tuple[SpokeParts, float]] = []
        self._group: list[_Timed] = []
        self._together = 0  # spokes of the group
        self._held: deque[list[_Timed]] = deque()
        self._stamp_s = self._azimuth_rad = self._first_s = math.nan
        self._width: tuple[tuple[Any, ...], int] = ((), 0)

    def remarks(self) -> list[str]:
        """Return what is to be said of the radar's clock."""
        if not abs(self.ahead_s) > AHEAD_S:
            return []
        way = "ahead of" if self.ahead_s > 0 else "behind"
        return [
            f"The radar's clock is {abs(self.ahead_s):.1f} s {way} that of the capture: times of spokes are the "
            "radar's, and those of AIS are the capture's."
        ]

    @property
    def from_north_unasked(self) -> bool:
        """Whether azimuths were taken to count from north, and a heading was told that they could count from."""
        return bool(self._counts[ASTERIX] and self.own.headings) and not self._messages.told_azimuths

    @property
    def lowest_first(self) -> bool:
        """Whether amplitudes of several octets are read with the lowest first."""
        return self._order.lowest_first

    def take(self, datagram: Datagram) -> Iterator[Spokes]:
        """Take in a packet; yield the spokes that are complete now."""
        octets, came_s = datagram.payload, datagram.unix_s
        if is_navico(octets):
            self._counts[NAVICO] += 1
            self._add(self._navico.read(octets, came_s, datagram.source, datagram.destination, self._counts))
        elif (sentences := self._sentences.read(datagram)) is not None:
            for sentence in sentences:
                self._counts["sentences"] += 1
                self.own.hear(came_s, sentence)
        elif octets[0] == CATEGORY:
            self._counts[ASTERIX] += 1
            self._add(self._messages.read(octets, came_s, self._counts))
        else:
            self._navico.hear(octets, datagram.source)
            known = len(octets) > 2 and int.from_bytes(octets[1:3]) == len(octets)
            self._counts[f"category {octets[0]}" if known else "other packets"] += 1
        yield from self._ready(came_s)

    def rest(self) -> Iterator[Spokes]:
        """Yield what is left when the source has ended."""
        self._add(self._messages.rest())
        self._put_untimed()
        self._close()
        yield from self._ready(math.inf)

    def _add(self, parts: Iterable[SpokeParts]) -> None:
        for part in parts:
            if self.radar is None:
                self.radar = part.radar
            if part.radar != self.radar:
                self._counts[f"spokes of radar {part.radar}"] += len(part.azimuth_rad)
                continue
            self._counts["spokes"] += len(part.azimuth_rad)
            stamp_s = self._stamp(part)
            times_s = self._clock.times_s(part.azimuth_rad, stamp_s)
            if times_s is None:
                self._untimed.append((part, stamp_s))
                continue
            self._put_untimed()
            self._put(part, times_s, stamp_s)

    def _put_untimed(self) -> None:
        for part, stamp_s in self._untimed:
            self._put(part, self._clock.earlier_s(part.azimuth_rad, stamp_s), stamp_s)
        self._untimed = []

    def _stamp(self, part: SpokeParts) -> float:
        """Return the time of a part's last spoke, as exactly as the part or its packet says it.

        Raises
        ------
        UntimedError
            If nothing does.
        """
        azimuth_rad, latest_s, came_s = float(part.azimuth_rad[-1]), self._stamp_s, part.came_s
        if not math.isnan(part.day_s):
            near_s = came_s if math.isnan(latest_s) else latest_s
            day = 0 if math.isnan(near_s) else round((near_s - part.day_s) / DAY_S)
            stamp_s = part.day_s + DAY_S * day
            self.ahead_s = stamp_s - came_s if math.isnan(self.ahead_s) else self.ahead_s
        elif math.isfinite(came_s):
            stamp_s = came_s
        elif self._rotation_s is not None:
            swept = (azimuth_rad - self._azimuth_rad) % TURN_RAD
            stamp_s = 0.0 if math.isnan(latest_s) else latest_s + swept / TURN_RAD * self._rotation_s
        elif math.isfinite(latest_s):
            stamp_s = latest_s
        else:
            raise UntimedError
        self._stamp_s, self._azimuth_rad = stamp_s, azimuth_rad
        return stamp_s

    def _put(self, part: SpokeParts, time_s: Array, stamp_s: float) -> None:
        if self._group and _scale(part) != _scale(self._group[0].part):
            self._close()
        self._group.append(_Timed(part, time_s, time_s + (part.came_s - stamp_s)))
        self._together += len(time_s)
        if self._together >= TOGETHER:
            self._close()

    def _close(self) -> None:
        if self._group:
            self._held.append(self._group)
            self._group, self._together = [], 0

    def _ready(self, now_s: float) -> Iterator[Spokes]:
        """Yield the spokes whose heading and position are known, or are not to be waited for any longer."""
        if math.isnan(self._first_s):
            self._first_s = now_s
        # an instrument that says nothing at first is not waited for any more
        until_s = self.own.known_until_s(now_s - self._first_s <= 2 * HOLD_S)
        while self._held:
            end_s = self._held[0][-1].came_s[-1]
            if until_s >= end_s or not now_s - end_s <= HOLD_S or len(self._held) > MAX_HELD:
                yield from self._spokes(self._held.popleft())
            else:
                return

    def _spokes(self, group: list[_Timed]) -> Iterator[Spokes]:
        first = group[0].part
        amplitude = self._amplitude([timed.part for timed in group])
        if first.heading_rad is None:
            amplitude = self._order.settled(amplitude)
        azimuth_rad = np.concatenate([timed.part.azimuth_rad for timed in group])
        came_s = np.concatenate([timed.came_s for timed in group])
        heading_rad = self.own.heading_rad(came_s)
        said = [np.full(len(t.time_s), np.nan) if t.part.heading_rad is None else t.part.heading_rad for t in group]
        heading_rad = np.where(np.isnan(np.concatenate(said)), heading_rad, np.concatenate(said))
        from_north = ~np.isnan(heading_rad) if first.from_bow else np.ones(len(azimuth_rad), np.bool_)
        if first.from_bow:
            azimuth_rad = np.mod(azimuth_rad + np.where(from_north, heading_rad, 0.0), TURN_RAD)
        whole = Spokes(
            time_s=np.concatenate([timed.time_s for timed in group]),
            azimuth_rad=np.where(azimuth_rad < TURN_RAD, azimuth_rad, 0.0),
            from_north=True,
            start_m=first.start_m,
            step_m=first.step_m,
            amplitude=amplitude,
            bits=first.bits,
            heading_rad=heading_rad,
            lonlat_deg=self.own.lonlat_deg(came_s),
        )
        edges = [0, *(np.flatnonzero(np.diff(from_north)) + 1).tolist(), len(from_north)]
        for start, stop in pairwise(edges):
            yield whole.select_spokes(slice(start, stop))._replace(from_north=bool(from_north[start]))

    def _amplitude(self, parts: list[SpokeParts]) -> NDArray[Any]:
        """Return the samples as one table; spokes that leave their end out have nothing there."""
        scale = _scale(parts[0])
        width = max(part.amplitude.shape[1] for part in parts)
        width = max(width, self._width[1]) if self._width[0] == scale else width
        self._width = scale, width
        wide = np.zeros((sum(len(part.amplitude) for part in parts), width), parts[0].amplitude.dtype)
        at = 0
        for part in parts:
            rows, columns = part.amplitude.shape
            wide[at : at + rows, :columns] = part.amplitude
            at += rows
        return wide


def _scale(part: SpokeParts) -> tuple[Any, ...]:
    return part.from_bow, part.start_m, part.step_m, part.bits, part.amplitude.dtype
