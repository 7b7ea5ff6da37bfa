"""Samples of a WAVE file: integers of 8 to 64 bits and floats, any number of channels, also over 4 GB (RF64)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io._stack import decoding

ADVICE = "export it again as PCM or float WAVE."
INTEGER, FLOAT, EXTENSIBLE = 1, 3, 0xFFFE
UNTOLD = 0xFFFFFFFF  # what a writer into a pipe, or RF64, puts for the size


class Wav(NamedTuple):
    """Where the samples of a WAVE file stand and how they are written."""

    path: Path
    offset: int  # of the first sample in the file [bytes]
    length: int  # samples of a channel
    rate_hz: float  # samples a second
    channels: int
    width: int  # of one sample of one channel [bytes]
    floating: bool

    @property
    def block(self) -> int:
        """Octets of a sample of all channels."""
        return self.channels * self.width

    def read(self, file: IO[bytes], first: int, count: int, channel: int) -> Array:
        """Read ``count`` samples of a channel from the ``first`` on; integers are scaled to -1 ... 1."""
        file.seek(self.offset + first * self.block)
        data = file.read(count * self.block)
        if len(data) < count * self.block:
            raise ValueError("the file ends early")
        return self.decoded(data, channel)

    def decoded(self, data: bytes, channel: int) -> Array:
        """Return the samples of a channel in so many octets, which are whole samples."""
        raw = np.frombuffer(data, np.uint8).reshape(-1, self.channels, self.width)[:, channel]
        count = len(raw)
        if self.floating:
            return np.ascontiguousarray(raw).view(f"<f{self.width}")[:, 0].astype(np.float64)
        if self.width == 1:  # the one width without a sign
            return (raw[:, 0].astype(np.float64) - 128.0) / 128.0
        room = 4 if self.width == 3 else self.width
        wide = np.zeros((count, room), np.uint8)
        wide[:, room - self.width :] = raw
        return wide.view(f"<i{room}")[:, 0] / 2.0 ** (8 * room - 1)


def open_wav(path: Path) -> Wav:
    """Read the header of a WAVE file.

    Raises
    ------
    DataError
        If it is no WAVE file, is compressed, cut short, or holds no sample.
    """
    with decoding(str(path), ADVICE), path.open("rb") as file:
        wav = wav_header(file.read, path)
    there = path.stat().st_size - wav.offset
    length = there if wav.length < 0 else wav.length * wav.block
    if length > there:
        raise DataError(
            f"{path}: is cut short: its header promises {length} bytes of samples and {there} are there; copy it again."
        )
    if length < wav.block:
        raise DataError(f"{path}: holds no sample; check the recording.")
    return wav._replace(length=length // wav.block)


def wav_header(read: Callable[[int], bytes], path: Path) -> Wav:
    """Read a header up to the first sample; a length that it does not tell is -1.

    Raises
    ------
    DataError
        If samples are compressed.
    ValueError
        If it is no WAVE file.
    """
    offset = 0

    def take(n: int) -> bytes:
        nonlocal offset
        data = read(n)
        if len(data) < n:
            raise ValueError("it ends within its header")
        offset += n
        return data

    riff, _, wave = struct.unpack("<4sI4s", take(12))
    if riff not in (b"RIFF", b"RF64") or wave != b"WAVE":
        raise ValueError("it does not begin as a WAVE file does")
    told_elsewhere, layout = None, None
    while True:
        name, length = struct.unpack("<4sI", take(8))
        if name == b"data":
            break
        body = take(length + length % 2)
        if name == b"ds64":
            told_elsewhere = struct.unpack("<Q", body[8:16])[0]
        elif name == b"fmt ":
            layout = _layout(body, path)
    if layout is None:
        raise ValueError("its samples come before their format")
    if length == UNTOLD:
        length = -1 if told_elsewhere is None else told_elsewhere
    samples = length // (layout["channels"] * layout["width"]) if length >= 0 else -1
    return Wav(path, offset, samples, **layout)


def _layout(body: bytes, path: Path) -> dict[str, Any]:
    kind, channels, rate, _, block, _ = struct.unpack("<HHIIHH", body[:16])
    if kind == EXTENSIBLE:
        (kind,) = struct.unpack("<H", body[24:26])
    width, rest = divmod(block, channels)
    if kind not in (INTEGER, FLOAT):
        raise DataError(f"{path}: its samples are compressed (WAVE format {kind}); {ADVICE}")
    if rest or rate == 0 or width not in ((1, 2, 3, 4, 8) if kind == INTEGER else (4, 8)):
        raise ValueError(f"{channels} channels in blocks of {block} bytes, {rate} a second")
    return {"rate_hz": float(rate), "channels": channels, "width": width, "floating": kind == FLOAT}
