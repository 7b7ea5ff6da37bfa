"""Frames of an animated GIF, its rate and its completeness read from the block structure alone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from elusive.errors import DataError
from elusive.io._pillow import open_pillow
from elusive.io._stack import Stack, check_size, decoding

ADVICE = "export the GIF again, or pass stop to end before it."


class _Outline(NamedTuple):
    delays_cs: list[int]  # one a complete frame
    complete: bool  # the trailer was reached


def open_gif(path: Path) -> Stack:
    """Read a GIF frame by frame; its delays are its rate, or, where they vary, its times; zero says nothing."""
    with decoding(str(path), ADVICE), path.open("rb") as file:
        outline = _outline(file)
        file.seek(0)
        with open_pillow(file, ("GIF",)) as image:
            shape = (image.height, image.width)
    check_size(shape, str(path))
    found = len(outline.delays_cs)
    if found == 0 and outline.complete:
        raise DataError(f"{path}: holds no frame; check the export.")
    delays = set(outline.delays_cs)
    delay = delays.pop() if len(delays) == 1 else 0
    times = None
    if outline.complete and len(set(outline.delays_cs)) > 1 and min(outline.delays_cs) > 0:
        times = np.concatenate([[0.0], np.cumsum(outline.delays_cs[:-1]) / 100])
    # A GIF that is cut short counts its broken frame, so that reading to the end meets it instead of passing over it.
    length = found if outline.complete else found + 1

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        with ExitStack() as stack:
            with decoding(str(path), ADVICE):
                image = stack.enter_context(open_pillow(stack.enter_context(path.open("rb")), ("GIF",)))
            for k in range(start, length if stop is None else stop):
                where = f"{path}, frame {k}"
                if k >= found:
                    raise DataError(f"{where}: the file is cut short here; {ADVICE}")
                with decoding(where, ADVICE):
                    image.seek(k)
                    raw = np.array(image.convert("RGB"))
                yield where, raw

    return Stack(str(path), shape, length, 100 / delay if delay else None, read, times)


def _outline(file: IO[bytes]) -> _Outline:
    header = file.read(13)
    if header[:6] not in (b"GIF87a", b"GIF89a") or len(header) < 13:
        raise ValueError("it does not begin as a GIF does")
    _skip_colours(file, header[10])
    delays: list[int] = []
    delay = 0
    try:
        while (kind := _take(file, 1)) != b"\x3b":
            if kind == b"\x21":
                label = _take(file, 1)
                first = _blocks(file)
                if label == b"\xf9" and len(first) == 4:
                    delay = int.from_bytes(first[1:3], "little")
            elif kind == b"\x2c":
                _skip_colours(file, _take(file, 9)[8])
                _take(file, 1)
                _blocks(file)
                delays.append(delay)
                delay = 0
            else:
                return _Outline(delays, complete=False)
    except EOFError:
        return _Outline(delays, complete=False)
    return _Outline(delays, complete=True)


def _take(file: IO[bytes], n: int) -> bytes:
    data = file.read(n)
    if len(data) < n:
        raise EOFError
    return data


def _skip_colours(file: IO[bytes], flags: int) -> None:
    if flags & 0x80:
        file.seek(3 * 2 ** ((flags & 7) + 1), 1)


def _blocks(file: IO[bytes]) -> bytes:
    """Pass over a chain of sub-blocks and return the first."""
    first = block = _take(file, _take(file, 1)[0])
    while block:
        block = _take(file, _take(file, 1)[0])
    return first
