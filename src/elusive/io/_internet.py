"""What the frames of a network capture carry: UDP datagrams, put together from IP fragments, and TCP segments.

RFC 791 (IPv4), 815 (reassembly), 8200 (IPv6), 5722 (overlaps are refused), 768 (UDP), 9293 (TCP); IEEE 802.1Q.
"""

from __future__ import annotations

import ipaddress
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import NamedTuple

ETHERNET, NULL, LOOP, RAW, SLL, SLL2 = 1, 0, 108, (12, 14, 101, 228, 229), 113, 276
IPV4, IPV6, VLAN = 0x0800, 0x86DD, (0x8100, 0x88A8, 0x9100)
TCP, UDP, FRAGMENT = 6, 17, 44
EXTENSIONS = (0, 43, 60)  # IPv6 headers that stand before the payload, each with its length
MAX_PENDING = 256  # datagrams of which fragments are awaited; the oldest is given up
MAX_OCTETS = 65_535  # of a datagram


class Frame(NamedTuple):
    """What was captured at once."""

    unix_s: float  # when; NaN where the capture does not say
    link: int  # type of the link layer
    octets: bytes


class Datagram(NamedTuple):
    """What one host sent to another, or to a group."""

    unix_s: float  # when its last part was captured; NaN where that is not known
    payload: bytes  # cut short where the capture cut the packet short
    source: str = ""  # address:port; nothing where there was no network
    destination: str = ""
    protocol: int = UDP
    sequence: int = 0  # of a TCP segment's first octet


class _Packet(NamedTuple):
    source: bytes
    destination: bytes
    protocol: int
    payload: bytes
    is_whole: bool = True
    offset: int = 0  # of a fragment's octets
    more: bool = False  # fragments follow
    identity: bytes = b""


class _Parts:
    """Fragments of a datagram, as they come."""

    def __init__(self) -> None:
        self.parts: dict[int, bytes] = {}
        self.held = 0  # octets
        self.size: int | None = None

    def whole(self, packet: _Packet) -> bytes | None:
        """Add a fragment; return the datagram once it is complete.

        Raises
        ------
        ValueError
            If the fragments contradict each other.
        """
        end = packet.offset + len(packet.payload)
        fits = not packet.more or (packet.payload and len(packet.payload) % 8 == 0)
        if not fits or end > MAX_OCTETS or self.parts.get(packet.offset, packet.payload) != packet.payload:
            raise ValueError
        if not packet.more:
            if self.size not in (None, end):
                raise ValueError
            self.size = end
        self.held += 0 if packet.offset in self.parts else len(packet.payload)
        self.parts[packet.offset] = packet.payload
        if self.size is None or self.held < self.size:
            return None
        at = 0
        for offset in sorted(self.parts):
            if offset != at:
                raise ValueError
            at += len(self.parts[offset])
        if at != self.size:
            raise ValueError
        return b"".join(self.parts[offset] for offset in sorted(self.parts))


def datagrams(frames: Iterable[Frame], counts: Counter[str] | None = None) -> Iterator[Datagram]:
    """Yield each UDP datagram and TCP segment that carries something, in the order of the capture.

    Parameters
    ----------
    frames
        Of the capture.
    counts
        Where given, is added to: ``incomplete`` datagrams, of which fragments are missing or contradict each other.
    """
    counts = Counter() if counts is None else counts
    pending: dict[tuple[bytes, ...], _Parts] = {}
    for frame in frames:
        packet = _packet(_ip_of(frame.link, frame.octets))
        if packet is None:
            continue
        payload: bytes | None = packet.payload
        if not packet.is_whole:
            key = packet.source, packet.destination, bytes([packet.protocol]), packet.identity
            try:
                payload = pending.setdefault(key, _Parts()).whole(packet)
            except ValueError:
                counts["incomplete"] += 1
                del pending[key]
                continue
            if payload is None:
                if len(pending) > MAX_PENDING:
                    counts["incomplete"] += 1
                    del pending[next(iter(pending))]
                continue
            del pending[key]
        found = _carried(frame.unix_s, packet, payload or b"")
        if found is not None:
            yield found
    counts["incomplete"] += len(pending)


def _carried(unix_s: float, packet: _Packet, octets: bytes) -> Datagram | None:
    """Return what a whole IP packet carries, None if nothing that is read here."""
    if packet.protocol == UDP and len(octets) >= 8:
        # its own length ends it: what follows is padding
        payload, sequence = octets[8 : int.from_bytes(octets[4:6])], 0
    elif packet.protocol == TCP and len(octets) >= 20:
        payload, sequence = octets[4 * (octets[12] >> 4) :], int.from_bytes(octets[4:8])
    else:
        return None
    if not payload:
        return None
    source, destination = _address(packet.source, octets[0:2]), _address(packet.destination, octets[2:4])
    return Datagram(unix_s, payload, source, destination, packet.protocol, sequence)


@lru_cache(maxsize=256)
def _address(host: bytes, port: bytes) -> str:
    name = str(ipaddress.ip_address(host))
    return f"{f'[{name}]' if ':' in name else name}:{int.from_bytes(port)}"


def _packet(octets: bytes) -> _Packet | None:
    """Take an IP packet apart, None where it is none."""
    version = octets[0] >> 4 if octets else 0
    if version == 4 and len(octets) >= 20:
        start, size, word = 4 * (octets[0] & 15), int.from_bytes(octets[2:4]), int.from_bytes(octets[6:8])
        if start < 20:
            return None
        # a length of 0 is what a network card leaves to fill in
        body, more, offset = octets[start : size or None], bool(word & 0x2000), 8 * (word & 0x1FFF)
        parts = (not (more or offset), offset, more, octets[4:6])
        return _Packet(octets[12:16], octets[16:20], octets[9], body, *parts)
    if version == 6 and len(octets) >= 40:
        protocol, start = octets[6], 40
        size = int.from_bytes(octets[4:6])
        end = start + size if size else len(octets)
        fragment: tuple[bool, int, bool, bytes] = (True, 0, False, b"")
        while protocol in (*EXTENSIONS, FRAGMENT) and len(octets) >= start + 8:
            if protocol == FRAGMENT:
                word = int.from_bytes(octets[start + 2 : start + 4])
                fragment = (not word & 0xFFF9, word & 0xFFF8, bool(word & 1), octets[start + 4 : start + 8])
                protocol, start = octets[start], start + 8
            else:
                protocol, start = octets[start], start + 8 + 8 * octets[start + 1]
        return _Packet(octets[8:24], octets[24:40], protocol, octets[start:end], *fragment)
    return None


def _ip_of(link: int, octets: bytes) -> bytes:
    """Return the IP packet in a frame, nothing where there is none."""
    if link in RAW:
        return octets
    if link in (NULL, LOOP):
        return octets[4:]
    at = {ETHERNET: 12, SLL: 14, SLL2: 0}.get(link)
    if at is None:
        return b""
    start = {ETHERNET: 14, SLL: 16, SLL2: 20}[link]
    protocol = int.from_bytes(octets[at : at + 2])
    while protocol in VLAN and len(octets) >= start + 4:
        protocol, start = int.from_bytes(octets[start + 2 : start + 4]), start + 4
    return octets[start:] if protocol in (IPV4, IPV6) else b""
