"""Outlets that lose nothing while what is behind them is gone for a while: a file, a TCP connection."""

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

from elusive.io.added_file import AddedFile
from elusive.io.atomic import refused
from elusive.io.sources.address import Address
from elusive.io.sources.feed import FIRST_S, LOOK_S

HELD, HELD_OCTETS = 20_000, 1 << 26  # messages, and octets, that wait at most
LONGEST_S = 5.0  # between two tries
CLOSING_S = 2.0  # for which the end waits for what is still held
CONNECT_S = 5.0
STALLED_S = 30.0  # after which a listener that takes nothing more is left


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
    ended
        Called when nothing more is sent.
    """

    def __init__(
        self,
        name: str,
        opened: Callable[[], tuple[Callable[[bytes], None], Callable[[], None]]],
        say: Callable[[str], None],
        ended: Callable[[], None] = lambda: None,
    ) -> None:
        self.name, self.counts = name, Counter[str]()
        self._opened, self._say, self._ended = opened, say, ended
        self._held: deque[bytes] = deque()
        self._octets, self._is_full = 0, False
        self._changed, self._closing = threading.Condition(), threading.Event()
        self._gone_s, self._wait_s, self._until_s = float("nan"), FIRST_S, float("inf")
        self._thread = threading.Thread(target=self._run, name=f"to {name}", daemon=True)
        self._thread.start()

    def send(self, message: bytes) -> None:
        """Hold a message; the oldest makes room where too many are."""
        with self._changed:
            self._held.append(message)
            self._octets += len(message)
            full = len(self._held) > HELD or self._octets > HELD_OCTETS
            if full and not self._is_full:
                self._say(
                    f"{self.name}: {len(self._held) - 1} messages wait, as many as are held; the oldest are lost."
                )
                self._is_full = True
            while len(self._held) > HELD or (self._octets > HELD_OCTETS and len(self._held) > 1):
                self._octets -= len(self._held.popleft())
                self.counts["dropped"] += 1
            self._changed.notify()

    def close(self) -> None:
        """Send what is held, if that takes not too long, and end."""
        self._until_s = time.monotonic() + CLOSING_S
        self._closing.set()
        with self._changed:
            self._changed.notify()
        self._thread.join(CLOSING_S + 3 * LOOK_S)
        if self._held:
            self.counts["dropped"] += len(self._held)
            self._say(f"{self.name}: {len(self._held)} messages could not be sent any more.")

    def _run(self) -> None:
        try:
            self._send_held()
        finally:
            self._ended()

    def _send_held(self) -> None:
        while not self._over():
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
                time.sleep(LOOK_S)
            self._wait_s = min(2 * self._wait_s, LONGEST_S)

    def _over(self) -> bool:
        return self._closing.is_set() and (not self._held or time.monotonic() >= self._until_s)

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
                    self._octets -= len(self._held.popleft())
                if self._is_full and not self._held:
                    self._say(f"{self.name}: nothing waits any more; {self.counts['dropped']} messages were lost.")
                    self._is_full = False
            self.counts["sent"] += 1


def file_outlet(path: str, say: Callable[[str], None]) -> HeldOutlet:
    """Add to a file: see :class:`~elusive.io.added_file.AddedFile`.

    Raises
    ------
    DataError
        If the file cannot be written to from the start.
    """
    if Path(path).is_fifo():  # to open it would wait for a reader, and to close it again end that one
        say(f"{path}: is a pipe; what is told is held until somebody reads from it.")
    else:
        with refused(path), Path(path).open("ab"):
            pass
    file = AddedFile(path)

    def opened() -> tuple[Callable[[bytes], None], Callable[[], None]]:
        return file.send, file.close

    return HeldOutlet(path, opened, say, file.cut)


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
            _send_all(connection, message)
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


def _send_all(connection: socket.socket, message: bytes) -> None:
    """Send a message to one who may be slow: what counts is the time without any octet taken."""
    rest = memoryview(message)
    while rest:
        rest = rest[connection.send(rest) :]


def _hung_up(connection: socket.socket) -> bool:
    """Whether the other side has closed: what is written then would be lost without a word."""
    connection.setblocking(False)
    try:
        while octets := connection.recv(1 << 16):  # what it says is not listened to
            pass
    except BlockingIOError:
        return False
    finally:
        connection.settimeout(STALLED_S)
    return not octets
