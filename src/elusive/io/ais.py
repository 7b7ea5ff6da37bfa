"""Where ships say they are: AIS position reports from a log of NMEA sentences, as truth to compare tracks with.

ITU-R M.1371 messages 1 to 3, 18, 19 and 27, decoded by pyais (the extra ``ais``); IEC 61162-1 sentences and tag blocks.
"""

from __future__ import annotations

import math
import os
import re
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from elusive.errors import DataError
from elusive.io.nmea import checksum, received_s, text_lines

KNOT_MPS = 1852 / 3600
POSITIONS = frozenset("123BCK")  # first characters of messages 1, 2, 3, 18, 19 and 27
LONG_RANGE = 27
SENTENCE = re.compile(r"!([A-Z0-9]{2}VD[MO],(\d),(\d),(\d?),([^,]?),([0-W`-w]*),[0-5])\*([0-9A-Fa-f]{2})", re.ASCII)
MAX_PENDING = 64  # messages whose other sentences are awaited


class AisPosition(NamedTuple):
    """One position that a ship reported; NaN where it gave no number."""

    time_s: float  # after 1970 began (UTC), when it was received
    mmsi: int
    lon_deg: float
    lat_deg: float
    sog_mps: float  # speed over ground
    cog_rad: float  # course over ground, clockwise from north


def read_ais(
    path: str | os.PathLike[str], *, mmsi: int | None = None, counts: Counter[str] | None = None
) -> Iterator[AisPosition]:
    r"""Read the positions in a log of AIS sentences one by one, in the order of the file.

    Parameters
    ----------
    path
        Text file of ``!AIVDM`` sentences and their like. The time of each stands in a tag block
        (``\c:1671533231*50\``, seconds or milliseconds since 1970), before the sentence (such a number, or a date and
        time, UTC where it names no zone), or after it and a comma. A message of several sentences takes the first time
        among them.
    mmsi
        Only this ship's.
    counts
        Where given, is added to as the file is read: ``positions``, ``damaged`` sentences, and messages ``without
        time`` or ``without position``. Other lines and messages are passed over.

    Yields
    ------
    AisPosition
        A position of any ship, or of the one asked for.

    Raises
    ------
    DataError
        If pyais is not installed, the file cannot be read, or there is no position in it.
    """
    try:
        from pyais import decode
    except ImportError:
        raise DataError(f"{path}: reading AIS needs pyais; install it with: pip install 'elusive[ais]'") from None
    counts = Counter() if counts is None else counts
    before = counts["positions"]
    for time_s, sentences in _messages(Path(path), counts):
        if math.isnan(time_s):
            counts["without time"] += 1
            continue
        position = _position(time_s, sentences, decode, counts)
        if position is not None and mmsi in (None, position.mmsi):
            counts["positions"] += 1
            yield position
    if counts["positions"] == before:
        whose = "no AIS position" if mmsi is None else f"no AIS position of {mmsi}"
        told = ", ".join(f"{key} {count}" for key, count in counts.items() if count)
        raise DataError(
            f"{path}: holds {whose} with a time ({told or 'no sentence at all'}); give a log of !AIVDM lines."
        )


def _messages(path: Path, counts: Counter[str]) -> Iterator[tuple[float, list[str]]]:
    """Yield each position message's time, NaN where none is told, and its sentences, whole and undamaged."""
    pending: dict[tuple[str, ...], tuple[float, list[str]]] = {}
    for line in text_lines(path):
        found = SENTENCE.search(line)
        if found is None or int(found[7], 16) != checksum(found[1]):
            counts["damaged"] += "VDM," in line or "VDO," in line
            continue
        _, total, number, group, channel, payload, _ = found.groups()
        key, time_s = (total, group, channel), received_s(line, found)
        if number == "1":
            pending.pop(key, None)
            if payload[:1] not in POSITIONS:
                continue
            sentences = [found[0]]
        elif key in pending and int(number) == len(pending[key][1]) + 1:
            first_s, sentences = pending.pop(key)
            sentences.append(found[0])
            time_s = time_s if math.isnan(first_s) else first_s
        else:
            continue
        if number == total:
            yield time_s, sentences
        else:
            pending[key] = time_s, sentences
            if len(pending) > MAX_PENDING:
                del pending[next(iter(pending))]


def _position(
    time_s: float, sentences: list[str], decode: Callable[..., Any], counts: Counter[str]
) -> AisPosition | None:
    try:
        message = decode(*sentences)
        mmsi, lon, lat = int(message.mmsi), float(message.lon), float(message.lat)
        speed, course = float(message.speed), float(message.course)
    except Exception:  # pyais raises many kinds where a payload is too short
        counts["damaged"] += 1
        return None
    if not (abs(lon) <= 180 and abs(lat) <= 90):
        counts["without position"] += 1
        return None
    known = speed < (63 if message.msg_type == LONG_RANGE else 102.25)
    return AisPosition(
        time_s,
        mmsi,
        lon,
        lat,
        speed * KNOT_MPS if known else math.nan,
        math.radians(course) if course < 360 else math.nan,
    )
