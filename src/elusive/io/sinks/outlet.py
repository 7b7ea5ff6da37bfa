"""Outlets that lose nothing while what is behind them is gone for a while: a file, a TCP connection; and UDP."""

from __future__ import annotations

import contextlib
import socket
import struct
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from elusive.errors import DataError
from elusive.io.added_file import AddedFile
from elusive.io.atomic import refused
from elusive.io.sources.address import Address
from elusive.io.sources.feed import FIRST_S, LOOK_S

HELD = 20_000  # messages that wait at most
LONGEST_S = 5.0  # between two tries
CLOSING_S = 2.0  # for which the end waits for what is still held
CONNECT_S = 5.0


class Outlet(Protocol):
    """Takes messages to one place."""

    name: str
    counts: Counter[str]

    def send(self, message: bytes) -> None:
        """Take a message; never waits."""
        ...

    def close(self) -> None:
        """Send what is held, if that takes not too long, and end."""
        ...


class HeldOutlet:
    """Sends from a thread of its own; what cannot be sent yet is held, so much at most, and sent when it can.

    Parameters
    ----------
    name
        For sentences.
    opened
        Opens what is behind it, and returns what sends and what closes; OSError: it is not there.
    say
        Told when it goes and comes back.
    """

    def __init__(
        self,
        name: str,
        opened: Callable[[], tuple[Callable[[bytes], None], Callable[[], None]]],
        say: Callable[[str], None],
    ) -> None:
        self.name, self.counts = name, Counter[str]()
        self._opened, self._say = opened, say
        self._held: deque[bytes] = deque()
        self._changed, self._closing = threading.Condition(), threading.Event()
        self._gone_s, self._wait_s = float("nan"), FIRST_S
        self._thread = threading.Thread(target=self._run, name=f"to {name}", daemon=True)
        self._thread.start()

    def send(self, message: bytes) -> None:
        """Hold a message; the oldest makes room where too many are."""
        with self._changed:
            if len(self._held) >= HELD:
                self._held.popleft()
                self.counts["dropped"] += 1
            self._held.append(message)
            self._changed.notify()

    def close(self) -> None:
        """Send what is held, if that takes not too long, and end."""
        self._closing.set()
        with self._changed:
            self._changed.notify()
        self._thread.join(CLOSING_S)
        if self._held:
            self.counts["dropped"] += len(self._held)
            self._say(f"{self.name}: {len(self._held)} messages could not be sent any more.")

    def _run(self) -> None:
        until_s = float("inf")
        while not self._over(until_s):
            try:
                send, close = self._opened()
            except OSError as error:
                why = error
            else:
                try:
                    self._empty(send)
                except OSError as error:
                    why = error
                else:
                    return
                finally:
                    with contextlib.suppress(OSError):
                        close()
            if self._gone_s != self._gone_s:
                self._gone_s = time.monotonic()
                self._say(f"{self.name}: cannot be written to ({why.strerror or why}); it is tried again.")
            if self._closing.wait(self._wait_s):
                until_s = min(until_s, time.monotonic() + CLOSING_S)
                time.sleep(LOOK_S)
            self._wait_s = min(2 * self._wait_s, LONGEST_S)

    def _over(self, until_s: float) -> bool:
        return self._closing.is_set() and (not self._held or time.monotonic() >= until_s)

    def _empty(self, send: Callable[[bytes], None]) -> None:
        """Send until it is closed."""
        while True:
            with self._changed:
                while not self._held:
                    if self._closing.is_set():
                        return
                    self._changed.wait(LOOK_S)
                message = self._held[0]
            send(message)
            if self._gone_s == self._gone_s:  # a file on a full disk is opened, too
                self._say(
                    f"{self.name}: is back after {time.monotonic() - self._gone_s:.1f} s; {len(self._held)} messages "
                    f"are sent now, {self.counts['dropped']} were lost."
                )
                self._gone_s, self._wait_s = float("nan"), FIRST_S
            with self._changed:
                if self._held and self._held[0] is message:
                    self._held.popleft()
            self.counts["sent"] += 1


def file_outlet(path: str, say: Callable[[str], None]) -> HeldOutlet:
    """Add to a file: see :class:`~elusive.io.added_file.AddedFile`.

    Raises
    ------
    DataError
        If the file cannot be written to from the start.
    """
    with refused(path), Path(path).open("ab"):
        pass
    file = AddedFile(path)

    def opened() -> tuple[Callable[[bytes], None], Callable[[], None]]:
        return file.send, file.close

    return HeldOutlet(path, opened, say)


def tcp_outlet(address: Address, say: Callable[[str], None]) -> HeldOutlet:
    """Send over TCP to who listens there; what the other machine has not received when it breaks is sent again."""
    sent: deque[tuple[int, bytes]] = deque()  # the connection's octets up to a message's end, and the message

    def opened() -> tuple[Callable[[bytes], None], Callable[[], None]]:
        connection = socket.create_connection((address.host, address.port), CONNECT_S)
        again, total = [message for _, message in sent], 0
        sent.clear()

        def send(message: bytes) -> None:
            while again:
                one(again[0])
                del again[0]
            one(message)

        def one(message: bytes) -> None:
            nonlocal total
            if _hung_up(connection):
                raise ConnectionResetError("hung up")
            connection.sendall(message)
            total += len(message)
            sent.append((total, message))
            received = total - _unreceived(connection)
            while sent and sent[0][0] <= received:
                sent.popleft()

        def close() -> None:
            received = total - _unreceived(connection)
            left = [message for end, message in sent if end > received]
            sent.clear()
            sent.extend((0, message) for message in (*left, *again))
            connection.close()

        return send, close

    return HeldOutlet(address.text, opened, say)


def _unreceived(connection: socket.socket) -> int:
    """Return how many octets the other machine has not said to have received; 0 where the system does not tell."""
    if sys.platform != "linux":
        return 0
    import fcntl
    import termios

    return int(struct.unpack("i", fcntl.ioctl(connection, termios.TIOCOUTQ, bytes(4)))[0])


def _hung_up(connection: socket.socket) -> bool:
    """Whether the other side has closed: what is written then would be lost without a word."""
    connection.setblocking(False)
    try:
        while octets := connection.recv(1 << 16):  # what it says is not listened to
            pass
    except BlockingIOError:
        return False
    finally:
        connection.settimeout(CONNECT_S)
    return not octets


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
