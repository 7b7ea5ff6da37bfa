"""Octets of a file that is written to, or of a pipe: taken as they come, and gone on with by a later run."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO, Protocol, cast

from elusive.errors import ElusiveError
from elusive.io._signal_readings import FilePlace
from elusive.io.sources import Feed
from elusive.io.sources.grown import LAST, Grown


class Peekable(Protocol):
    """A buffered stream."""

    def read1(self, size: int, /) -> bytes: ...
    def peek(self, size: int, /) -> bytes: ...


class BegunAnewError(ElusiveError):
    """A file that is followed was begun anew."""


class Octets:
    """Octets of a file that grows, or of a pipe, in the order in which they come."""

    def __init__(self, file: BinaryIO, path: Path | None, feed: Feed) -> None:
        self._file, self._path, self._feed = file, path, feed  # no path: a pipe
        self._grown = None if path is None else Grown(file, str(path), feed)
        feed.stir()

    def take(self, count: int) -> bytes:
        """Wait for so many; fewer: nothing more comes.

        Raises
        ------
        BegunAnewError
            If what comes next is the start of another.
        """
        parts, left = list[bytes](), count
        while left:
            part = cast(Peekable, self._file).read1(left)
            if part:
                self._feed.stir()
                parts.append(part)
                left -= len(part)
            elif not self.waited():
                break
        return b"".join(parts)

    def place(self, held: bytes) -> FilePlace | None:
        """Return where reading stands after what was taken last."""
        return None if self._path is None else FilePlace(self._file.tell(), held[-LAST:])

    def went_on(self, place: FilePlace) -> bool:
        """Stand at a place, where this is the file that it is of; that it is not, but begun anew, is said."""
        start = self._file.tell()
        self._file.seek(place.at - len(place.last))
        is_same = self._file.read(len(place.last)) == place.last
        if not is_same:
            self._file.seek(start)
            self._feed.counts["restarted"] += 1
            self._feed.say(f"{self._path}: was begun anew while nobody followed it; it is read from its start.")
        return is_same

    def back(self, count: int) -> None:
        """Give so many back."""
        self._file.seek(-count, os.SEEK_CUR)

    @property
    def is_pipe(self) -> bool:
        """Whether nothing can be read again."""
        return self._path is None

    def head(self, octets: int) -> None:
        """Take so many at the start of the file for what may change."""
        if self._grown is not None:
            self._grown.head = octets

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def waited(self) -> bool:
        """Wait a little; whether more may still come.

        Raises
        ------
        BegunAnewError
            If what comes next is the start of another.
        """
        if self._path is None or self._grown is None or self._feed.over:
            return False
        if self._grown.begun_anew():
            self._file.close()
            self._file = self._path.open("rb")
            self._grown = Grown(self._file, str(self._path), self._feed)
            raise BegunAnewError
        return True
