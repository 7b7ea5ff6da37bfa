"""Files that are added to while a run lasts: a full disk cuts no line, and a file that was moved away is begun anew."""

from __future__ import annotations

import contextlib
import os
import stat
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

from elusive.errors import DataError
from elusive.io.atomic import refused

MOST = 1 << 25  # octets that are held
AGAIN_S = 1.0  # between two tries


class AddedFile:
    """Adds lines to a file, or to a new one where it was moved away, as logs are rotated.

    Parameters
    ----------
    path
        Of the file.
    head
        What a new one begins with.
    """

    def __init__(self, path: str | os.PathLike[str], head: bytes = b"") -> None:
        self._path, self._head = Path(path), head
        self._descriptor: int | None = None
        self._which: tuple[int, int] | None = None  # device and number of the file
        self._begun, self._rest = b"", b""  # the message of which a part stands there, and its rest

    def send(self, message: bytes) -> None:
        """Add a message; given again after a failure it is completed, where it was begun.

        Raises
        ------
        OSError
            If the system refuses, or takes a part only.
        """
        descriptor = self._opened()
        if self._rest:
            self._write(descriptor, self._begun, self._rest)
            if self._begun is message:
                return
        self._write(descriptor, message, message)

    def close(self) -> None:
        """Close the file; the next message opens it again."""
        if self._descriptor is not None:
            os.close(self._descriptor)
        self._descriptor = None

    def cut(self) -> None:
        """Take back the part of a message that stands at the end, as nothing will complete it, and close the file."""
        if self._rest and self._begun and self._which is not None:
            written = len(self._begun) - len(self._rest)
            with contextlib.suppress(OSError), self._path.open("r+b") as file:
                of = os.fstat(file.fileno())
                if (of.st_dev, of.st_ino) == self._which and stat.S_ISREG(of.st_mode):
                    file.truncate(of.st_size - written)
        self._begun = self._rest = b""
        self.close()

    def _opened(self) -> int:
        if self._descriptor is not None:
            if _is_there(self._path, self._descriptor):
                return self._descriptor
            self.close()
        self._descriptor = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        of, known = os.fstat(self._descriptor), self._which
        self._which = of.st_dev, of.st_ino
        if not of.st_size:
            self._rest = b""
            self._write(self._descriptor, self._head, self._head)
        elif self._which != known:
            self._rest = b"" if _ends_a_line(self._path) else b"\n"  # after what a kill has cut
            self._begun = b""
        return self._descriptor

    def _write(self, descriptor: int, message: bytes, rest: bytes) -> None:
        try:
            while rest:
                rest = rest[os.write(descriptor, rest) :]
        finally:
            self._begun, self._rest = (message, rest) if rest is not message else (b"", b"")


def _ends_a_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\n"


def _is_there(path: Path, descriptor: int) -> bool:
    """Whether a file that is open still has its name."""
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


class HeldFile:
    """A text file whose lines stand in it once it is flushed; those that the system refuses are held for later.

    Parameters
    ----------
    path
        Of a new file.
    head
        What it begins with.
    say
        Told when it cannot be written to, and when it can again.

    Raises
    ------
    DataError
        If it cannot be written to from the start.
    """

    def __init__(self, path: Path, head: str, say: Callable[[str], None]) -> None:
        self._path, self._say = path, say
        self._file = AddedFile(path, head.encode())
        with refused(path):
            self._file.send(b"")
        self._held: deque[bytes] = deque()
        self._octets = self._lost = 0
        self._gone_s, self._due_s = float("nan"), 0.0

    def write(self, line: str) -> int:
        """Take a line; of more than are held, the oldest are lost."""
        self._held.append(line.encode())
        self._octets += len(self._held[-1])
        while self._octets > MOST:
            self._octets -= len(self._held.popleft())
            self._lost += 1
        return len(line)

    def flush(self) -> None:
        """Write what is held, if the system takes it."""
        now_s = time.monotonic()
        if not self._held or now_s < self._due_s:
            return
        held = len(self._held)
        try:
            while self._held:
                self._file.send(self._held[0])
                self._octets -= len(self._held.popleft())
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.close()
            if self._gone_s != self._gone_s:
                self._gone_s = now_s
                self._say(
                    f"{self._path}: cannot be written to ({error.strerror or error}); tracking goes on, and its lines "
                    "are held."
                )
            self._due_s = now_s + AGAIN_S
            return
        if self._gone_s == self._gone_s:
            self._say(
                f"{self._path}: is back after {now_s - self._gone_s:.1f} s; {held} lines were held, {self._lost} lost."
            )
            self._gone_s, self._due_s, self._lost = float("nan"), 0.0, 0

    def close(self) -> None:
        """Write what is held, if the system takes it, and end.

        Raises
        ------
        DataError
            If it does not; no line is cut.
        """
        self._due_s = 0.0
        self.flush()
        with contextlib.suppress(OSError):
            self._file.cut()
        if self._held:
            raise DataError(
                f"{self._path}: its last {len(self._held)} lines could not be written any more; check space there."
            )
