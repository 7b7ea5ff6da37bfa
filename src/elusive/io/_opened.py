"""Files that may be compressed by gzip, told by what they hold, and that may end early."""

from __future__ import annotations

import gzip
import io
import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from elusive.errors import DataError

GZIP = b"\x1f\x8b"


class _Unpacked(io.RawIOBase):
    """What a gzip file holds, up to where it is damaged."""

    def __init__(self, packed: io.BufferedReader) -> None:
        self._packed, self._file, self.cut_short = packed, gzip.GzipFile(fileobj=packed), False

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        try:
            octets = b"" if self.cut_short else self._file.read(len(buffer))
        except (EOFError, zlib.error, gzip.BadGzipFile):
            octets, self.cut_short = b"", True
        buffer[: len(octets)] = octets
        return len(octets)

    def close(self) -> None:
        self._packed.close()
        super().close()


@contextmanager
def readable(name: str | os.PathLike[str]) -> Iterator[None]:
    """Turn a refusal of the system to read what bears that name into a sentence: a DataError."""
    try:
        yield
    except OSError as error:
        raise DataError(f"{name}: cannot be read ({error.strerror or error}); check the path.") from None


def existing_file(path: str | os.PathLike[str]) -> Path:
    """Return a file that is there; else a DataError says what is wrong with its name."""
    file = Path(path)
    if not file.is_file():
        raise DataError(f"{path}: {'is a folder' if file.is_dir() else 'there is no such file'}; check the path.")
    return file


def opened(path: str | os.PathLike[str]) -> io.BufferedReader:
    """Open a file to read its octets; of one that gzip compressed, those that it holds.

    Raises
    ------
    OSError
        If it cannot be opened.
    """
    file = Path(path).open("rb")  # noqa: SIM115 - who asks for it closes it
    return io.BufferedReader(_Unpacked(file)) if file.peek(2)[:2] == GZIP else file


def is_cut_short(file: io.BufferedReader) -> bool:
    """Whether a compressed file turned out to end early or to be damaged."""
    return isinstance(file.raw, _Unpacked) and file.raw.cut_short
