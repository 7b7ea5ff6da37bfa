"""UDP payloads of a network capture: pcap and pcapng, Ethernet with VLAN tags and other link layers, IPv4 and IPv6.

Formats: draft-ietf-opsawg-pcap and draft-ietf-opsawg-pcapng; RFC 791, 8200, 768; IEEE 802.1Q. Captures are read as
untrusted data: what does not fit is left out, and nothing but the file's own end stops the reader.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

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
ETHERNET, NULL, LOOP, RAW, SLL, SLL2 = 1, 0, 108, (12, 14, 101, 228, 229), 113, 276
IPV4, IPV6, VLAN = 0x0800, 0x86DD, (0x8100, 0x88A8, 0x9100)
UDP, EXTENSIONS = 17, (0, 43, 60)  # IPv6 headers that stand before UDP, each with its length


def is_capture(head: bytes) -> bool:
    """Whether a file's first four octets are those of a capture."""
    return head in PCAP or head == SECTION.to_bytes(4)


class Frame(NamedTuple):
    """What was captured at once."""

    unix_s: float  # when; NaN where the capture does not say
    link: int  # type of the link layer
    octets: bytes


def udp_payloads(file: BinaryIO) -> Iterator[tuple[float, bytes]]:
    """Yield what each UDP packet of a capture carries, fragments left out.

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
    head = file.read(4)
    for frame in _pcap(file, head) if head in PCAP else _pcapng(file, head):
        payload = _udp_of(frame)
        if payload:
            yield frame.unix_s, payload


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


def _udp_of(frame: Frame) -> bytes | None:
    """Return the payload of the UDP packet in a frame, None where there is none."""
    packet = _ip_of(frame.link, frame.octets)
    version = packet[0] >> 4 if packet else 0
    if version == 4 and len(packet) >= 20:
        protocol, start, fragment = packet[9], 4 * (packet[0] & 15), packet[6] & 0x3F | packet[7]
        if start < 20 or fragment:
            return None
    elif version == 6 and len(packet) >= 40:
        protocol, start = packet[6], 40
        while protocol in EXTENSIONS and len(packet) >= start + 8:
            protocol, start = packet[start], start + 8 + 8 * packet[start + 1]
    else:
        return None
    # its own length ends it: what follows is padding
    size = int.from_bytes(packet[start + 4 : start + 6])
    return packet[start + 8 : start + size] if protocol == UDP else None


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
