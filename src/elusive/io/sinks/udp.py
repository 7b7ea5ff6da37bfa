"""Packets over UDP, of which none is held: nobody waits for an old place."""

from __future__ import annotations

import socket
from collections import Counter
from collections.abc import Callable

from elusive.errors import DataError
from elusive.io.sources.address import Address


class UdpOutlet:
    """Sends packets at once; those that the system refuses are lost and counted: an old place is of no use.

    Raises
    ------
    DataError
        If the host has no address.
    """

    def __init__(self, address: Address, say: Callable[[str], None]) -> None:
        self.name, self.counts, self._say = address.text, Counter[str](), say
        try:
            family, _, _, _, where = socket.getaddrinfo(address.host, address.port, type=socket.SOCK_DGRAM)[0]
        except OSError as error:
            raise DataError(f"{address.text}: has no address ({error.strerror or error}); check the host.") from None
        self._where: tuple[object, ...] = where
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        network = address.options.get("interface")
        if network and family == socket.AF_INET:
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(network))
        if "broadcast" in address.options:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._is_gone = False

    def send(self, message: bytes) -> None:
        """Send a packet."""
        try:
            self._socket.sendto(message, self._where)
        except OSError as error:
            self.counts["dropped"] += 1
            if not self._is_gone:
                self._say(f"{self.name}: packets are lost ({error.strerror or error}); it goes on.")
            self._is_gone = True
            return
        if self._is_gone:
            self._say(f"{self.name}: is back; {self.counts['dropped']} packets were lost.")
        self._is_gone = False
        self.counts["sent"] += 1

    def close(self) -> None:
        """End."""
        self._socket.close()
