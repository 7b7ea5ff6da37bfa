"""NMEA 0183 sentences (IEC 61162-1): when a line was received, and where its own ship says that it is and heads.

RMC, GGA and GLL tell places, ZDA dates, HDT, THS, HDG and HDM headings; other sentences are passed over.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from io import TextIOWrapper
from typing import NamedTuple

from elusive.errors import DataError
from elusive.io._internet import datagrams
from elusive.io._opened import opened, readable
from elusive.io._sentences import Sentences, exclusive_or
from elusive.io.pcap import frames_of, is_capture

SENTENCE = re.compile(r"\$[A-Z0-9]{2}(RMC|GGA|GLL|ZDA|HDT|THS|HDG|HDM)(,[^*$!\\]*)\*([0-9A-Fa-f]{2})", re.ASCII)
TAG_BLOCK = re.compile(r"\\([^\\]*)\*([0-9A-Fa-f]{2})\\")
TAG_TIME = re.compile(r"(?:^|,)c:(\d+)(?:,|$)", re.ASCII)
TRAILING_TIME = re.compile(r",(\d{9,10})$", re.ASCII)
NUMBER = re.compile(r"\d{9,13}(\.\d*)?", re.ASCII)
MILLISECONDS = 1e11  # a time since 1970 from here on counts them
DAY_S = 86_400.0


class OwnFix(NamedTuple):
    """What a ship's own instruments said at a time; NaN for what they did not."""

    time_s: float  # after 1970 began (UTC)
    lon_deg: float = math.nan
    lat_deg: float = math.nan
    heading_rad: float = math.nan  # of the bow, clockwise from true north
    instrument: str = ""  # its sentence, as GPRMC: who says it, and what kind it is


def read_own_fixes(path: str | os.PathLike[str]) -> Iterator[OwnFix]:
    """Read a log of a ship's own instruments, a sentence a line; see :func:`own_fixes`.

    Raises
    ------
    DataError
        If the file cannot be read, or holds no place with a time.
    """
    found = False
    for fix in own_fixes((received_s(line, SENTENCE.search(line)), line) for line in text_lines(path)):
        found = found or not math.isnan(fix.lon_deg)
        yield fix
    if not found:
        raise DataError(f"{path}: tells no place of the own ship with its date; give a log with RMC, or GGA and ZDA.")


def own_fixes(lines: Iterable[tuple[float, str]]) -> Iterator[OwnFix]:
    """Yield what sentences say, in their order; a heading and a place are told apart from each other.

    Parameters
    ----------
    lines
        When each was received, after 1970 began (NaN: not known), and its text. A place has its sentence's own time,
        on the day that RMC, ZDA or the reception says; before a day is known it is passed over. A heading has the
        time of reception or else that of the latest place. Damaged sentences are passed over, and magnetic headings
        whose variation no HDG or RMC has told.
    """
    sentences = OwnSentences()
    for came_s, line in lines:
        fix = sentences.read(came_s, line)
        if fix is not None:
            yield fix


class OwnSentences:
    """Reads sentences one by one, and keeps the day and the magnetic variation that they tell."""

    def __init__(self) -> None:
        self._now_s = self._variation = math.nan

    def read(self, came_s: float, line: str) -> OwnFix | None:
        """Return what a line says of the own ship, None if nothing; see :func:`own_fixes`."""
        sentence = SENTENCE.search(line)
        if sentence is None or int(sentence[3], 16) != checksum(sentence[0][1:-3]):
            return None
        kind, fields = sentence[1], [*sentence[2][1:].split(","), *[""] * 12]
        try:
            if kind == "ZDA":
                self._now_s = _moment(fields[0], f"{fields[1]}{fields[2]}{fields[3][2:4]}")
                return None
            if kind in ("RMC", "GGA", "GLL"):
                fix = self._place(came_s, kind, fields)
            else:
                time_s = self._now_s if math.isnan(came_s) else came_s
                fix = OwnFix(time_s, heading_rad=math.radians(self._heading_deg(kind, fields) % 360))
                fix = fix if math.isfinite(fix.heading_rad + time_s) else None
        except ValueError:  # a field that is empty or no number: the instrument does not know
            return None
        return fix and fix._replace(instrument=sentence[0][1:6])

    def _place(self, came_s: float, kind: str, fields: list[str]) -> OwnFix | None:
        if kind == "RMC":
            if fields[1] != "A":
                return None
            self._now_s = _moment(fields[0], fields[8])
            self._variation = _signed(fields[9], fields[10]) if fields[9] else self._variation
            return OwnFix(self._now_s, *_place(fields[2:6]))
        valid = fields[5] not in ("", "0") if kind == "GGA" else fields[5] == "A"
        clock, place = (fields[0], fields[1:5]) if kind == "GGA" else (fields[4], fields[:4])
        latest_s = self._now_s if math.isnan(came_s) else came_s
        if not valid or math.isnan(latest_s):
            return None
        # some instruments send places without a time
        self._now_s = _near(_seconds(clock), latest_s) if clock else latest_s
        return OwnFix(self._now_s, *_place(place))

    def _heading_deg(self, kind: str, fields: list[str]) -> float:
        if kind == "HDM":
            return float(fields[0]) + self._variation
        if kind != "HDG":
            return math.nan if kind == "THS" and fields[1] == "V" else float(fields[0])
        self._variation = _signed(fields[3], fields[4]) if fields[3] else self._variation
        return float(fields[0]) + (_signed(fields[1], fields[2]) if fields[1] else 0.0) + self._variation


