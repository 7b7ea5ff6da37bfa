"""NMEA 0183 sentences (IEC 61162-1): when a line was received, and where its own ship says that it is and heads.

RMC, GGA and GLL tell places, ZDA dates, HDT, THS and HDG headings; other sentences are passed over.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from elusive.errors import DataError

SENTENCE = re.compile(r"\$[A-Z]{2}(RMC|GGA|GLL|ZDA|HDT|THS|HDG)(,[^*$!\\]*)\*([0-9A-Fa-f]{2})", re.ASCII)
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
    now_s, variation = math.nan, math.nan
    for came_s, line in lines:
        sentence = SENTENCE.search(line)
        if sentence is None or int(sentence[3], 16) != checksum(sentence[0][1:-3]):
            continue
        kind, fields = sentence[1], [*sentence[2][1:].split(","), *[""] * 12]
        try:
            if kind == "ZDA":
                now_s = _moment(fields[0], f"{fields[1]}{fields[2]}{fields[3][2:4]}")
            elif kind == "RMC" and fields[1] == "A":
                now_s = _moment(fields[0], fields[8])
                variation = _signed(fields[9], fields[10]) if fields[9] else variation
                yield OwnFix(now_s, *_place(fields[2:6]))
            elif (kind == "GGA" and fields[5] not in ("", "0")) or (kind == "GLL" and fields[5] == "A"):
                clock, place = (fields[0], fields[1:5]) if kind == "GGA" else (fields[4], fields[:4])
                latest_s = now_s if math.isnan(came_s) else came_s
                if not math.isnan(latest_s):
                    now_s = _near(_seconds(clock), latest_s)
                    yield OwnFix(now_s, *_place(place))
            elif kind in ("HDT", "THS", "HDG"):
                if kind == "HDG":
                    variation = _signed(fields[3], fields[4]) if fields[3] else variation
                    heading = float(fields[0]) + (_signed(fields[1], fields[2]) if fields[1] else 0.0) + variation
                else:
                    heading = math.nan if kind == "THS" and fields[1] == "V" else float(fields[0])
                time_s = now_s if math.isnan(came_s) else came_s
                if math.isfinite(heading + time_s):
                    yield OwnFix(time_s, heading_rad=math.radians(heading % 360))
        except ValueError:  # a field that is empty or no number: the instrument does not know
            continue


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

    Raises
    ------
    DataError
        If the file cannot be read.
    """
    try:
        with Path(path).open(encoding="ascii", errors="replace") as file:
            for line in file:
                yield line.strip()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); check the path.") from None


def checksum(text: str) -> int:
    """Return the exclusive or of a sentence's octets."""
    value = 0
    for octet in text.encode("ascii", "replace"):
        value ^= octet
    return value


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
    lat_deg, lon_deg = int(lat[:2]) + float(lat[2:]) / 60, int(lon[:3]) + float(lon[3:]) / 60
    if north not in ("N", "S") or east not in ("E", "W") or lat_deg > 90 or lon_deg > 180:
        raise ValueError(fields)
    return (-lon_deg if east == "W" else lon_deg), (-lat_deg if north == "S" else lat_deg)
