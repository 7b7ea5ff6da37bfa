"""Packets as they come over UDP, from one sender or a multicast group."""

from __future__ import annotations

import os
import socket
import struct
import time
from collections.abc import Iterator
from contextlib import closing
from typing import NamedTuple

from elusive.io.sources.address import Address, address_of
from elusive.io.sources.feed import LOOK_S, Feed

MOST = 65_535  # octets of a packet
HELD = 1 << 22  # octets that the system is asked to hold
OPTIONS = {"udp": ("interface", "columns")}


class Packet(NamedTuple):
    """What came at once."""

    unix_s: float  # when, by this machine's clock
    came_s: float  # the same by time.monotonic
    octets: bytes


def packets_of(source: str, feed: Feed) -> Iterator[Packet]:
    """Yield the packets that come to ``udp://host:port``, until the feed is over.

    Parameters
    ----------
    source
        The address to listen at: of this machine (loopback where the host is left out, ``0.0.0.0`` for all of its
        networks), or of a multicast group, joined on the network whose own address is the option ``interface``.
    feed
        Says when to end.

    Raises
    ------
    DataError
        If it is no such address.
    """
    address = address_of(source, OPTIONS)
    return feed.again(address.text, lambda: received(address, feed))


def received(address: Address, feed: Feed) -> Iterator[Packet]:
    """Yield what comes to one socket.

    Raises
    ------
    OSError
        If the system refuses it.
    """
    with closing(_listening(address)) as ear:
        ear.settimeout(LOOK_S)
        while not feed.over:
            try:
                octets = ear.recv(MOST)
            except TimeoutError:
                continue
            yield Packet(time.time(), time.monotonic(), octets)


def _listening(address: Address) -> socket.socket:
    """Return a socket that hears an address.

    Raises
    ------
    OSError
        If the system refuses.
    """
    family, _, _, _, where = socket.getaddrinfo(address.host, address.port, type=socket.SOCK_DGRAM)[0]
    ear = socket.socket(family, socket.SOCK_DGRAM)
    try:
        ear.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, HELD)
        if address.is_multicast:
            ear.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            _join(ear, family, address)
            where = ("", address.port) if os.name == "nt" else where  # Windows binds no group
        ear.bind(where)
    except OSError:
        ear.close()
        raise
    return ear


def _join(ear: socket.socket, family: int, address: Address) -> None:
    network = address.options.get("interface", "")
    if family == socket.AF_INET6:
        number = socket.if_nametoindex(network) if network else 0
        group = socket.inet_pton(socket.AF_INET6, address.host) + struct.pack("@I", number)
        ear.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_JOIN_GROUP, group)
        return
    group = socket.inet_aton(address.host) + socket.inet_aton(network or "0.0.0.0")
    ear.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
