"""Frames of a pipe that say themselves what they are: YUV4MPEG2, PGM, PNG or NumPy arrays, one after the other."""

from __future__ import annotations

import io
import time
from collections.abc import Iterator
from typing import IO, Any

import numpy as np

from elusive.errors import DataError
from elusive.io._arrived import ArrivedFrame
from elusive.io._pillow import open_pillow, pixels
from elusive.io._stack import MAX_PIXELS, check_size, decoding
from elusive.io._standard_input import standard_input
from elusive.io._y4m import MAGIC, Y4m, read_frame, read_header

NAME = "standard input"
PNG, NPY, PGM = b"\x89PNG\r\n\x1a\n", b"\x93NUMPY", b"P5"
CUT = "check what writes it."
KNOWN = "is no stream of YUV4MPEG2, PGM, PNG or .npy frames; write such, as does ffmpeg -i ... -f yuv4mpegpipe -"


class Piped:
    """Frames from standard input. Whoever writes waits while it is full: none is left out."""

    def __init__(self) -> None:
        self.name = NAME
        self._stream = standard_input()

    def halt(self) -> None:
        """Do nothing: a reader that waits for a pipe ends with the program."""

    def __iter__(self) -> Iterator[ArrivedFrame]:
        """Yield the frames.

        Raises
        ------
        DataError
            If they are of no known kind, or cannot be decoded.
        """
        rate_hz = None
        start = self._stream.peek(len(MAGIC))
        if start.startswith(MAGIC):
            header = read_header(self._stream)
            if header is None:
                raise DataError(f"{NAME}: {KNOWN}")
            frames, rate_hz = _y4m(self._stream, header), header.rate_hz
        else:
            kinds = {PNG: _png, NPY: _npy, PGM: _pgm}
            kind = next((read for magic, read in kinds.items() if start.startswith(magic)), None)
            if kind is None:
                raise DataError(f"{NAME}: {KNOWN if start else 'is empty; check what writes it.'}")
            frames = _one_by_one(self._stream, kind)
        number = 0
        while True:
            where = f"{NAME}, frame {number}"
            with decoding(where, CUT):
                raw = next(frames, None)
            if raw is None:
                return
            yield ArrivedFrame(where, raw, time.monotonic(), number / rate_hz if rate_hz else None, waits=True)
            number += 1


def _y4m(stream: IO[bytes], header: Y4m) -> Iterator[np.ndarray[Any, Any]]:
    check_size(header.shape, NAME)
    while (frame := read_frame(stream, header)) is not None:
        yield frame


def _one_by_one(stream: io.BufferedReader[Any], read: Any) -> Iterator[np.ndarray[Any, Any]]:
    while stream.peek(1):
        yield read(stream)


def _npy(stream: IO[bytes]) -> np.ndarray[Any, Any]:
    found: np.ndarray[Any, Any] = np.lib.format.read_array(stream, allow_pickle=False)
    return found


def _png(stream: IO[bytes]) -> np.ndarray[Any, Any]:
    """Gather the chunks of one picture and decode them."""
    parts = [_exactly(stream, len(PNG))]
    while parts[-1][4:8] != b"IEND":
        head = _exactly(stream, 8)
        length = int.from_bytes(head[:4], "big")
        if length > 8 * MAX_PIXELS:
            raise ValueError("a chunk of impossible length")
        parts.append(head + _exactly(stream, length + 4))
    with open_pillow(io.BytesIO(b"".join(parts)), ("PNG",)) as image:
        check_size((image.height, image.width), NAME)
        return pixels(image)


def _pgm(stream: IO[bytes]) -> np.ndarray[Any, Any]:
    numbers: list[int] = []
    _exactly(stream, 2)
    while len(numbers) < 3:
        line = stream.readline(1024)
        if not line:
            raise ValueError("its header is cut short")
        numbers += [int(word) for word in line.partition(b"#")[0].split()]
    columns, rows, most = numbers
    check_size((rows, columns), NAME)
    dtype = np.dtype(">u2" if most > 255 else "u1")
    return np.frombuffer(_exactly(stream, rows * columns * dtype.itemsize), dtype).reshape(rows, columns)


def _exactly(stream: IO[bytes], size: int) -> bytes:
    found = stream.read(size)
    if len(found) < size:
        raise ValueError("it ends in the middle of a frame")
    return found