def received_s(line: str, sentence: re.Match[str] | None) -> float:
    r"""Return when a line's sentence was received, after 1970 began; NaN where it does not say.

    The time stands in a tag block (``\c:1671533231*50\``), before the sentence (such a number, or a date and time,
    UTC where it names no zone), or after it and a comma.
    """
    if sentence is None:
        return math.nan
    lead = line[: sentence.start()]
    tag = TAG_BLOCK.search(lead)
    if tag is not None:
        told = TAG_TIME.search(tag[1]) if int(tag[2], 16) == checksum(tag[1]) else None
        return _since_1970(float(told[1])) if told else math.nan
    trailing = TRAILING_TIME.search(line[sentence.end() :])
    text = lead.strip(" \t,;[]") or (trailing[1] if trailing else "")
    if NUMBER.fullmatch(text):
        return _since_1970(float(text))
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return math.nan
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def text_lines(path: str | os.PathLike[str]) -> Iterator[str]:
    """Yield a log's lines; receivers log noise too: an octet that is no ASCII spoils its own sentence only.

    Of a network capture (pcap, pcapng), the sentences that its packets carry, each after the time of its capture.
    Either may be compressed by gzip.

    Raises
    ------
    DataError
        If the file cannot be read.
    """
    with readable(path), opened(path) as file:
        if is_capture(file.peek(4)[:4]):
            sentences = Sentences()
            for datagram in datagrams(frames_of(file)):
                for sentence in sentences.read(datagram) or ():
                    yield f"{datagram.unix_s:.6f} {sentence}"
        else:
            with TextIOWrapper(file, encoding="ascii", errors="replace") as text:
                for line in text:
                    yield line.strip()


def checksum(text: str) -> int:
    """Return the check sum of a sentence, of what stands between its mark and the star."""
    return exclusive_or(text.encode("ascii", "replace"))


def _since_1970(value: float) -> float:
    return value / 1000 if value >= MILLISECONDS else value


def _seconds(clock: str) -> float:
    """Return the seconds of a day that ``hhmmss.ss`` says."""
    return 3600 * int(clock[:2]) + 60 * int(clock[2:4]) + float(clock[4:])


def _moment(clock: str, date: str) -> float:
    """Return a time of day and a date ``ddmmyy``, after 1970 began."""
    day = datetime(2000 + int(date[4:6]), int(date[2:4]), int(date[:2]), tzinfo=UTC)
    return day.timestamp() + _seconds(clock)


def _near(of_day_s: float, latest_s: float) -> float:
    """Return the time of a day that is nearest to another time."""
    return of_day_s + DAY_S * round((latest_s - of_day_s) / DAY_S)


def _signed(value: str, side: str) -> float:
    return -float(value) if side == "W" else float(value)


def _place(fields: Sequence[str]) -> tuple[float, float]:
    """Return longitude and latitude of ``ddmm.mm, N, dddmm.mm, E``."""
    lat, north, lon, east = fields
    lat_deg, lon_deg = _degrees(lat), _degrees(lon)
    if north not in ("N", "S") or east not in ("E", "W") or lat_deg > 90 or lon_deg > 180:
        raise ValueError(fields)
    return (-lon_deg if east == "W" else lon_deg), (-lat_deg if north == "S" else lat_deg)


def _degrees(text: str) -> float:
    """Read ``dddmm.mm``; not every instrument writes the zeros in front."""
    value = float(text)
    if not 0 <= value < 18_001 or value % 100 >= 60:
        raise ValueError(text)
    return value // 100 + value % 100 / 60
