"""Plays a recording over the network at the pace of its own times: packets of captures, lines of tables, video."""

from __future__ import annotations

import json
import math
import threading
import time
from collections.abc import Callable, Iterator
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

from elusive.errors import DataError
from elusive.io._asterix_video import CATEGORY
from elusive.io._internet import UDP, datagrams
from elusive.io._opened import opened, readable
from elusive.io._sentences import Sentences
from elusive.io._spoke_arrays import is_arrays
from elusive.io.asterix_video import send_asterix_video
from elusive.io.pcap import frames_of, is_capture
from elusive.io.radar_video import open_radar_video
from elusive.io.sinks.udp import UdpOutlet
from elusive.io.sources import tcp
from elusive.io.sources.address import Address, address_of
from elusive.io.sources.cells import cells_of, mark_of
from elusive.io.sources.feed import Feed
from elusive.io.sources.lines import lines_of
from elusive.io.sources.mqtt import client_for

LONGEST_WAIT_S = 0.1  # between two looks at whether it is stopped
KNOWN = {"udp": ("interface", "broadcast"), "tcp": ("listen",), "mqtt": (), "mqtts": ()}
TIMES = ("time_s",)


class Sent(NamedTuple):
    """What was played."""

    messages: int
    lost: int
    seconds: float  # that it took


def replay(
    source: Path, to: str, speed: float, say: Callable[[str], None], stopped: threading.Event | None = None
) -> Sent:
    """Play a recording.

    Parameters
    ----------
    source
        Capture (pcap, pcapng, either in gzip), of which the UDP payloads are sent, and the NMEA sentences of its TCP
        streams; radar video in blocks of ASTERIX or in arrays, sent as category 240; or a table with a column
        ``time_s``. Lines go as they are over TCP, under their header; over UDP and MQTT as JSON objects, which say
        themselves what they are.
    to
        ``udp://host:port``, ``tcp://host:port`` (``?listen=1``: to who connects), ``mqtt://host/topic``.
    speed
        How much faster than it was recorded.
    say
        Told when what is sent to goes.
    stopped
        Ends it.

    Raises
    ------
    DataError
        If the recording has no times, the address has no meaning, or who listened over TCP has gone.
    """
    if not 0 < speed < math.inf:
        raise DataError(f"speed={speed:g}: must be positive; 1 is the pace of the recording.")
    address, stopped = address_of(to, KNOWN), stopped or threading.Event()
    with readable(source), opened(source) as file:
        head = file.peek(16)[:16]
    captured, video = is_capture(head[:4]), is_arrays(head) or head.startswith(bytes([CATEGORY]))
    if (captured or video) and address.scheme != "udp":
        raise DataError(
            f"{source}: is {'a capture of UDP' if captured else 'radar video'}; play it to udp://host:port."
        )
    if video:
        spokes = takewhile(lambda part: not stopped.is_set(), open_radar_video(source))
        started_s = time.monotonic()
        return Sent(send_asterix_video(to, spokes, speed=speed, wait=stopped.wait), 0, time.monotonic() - started_s)
    messages = _packets(source) if captured else _lines(source, header=address.scheme == "tcp")
    send, close, lost = _opened(address, say, stopped)
    started_s, first_s, count = time.monotonic(), math.nan, 0
    try:
        for time_s, octets in messages:
            first_s = time_s if math.isnan(first_s) else first_s
            due_s = started_s + max(0.0, time_s - first_s) / speed
            while (left_s := due_s - time.monotonic()) > 0 and not stopped.is_set():
                stopped.wait(min(left_s, LONGEST_WAIT_S))
            if stopped.is_set():
                break
            send(octets)
            count += 1
    finally:
        close()
    return Sent(count, lost(), time.monotonic() - started_s)


def _packets(source: Path) -> Iterator[tuple[float, bytes]]:
    sentences = Sentences()
    with opened(source) as file:
        for datagram in datagrams(frames_of(file)):
            if not math.isfinite(datagram.unix_s):
                continue
            if datagram.protocol == UDP:
                yield datagram.unix_s, datagram.payload
            elif found := sentences.read(datagram):
                yield datagram.unix_s, "".join(f"{sentence}\r\n" for sentence in found).encode("ascii")


def _lines(source: Path, *, header: bool) -> Iterator[tuple[float, bytes]]:
    names: list[str] = []
    latest_s = math.nan
    for number, text in lines_of(str(source)):
        if text.startswith("#"):
            continue
        cells = cells_of(text, mark_of(text))
        if not names:
            if not set(TIMES) & set(cells):
                raise DataError(f"{source}, line {number}: names no column time_s; nothing says when a line is due.")
            names = cells
            head = text
            continue
        try:
            time_s = float(dict(zip(names, cells, strict=True))["time_s"])
        except ValueError:
            raise DataError(f"{source}, line {number}: does not fit its header; repair it.") from None
        if header:
            if math.isnan(latest_s):
                yield time_s, head.encode() + b"\n"
            yield time_s, text.encode() + b"\n"
        else:
            record = {name: _value(cell) for name, cell in zip(names, cells, strict=True)}
            yield time_s, json.dumps(record).encode() + b"\n"
        latest_s = time_s


def _value(cell: str) -> float | str | None:
    try:
        value = float(cell)
    except ValueError:
        return cell or None
    if not math.isfinite(value) or (repr(value) != cell and f"{value:g}" != cell):
        return cell  # a name, or more digits than a float has
    return value


def _opened(
    address: Address, say: Callable[[str], None], stopped: threading.Event
) -> tuple[Callable[[bytes], None], Callable[[], None], Callable[[], int]]:
    if address.scheme == "udp":
        outlet = UdpOutlet(address, say)
        return outlet.send, outlet.close, lambda: outlet.counts["dropped"]
    if address.scheme == "tcp":
        feed = Feed()
        feed.halted = stopped
        try:
            connection = tcp.connected(address, feed)
        except OSError as error:
            raise DataError(f"{address.text}: cannot be reached ({error.strerror or error}).") from None

        def deliver(octets: bytes) -> None:
            try:
                connection.sendall(octets)
            except OSError as error:
                raise DataError(
                    f"{address.text}: who listened has gone ({error.strerror or error}); play it again."
                ) from None

        return deliver, connection.close, lambda: 0
    if not address.path:
        raise DataError(f"{address.text}: names no topic; write mqtt://{address.host}/site/links.")
    client = client_for(address)
    try:
        client.connect(address.host, address.port)
    except OSError as error:
        raise DataError(f"{address.text}: cannot be reached ({error.strerror or error}).") from None
    client.loop_start()

    def publish(octets: bytes) -> None:
        client.publish(address.path, octets, qos=1).wait_for_publish(LONGEST_WAIT_S * 100)

    def close() -> None:
        client.disconnect()
        client.loop_stop()

    return publish, close, lambda: 0
