"""Network captures: pcap and pcapng, what their UDP packets carry, and pcap written.

Formats: draft-ietf-opsawg-pcap and draft-ietf-opsawg-pcapng. Captures are read as untrusted data: what does not fit is
left out, and nothing but the file's own end stops the reader.
"""

from __future__ import annotations

import ipaddress
import math
import struct
from collections.abc import Iterator
from functools import lru_cache
from typing import BinaryIO

from elusive.io._internet import UDP, Frame, datagrams

SECTION, INTERFACE, SIMPLE, PACKET = 0x0A0D0D0A, 1, 3, 6
TIME_RESOLUTION = 9  # option of an interface
# by a pcap file's first four octets: order of the octets, ticks a second, octets that its packet headers have more
PCAP = {
    bytes.fromhex(magic): (order, ticks, extra)
    for magic, order, ticks, extra in (
        ("d4c3b2a1", "<", 1e6, 0),
        ("a1b2c3d4", ">", 1e6, 0),
        ("4d3cb2a1", "<", 1e9, 0),
        ("a1b23c4d", ">", 1e9, 0),
        ("34cdb2a1", "<", 1e6, 8),
        ("a1b2cd34", ">", 1e6, 8),
    )
}
MAX_PACKET = 1 << 20  # octets; a longer one is a damaged length


def is_capture(head: bytes) -> bool:
    """Whether a file's first four octets are those of a capture."""
    return head in PCAP or head == SECTION.to_bytes(4)


def frames_of(file: BinaryIO) -> Iterator[Frame]:
    """Yield the frames of a capture, given at its start."""
    head = file.read(4)
    yield from _pcap(file, head) if head in PCAP else _pcapng(file, head)


def udp_payloads(file: BinaryIO) -> Iterator[tuple[float, bytes]]:
    """Yield what each UDP packet of a capture carries, put together from its fragments.

    Parameters
    ----------
    file
        The capture, at its start.

    Yields
    ------
    float
        When it was captured, in seconds after 1970 began (UTC); NaN where the capture does not say.
    bytes
        The payload, cut short where the capture cut the packet short.
    """
    for found in datagrams(frames_of(file)):
        if found.protocol == UDP:
            yield found.unix_s, found.payload


def _pcap(file: BinaryIO, head: bytes) -> Iterator[Frame]:
    order, ticks, extra = PCAP[head]
    rest = file.read(20)
    if len(rest) < 20:
        return
    # the upper bits say how long the frame check sequence is, which stands after what is read here
    link = struct.unpack(order + "I", rest[16:])[0] & 0xFFFF
    while len(header := file.read(16 + extra)) == 16 + extra:
        seconds, fraction, size = struct.unpack(order + "III", header[:12])
        if size > MAX_PACKET:
            return
        yield Frame(seconds + fraction / ticks, link, file.read(size))


def _pcapng(file: BinaryIO, head: bytes) -> Iterator[Frame]:
    order = "<"
    interfaces: list[tuple[int, float]] = []  # link type, ticks a second
    for kind, order, body in _blocks(file, head):
        if kind == SECTION:
            interfaces = []
        elif kind == INTERFACE and len(body) >= 8:
            interfaces.append((struct.unpack(order + "H", body[:2])[0], _ticks(body[8:], order)))
        elif kind == PACKET and len(body) >= 20:
            interface, high, low, captured = struct.unpack(order + "IIII", body[:16])
            if interface < len(interfaces):
                link, ticks = interfaces[interface]
                yield Frame((high << 32 | low) / ticks, link, body[20 : 20 + captured])
        elif kind == SIMPLE and len(body) >= 4 and interfaces:
            original = struct.unpack(order + "I", body[:4])[0]
            yield Frame(math.nan, interfaces[0][0], body[4 : 4 + original])


def _blocks(file: BinaryIO, head: bytes) -> Iterator[tuple[int, str, bytes]]:
    """Yield each block's kind, the order of its octets and its body, until one does not fit."""
    order = "<"
    while len(head) == 4 and len(size_octets := file.read(4)) == 4:
        mark = b""
        if int.from_bytes(head) == SECTION:
            mark = file.read(4)
            if mark not in (b"\x4d\x3c\x2b\x1a", b"\x1a\x2b\x3c\x4d"):
                return
            order = "<" if mark[0] == 0x4D else ">"
        kind, size = struct.unpack(order + "II", head + size_octets)
        left = size - 8 - len(mark)
        if not 4 <= left <= MAX_PACKET or len(body := file.read(left)) < left:
            return
        yield kind, order, body[:-4]
        head = file.read(4)


def _ticks(options: bytes, order: str) -> float:
    """Return an interface's ticks a second from its options."""
    at = 0
    while len(options) >= at + 5:
        code, size = struct.unpack(order + "HH", options[at : at + 4])
        if code == TIME_RESOLUTION and size == 1:
            return float((2 if options[at + 4] & 0x80 else 10) ** (options[at + 4] & 0x7F))
        if code == 0:
            break
        at += 4 + size + -size % 4
    return 1e6


def capture_start() -> bytes:
    """Return the octets with which a capture of Ethernet begins, its times in nanoseconds."""
    return struct.pack("<IHHiIII", 0xA1B23C4D, 2, 4, 0, 0, MAX_PACKET, 1)


def captured_udp(unix_s: float, payload: bytes, source: tuple[str, int], group: tuple[str, int]) -> bytes:
    """Return a record of a capture that :func:`capture_start` begins: a UDP packet from a host to a multicast group.

    Parameters
    ----------
    unix_s
        When; a time before 1970 cannot be written and becomes its start.
    payload
        Up to 65 507 octets.
    source, group
        IPv4 address and port.
    """
    host, to = (_packed(address) for address, _ in (source, group))
    size = 8 + len(payload)
    udp = struct.pack(">HHHH", source[1], group[1], size, 0) + payload
    head = struct.pack(">BBHHHBBH", 0x45, 0, 20 + size, 0, 0x4000, 1, 17, 0) + host + to
    total = sum(struct.unpack(">10H", head))
    total = (total & 0xFFFF) + (total >> 16)
    head = head[:10] + struct.pack(">H", ~(total + (total >> 16)) & 0xFFFF) + head[12:]
    ethernet = bytes([1, 0, 0x5E, to[1] & 0x7F, *to[2:], 2, 0, *host]) + b"\x08\x00"
    frame = ethernet + head + udp
    seconds, nanoseconds = divmod(max(round(unix_s * 1e9), 0), 10**9)
    return struct.pack("<IIII", seconds & 0xFFFFFFFF, nanoseconds, len(frame), len(frame)) + frame


@lru_cache(maxsize=64)
def _packed(address: str) -> bytes:
    return ipaddress.IPv4Address(address).packed
