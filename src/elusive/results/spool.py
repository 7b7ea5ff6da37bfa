"""A table of records that grows for as long as it likes at constant memory: what is full goes to a temporary file."""

from __future__ import annotations

import tempfile
import weakref
from collections import Counter
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from elusive.errors import DataError

PART = 1 << 16  # records sorted at once
Records = NDArray[Any]  # (N,) of one structured type


class Spool:
    """Records, of which only the newest stand in memory.

    Parameters
    ----------
    dtype
        Of a record.
    folder
        Where the temporary file goes, which has no name and vanishes with the spool; None: where the system puts such.
    at_once
        Records in memory at most.
    """

    def __init__(self, dtype: np.dtype[Any], folder: Path | None = None, at_once: int = 8192) -> None:
        self.dtype = dtype
        self._newest: Records = np.empty(at_once, dtype)
        self._held = self._filed = 0
        self._folder = folder
        self._file: IO[bytes] | None = None

    def __len__(self) -> int:
        """Return how many records there are."""
        return self._filed + self._held

    def extend(self, records: Records) -> None:
        """Append records ``(n,)``.

        Raises
        ------
        DataError
            If the system refuses to write the temporary file.
        """
        while len(records):
            self.make_room(1)
            room = len(self._newest) - self._held
            part, records = records[:room], records[room:]
            self._newest[self._held : self._held + len(part)] = part
            self._held += len(part)

    def make_room(self, count: int) -> None:
        """See to it that so many records, or as many as are in memory at most, can be appended without a write.

        Raises
        ------
        DataError
            If the system refuses to write the temporary file; nothing is lost.
        """
        if self._held and self._held + min(count, len(self._newest)) > len(self._newest):
            self._write()

    def records(self) -> Records:
        """Return all records, ``(N,)``: a view of those in memory, or a map of the file."""
        if self._filed == 0:
            return self._newest[: self._held]
        self._write()
        assert self._file is not None
        return np.memmap(self._file, self._newest.dtype, "r", shape=self._filed)

    def counts(self, name: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the values of a whole number of the records', ``(K,)`` increasing, and how many records have each."""
        records, found = self.records(), Counter[int]()
        for start in range(0, len(records), PART):
            numbers, sizes = np.unique(records[name][start : start + PART], return_counts=True)
            found.update(dict(zip(numbers.tolist(), sizes.tolist(), strict=True)))
        ordered = sorted(found)
        return np.array(ordered, np.int64), np.array([found[number] for number in ordered], np.int64)

    def sorted_by(self, name: str, numbers: NDArray[np.int64], sizes: NDArray[np.int64]) -> Records:
        """Return all records in the order of a whole number of theirs, those of one number as they came.

        Parameters
        ----------
        name
            Of the number.
        numbers, sizes
            The numbers there are, ``(K,)`` increasing, and how many records have each.
        """
        records = self.records()
        if self._filed == 0:
            return records[np.argsort(records[name], kind="stable")]
        with self._temporary() as file:  # the map outlives it
            ordered = np.memmap(file, self.dtype, "w+", shape=len(records))
        free = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        for start in range(0, len(records), PART):
            part = records[start : start + PART]
            which = np.searchsorted(numbers, part[name])
            order = np.argsort(which, kind="stable")
            groups, first, count = np.unique(which[order], return_index=True, return_counts=True)
            ordered[np.repeat(free[groups] - first, count) + np.arange(len(part))] = part[order]
            free[groups] += count
        return ordered

    def _temporary(self) -> IO[bytes]:
        return tempfile.TemporaryFile(dir=self._folder, buffering=0)

    def _write(self) -> None:
        try:
            if self._file is None:
                self._file = self._temporary()
                weakref.finalize(self, self._file.close)
            self._file.seek(self._filed * self.dtype.itemsize)  # where a write was refused, a part may stand after it
            rest = memoryview(self._newest[: self._held].tobytes())
            while len(rest):
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            raise DataError(f"tracks: cannot be kept ({error.strerror or error}); check space on the disk.") from None
        self._filed += self._held
        self._held = 0
