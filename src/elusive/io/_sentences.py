"""NMEA sentences written, and out of packets: UDP, and TCP streams put in order again (IEC 61162-1, -450)."""

from __future__ import annotations

import re
from functools import reduce
from operator import xor
from typing import NamedTuple

from elusive.io._internet import TCP, Datagram

SENTENCE = re.compile(rb"[!$]([A-Z0-9]{5,6},[ -~]*?)\*([0-9A-Fa-f]{2})")
STARTS = b"$!\\U"  # of a sentence, a tag block, and the mark that IEC 61162-450 puts before them
MAX_STREAMS = 64
MAX_TAIL = 1024  # octets of a sentence whose end has not come


class _Stream(NamedTuple):
    expected: int  # number of the octet that comes next
    tail: bytes


class Sentences:
    """Finds the sentences in packets, one packet after the other."""

    def __init__(self) -> None:
        self._streams: dict[tuple[str, str], _Stream] = {}

    def read(self, datagram: Datagram) -> list[str] | None:
        """Return the undamaged sentences that a packet ends, from their ``$`` or ``!`` on; None of other traffic."""
        if datagram.protocol != TCP:
            return sentences_in(datagram.payload) or None if datagram.payload[0] in STARTS else None
        key = datagram.source, datagram.destination
        known = self._streams.get(key)
        if known is None and not sentences_in(datagram.payload):
            return None
        octets, expected = datagram.payload, datagram.sequence
        if known is not None:
            behind = (known.expected - datagram.sequence) & 0xFFFFFFFF
            if behind < 1 << 31:  # the whole or a part of it came before
                octets, expected = known.tail + octets[behind:], datagram.sequence
                if behind >= len(datagram.payload):
                    return []
        text, _, tail = octets.rpartition(b"\n")
        self._streams.pop(key, None)
        self._streams[key] = _Stream((expected + len(datagram.payload)) & 0xFFFFFFFF, tail[-MAX_TAIL:])
        if len(self._streams) > MAX_STREAMS:
            del self._streams[next(iter(self._streams))]
        return sentences_in(text)


def sentences_in(octets: bytes) -> list[str]:
    """Return the undamaged sentences in a text."""
    found = (match for match in SENTENCE.finditer(octets) if int(match[2], 16) == exclusive_or(match[1]))
    return [match[0].decode("ascii") for match in found]


def sentence_of(body: str) -> bytes:
    """Return what stands between a sentence's mark and its star as the whole of its line."""
    octets = body.encode("ascii")
    return b"$%b*%02X\r\n" % (octets, exclusive_or(octets))


def exclusive_or(octets: bytes) -> int:
    """Return the exclusive or of octets."""
    return reduce(xor, octets, 0)
