"""Lines of a log, numbered: of a file, one that grows, standard input, TCP, UDP or MQTT; JSON objects as a table."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

from elusive.errors import DataError
from elusive.io._opened import readable
from elusive.io._standard_input import STANDARD_INPUT, standard_input
from elusive.io.sources import mqtt, packets, tcp
from elusive.io.sources.address import Address, address_of, is_address
from elusive.io.sources.feed import Feed
from elusive.io.sources.grown import Grown
from elusive.io.sources.header import Header

LONGEST_RECORDED = 1 << 26  # octets of a line where nothing is live
STRICT = Feed(lenient=False)  # of what is recorded: a fault ends it
KNOWN = {"tcp": tcp.OPTIONS, "udp": packets.OPTIONS["udp"], "mqtt": mqtt.OPTIONS, "mqtts": mqtt.OPTIONS}

Lines = Generator[tuple[int, str], None, None]


def comes_once(source: str) -> bool:
    """Whether a source cannot be read afresh."""
    return source == STANDARD_INPUT or is_address(source)


def lines_of(source: str, feed: Feed | None = None) -> Lines:
    """Yield each line's number, from 1, and text; blank lines are left out.

    A line that is a JSON object, or a list of such, becomes cells under a header made of the first one's keys.

    Parameters
    ----------
    source
        A file; ``-`` for standard input; ``tcp://host:port``; ``udp://host:port``, whose packets hold lines;
        ``mqtt://host/topic``. Of the last three the option ``columns`` is a header, where the lines bring none.
    feed
        Whether to wait for more where a file ends, and for how long; a line is yielded once it is complete. A file that
        is begun anew is read from its start. None: to the end, once.

    Raises
    ------
    DataError
        If the source cannot be read or is no UTF-8 text.
    """
    if is_address(source):
        return _over_network(address_of(source, KNOWN), feed or Feed())
    if source == STANDARD_INPUT:
        return _as_table(_numbered(standard_input, "standard input", None), "standard input", feed or STRICT)
    return _as_table(_of_file(source, feed), source, feed or STRICT)


def _of_file(source: str, feed: Feed | None) -> Lines:
    with readable(source):
        yield from _numbered(lambda: Path(source).open("rb"), source, feed)  # noqa: SIM115 - who reads it closes it


def every_line(opened: Callable[[], BinaryIO], name: str, feed: Feed | None) -> Lines:
    """Yield each line's number, from 1, and text, blank ones too, of a file that may grow, or of a pipe (no feed)."""
    for number, octets in enumerate(_whole_lines(opened, name, feed), 1):
        yield number, text_of(octets, number, name)


def _numbered(opened: Callable[[], BinaryIO], name: str, feed: Feed | None) -> Lines:
    yield from ((number, text) for number, text in every_line(opened, name, feed) if text)


def _whole_lines(opened: Callable[[], BinaryIO], name: str, feed: Feed | None) -> Iterator[bytes]:
    again = True
    while again:
        with opened() as file:
            again = yield from _to_the_end(file, name, feed)


def _to_the_end(file: BinaryIO, name: str, feed: Feed | None) -> Generator[bytes, None, bool]:
    """Yield the lines of an open file; returns whether another has taken its place."""
    begun, passing = b"", False
    grown = None if feed is None else Grown(file, name, feed)
    if feed is not None:
        feed.stir()
    while True:
        longest = LONGEST_RECORDED if feed is None else tcp.LONGEST
        octets = file.readline(longest)
        if len(begun) + len(octets) >= longest:
            sentence = f"{name}: a line is longer than {longest} octets."
            if feed is None:
                raise DataError(f"{sentence} Measurements are shorter: check that it is the right file.")
            if not passing:
                feed.spoilt(sentence)
            begun, passing = b"", True
        if passing and octets:
            passing = not octets.endswith(b"\n")
            continue
        if feed is not None and grown is not None and not octets.endswith(b"\n"):
            # the end of the file, perhaps in the middle of a line that is being written
            begun += octets
            feed.comes_again = False
            if octets:
                feed.stir()
                continue
            if grown.begun_anew():
                return True
            if not feed.over:
                continue
            feed = None
        whole, begun = begun + octets, b""
        if not whole:
            return False
        if feed is not None:
            feed.stir()
        yield whole


def _over_network(address: Address, feed: Feed) -> Lines:
    feed.stir()
    header = address.options.get("columns", "")
    if header:
        yield 0, header
    yield from _as_table(_texts(address, feed), address.text, feed, header)


def _texts(address: Address, feed: Feed) -> Lines:
    source: Iterator[bytes]
    if address.scheme == "tcp":
        source = feed.again(address.text, lambda: tcp.tcp_lines(address, feed))
    elif address.scheme == "udp":
        heard = feed.again(address.text, lambda: packets.received(address, feed))
        source = (line for packet in heard for line in packet.octets.splitlines())
    else:
        source = (line for message in mqtt.mqtt_messages(address, feed) for line in message.splitlines())
    numbered = enumerate(source, 1)
    for number, text in feed.each(numbered, lambda line: (line[0], text_of(line[1], line[0], address.text))):
        if text:
            yield number, text


def text_of(octets: bytes, number: int, name: str) -> str:
    """Return a line's text.

    Raises
    ------
    DataError
        If it is not in UTF-8.
    """
    try:
        return octets.decode("utf-8-sig" if number == 1 else "utf-8").strip()
    except UnicodeDecodeError:
        raise DataError(f"{name}, line {number}: is not text in UTF-8; save it as plain text.") from None


def _as_table(lines: Lines, name: str, feed: Feed, header: str = "") -> Lines:
    """Pass lines on, JSON objects as cells under a header, and live a header that comes again not at all."""
    keys: list[str] = []
    columns = Header(header, name) if header else None
    with closing(lines):
        for number, text in lines:
            if text[0] not in "{[":
                told: str | None = text
                if columns is not None and feed.lenient and text[0] != "#":
                    told = columns.placed(number, text)
                elif columns is None and text[0] != "#":
                    header, columns = text, Header(text, name)
                if told is not None:
                    yield number, told
                continue
            where = f"{name}, line {number}"
            for record in (record for found in feed.each([text], partial(_objects, where=where)) for record in found):
                if not keys:
                    keys = header.split(",") if header else list(record)
                    if not header:
                        yield number, ",".join(keys)
                yield from ((number, of) for of in feed.each([record], partial(_cells, keys=keys, where=where)))


def _objects(text: str, where: str) -> list[dict[str, Any]]:
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise DataError(f"{where}: begins like JSON and is none; repair it.") from None
    records = found if isinstance(found, list) else [found]
    if not all(isinstance(record, dict) for record in records):
        raise DataError(f"{where}: is JSON, but no object; write one of names and values.")
    return records


def _cells(record: dict[str, Any], keys: list[str], where: str) -> str:
    cells = []
    for key in keys:
        value = record.get(key)
        cell = "" if value is None else value if isinstance(value, str) else repr(value)
        if isinstance(value, dict | list) or any(mark in cell for mark in ',"\n'):
            raise DataError(f"{where}, {key}: is {cell!r:.60}; write a number or a word without a comma.")
        cells.append(cell)
    return ",".join(cells)


def after(lines: Lines, line: int) -> Lines:
    """Yield the lines whose number is larger."""
    with closing(lines):
        for number, text in lines:
            if number > line:
                yield number, text


def chained(first: list[tuple[int, str]], lines: Lines) -> Lines:
    """Yield lines already read, and then the others."""
    yield from first
    yield from lines
