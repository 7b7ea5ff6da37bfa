"""Lines of a log, numbered: of a file, of a file that grows, or of standard input as they come."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import closing
from pathlib import Path
from typing import BinaryIO

from elusive.errors import DataError
from elusive.io._standard_input import STANDARD_INPUT, standard_input

POLL_S = 0.05  # how often a growing file is looked at

Lines = Generator[tuple[int, str], None, None]


def lines_of(source: str, follow: bool = False, idle_s: float | None = None) -> Lines:
    """Yield each line's number, from 1, and text; blank lines are left out.

    Parameters
    ----------
    source
        A file, or ``-`` for standard input.
    follow
        Whether to wait for more where the file ends; a line is yielded once it is complete.
    idle_s
        With ``follow``: end after this time without a new line; None waits for ever.

    Raises
    ------
    DataError
        If the file cannot be read, is no UTF-8 text, or gets shorter while it is followed.
    """
    try:
        if source == STANDARD_INPUT:
            yield from _numbered(standard_input(), "standard input", False, None)
            return
        with Path(source).open("rb") as file:
            yield from _numbered(file, source, follow, idle_s)
    except OSError as error:
        raise DataError(f"{source}: cannot be read ({error.strerror}); check the path.") from None


def _numbered(file: BinaryIO, name: str, follow: bool, idle_s: float | None) -> Lines:
    number, begun, latest = 0, b"", time.monotonic()
    while True:
        octets = file.readline()
        if follow and not octets.endswith(b"\n"):
            # the end of the file, perhaps in the middle of a line that is being written
            begun += octets
            if octets:
                latest = time.monotonic()
            elif Path(name).stat().st_size < file.tell():
                raise DataError(f"{name}: got shorter while it was followed; start again on the new file.")
            elif idle_s is not None and time.monotonic() - latest >= idle_s:
                octets, follow = b"", False
            if follow:
                time.sleep(POLL_S)
                continue
        whole, begun = begun + octets, b""
        if not whole:
            return
        latest = time.monotonic()
        number += 1
        try:
            text = whole.decode("utf-8-sig" if number == 1 else "utf-8").strip()
        except UnicodeDecodeError:
            raise DataError(f"{name}, line {number}: is not text in UTF-8; save it as plain text.") from None
        if text:
            yield number, text


def after(lines: Lines, line: int) -> Lines:
    """Yield the lines whose number is larger."""
    with closing(lines):
        for number, text in lines:
            if number > line:
                yield number, text


def chained(first: list[tuple[int, str]], lines: Lines) -> Lines:
    """Yield lines already read, and then the others."""
    yield from first
    yield from lines
