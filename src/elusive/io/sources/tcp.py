"""Lines over TCP, of a server that is connected to or, with ``?listen=1``, of whoever connects."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import closing

from elusive.io.sources.address import Address
from elusive.io.sources.feed import LOOK_S, Feed

OPTIONS = ("listen", "columns")
CONNECT_S = 5.0
CHUNK = 1 << 16
LONGEST = 1 << 20  # octets of a line


def tcp_lines(address: Address, feed: Feed) -> Iterator[bytes]:
    """Yield the whole lines of one connection; one that is too long is left out.

    Raises
    ------
    OSError
        If there is no connection, or it breaks.
    """
    with closing(connected(address, feed)) as connection:
        connection.settimeout(LOOK_S)
        begun, passing = b"", False
        while not feed.over:
            try:
                octets = connection.recv(CHUNK)
            except TimeoutError:
                continue
            if not octets:
                return
            *lines, begun = (begun + octets).split(b"\n")
            for line in lines:
                if not passing:
                    yield line
                passing = False
            if len(begun) > LONGEST:
                if not passing:
                    feed.spoilt(f"{address.text}: a line is longer than {LONGEST} octets.")
                begun, passing = b"", True


def connected(address: Address, feed: Feed) -> socket.socket:
    """Connect, or wait for who connects.

    Raises
    ------
    OSError
        If that fails.
    """
    if "listen" not in address.options:
        return socket.create_connection((address.host, address.port), CONNECT_S)
    with socket.create_server((address.host, address.port)) as server:
        server.settimeout(LOOK_S)
        while not feed.over:
            try:
                return server.accept()[0]
            except TimeoutError:
                continue
    raise OSError("nobody connected")
