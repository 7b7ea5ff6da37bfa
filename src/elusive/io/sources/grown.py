"""A file that is added to, watched for being begun anew: cut short, written over, or left for another of its name."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

from elusive.io.sources.feed import Feed

POLL_S = 0.05  # how often it is looked at
LAST = 256  # octets before the place where reading stands, which do not change while a file is only added to


class Grown:
    """Looks after an open file between two reads at its end.

    Parameters
    ----------
    file
        Open at the start.
    name
        Its path.
    feed
        Whose end wakes who waits, and who is told and counts that it was begun anew.
    """

    def __init__(self, file: BinaryIO, name: str, feed: Feed) -> None:
        self._file, self._name, self._feed = file, name, feed
        self.head = 0
        """Octets at the start that may change, as of a header that tells how long the file is by now."""

    def begun_anew(self) -> bool:
        """Wait a little where all has been read; whether reading begins at the start of what bears the name now."""
        why = self._why()
        if why:
            self._feed.counts["restarted"] += 1
            self._feed.say(f"{self._name}: {why}; it is read from its start.")
            self._feed.stir()
        return bool(why)

    def _why(self) -> str:
        at = self._file.tell()
        if self._is_another():
            return "" if self._size > at else "is another file now"  # what was written to the old one last comes first
        last = self._before(at)
        self._feed.halted.wait(POLL_S)
        if self._size < at:
            return "got shorter"
        return "was written anew" if self._before(at) != last else ""

    @property
    def _size(self) -> int:
        return os.fstat(self._file.fileno()).st_size

    def _is_another(self) -> bool:
        try:
            return not os.path.samestat(Path(self._name).stat(), os.fstat(self._file.fileno()))
        except FileNotFoundError:  # between its removal and the next
            return False

    def _before(self, at: int) -> bytes:
        first = min(at, max(self.head, at - LAST))
        self._file.seek(first)
        octets = self._file.read(at - first)
        self._file.seek(at)
        return octets
