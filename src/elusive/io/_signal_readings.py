"""Frames of a signal as each kind of file holds them, before any check of their samples."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from elusive.errors import DataError
from elusive.io._raw_samples import Raw
from elusive.io._signal_csv import Table
from elusive.io._stack import decoding
from elusive.io._wav import ADVICE, Wav, open_wav

SAVE_AGAIN = "save it again with numpy.save, as numbers, without pickled objects."


class FilePlace(NamedTuple):
    """How far a file has been read, and what tells it from another of its name."""

    at: int  # octets from its start
    last: bytes  # those read last


class Piece(NamedTuple):
    """A frame as a file holds it."""

    time_s: float | None  # None: by its number
    samples: Any
    place: FilePlace | None = None  # of a file that grows, where one can be gone on from there


class Reading(NamedTuple):
    """A recording as a file holds it: ``read(start, stop)`` yields its frames."""

    samples: int
    length: int | None
    rate_hz: float | None
    timed: bool
    read: Callable[[int, int | None], Iterator[Piece]]


class Cut(NamedTuple):
    """How a long recording is cut into frames."""

    size: int
    hop: int

    def frames_in(self, length: int, where: str) -> int:
        """Return how many whole frames there are."""
        if length < self.size:
            raise DataError(
                f"{where}: holds {length} samples, fewer than one frame of {self.size}; choose shorter frames "
                "(--frame-samples)."
            )
        return 1 + (length - self.size) // self.hop


def open_array(path: Path, cut: Cut) -> tuple[Reading, bool]:
    """Map a .npy file; say too whether it is one long recording, not an array (time, sample)."""
    with decoding(str(path), SAVE_AGAIN):
        array = np.lib.format.open_memmap(path, mode="r")
    if array.dtype.kind not in "buifc":
        raise DataError(f"{path}: holds {array.dtype} values, not numbers; {SAVE_AGAIN}")
    if array.ndim not in (1, 2):
        raise DataError(f"{path}: has shape {array.shape}; a signal is an array (time, sample), or one long row.")
    is_long = array.ndim == 1
    length = cut.frames_in(len(array), str(path)) if is_long else len(array)

    def read(start: int, stop: int | None) -> Iterator[Piece]:
        with decoding(str(path), SAVE_AGAIN):
            array = np.lib.format.open_memmap(path, mode="r")
        for k in range(start, length if stop is None else stop):
            where = f"{path}, frame {k}"
            with decoding(where, SAVE_AGAIN):
                raw = array[k * cut.hop : k * cut.hop + cut.size] if is_long else array[k]
            yield Piece(None, raw)

    return Reading(cut.size if is_long else array.shape[1], length, None, False, read), is_long


def channel_of(wav: Wav, channel: int | None, name: str) -> int:
    """Return which channel is read.

    Raises
    ------
    DataError
        If there are several and none is chosen, or there is no such.
    """
    if (channel is None and wav.channels > 1) or (channel is not None and not 0 <= channel < wav.channels):
        raise DataError(f"{name}: has {wav.channels} channels; choose one with channel= (--channel), from 0.")
    return channel or 0


def open_recording(path: Path, cut: Cut, channel: int | None) -> Reading:
    """Read a WAVE file, a frame at a time."""
    wav = open_wav(path)
    channel = channel_of(wav, channel, str(path))
    length = cut.frames_in(wav.length, str(path))

    def read(start: int, stop: int | None) -> Iterator[Piece]:
        with decoding(str(path), ADVICE), path.open("rb") as file:
            for k in range(start, length if stop is None else stop):
                where = f"{path}, frame {k}"
                with decoding(where, ADVICE):
                    raw = wav.read(file, k * cut.hop, cut.size, channel)
                yield Piece(None, raw)

    return Reading(cut.size, length, wav.rate_hz / cut.hop, False, read)


def open_raw(path: Path, cut: Cut, raw: Raw) -> Reading:
    """Read samples without a header, a frame at a time."""
    length = cut.frames_in(path.stat().st_size // raw.block, str(path))

    def read(start: int, stop: int | None) -> Iterator[Piece]:
        with path.open("rb") as file:
            for k in range(start, length if stop is None else stop):
                file.seek(k * cut.hop * raw.block)
                yield Piece(None, raw.decoded(file.read(cut.size * raw.block)))

    return Reading(cut.size, length, None, False, read)


def read_table(table: Table, cut: Cut, name: str) -> tuple[Reading, bool]:
    """Read the lines of a table; say too whether it is one long recording, a sample a line."""
    is_long = table.columns == 1

    def rows(start: int, stop: int | None) -> Iterator[Piece]:
        with closing(table.lines()) as lines:
            for _, time_s, values in islice(lines, start, stop):
                yield Piece(time_s, values)

    def pieces(start: int, stop: int | None) -> Iterator[Piece]:
        with closing(table.lines()) as lines:
            rest, k = islice(lines, start * cut.hop, None), start
            block = list(islice(rest, cut.size))
            while len(block) == cut.size and (stop is None or k < stop):
                yield Piece(block[0][1], np.array([values[0] for _, _, values in block]))
                beyond = max(cut.hop - cut.size, 0)
                next(islice(rest, beyond, beyond), None)
                block, k = [*block[cut.hop :], *islice(rest, min(cut.hop, cut.size))], k + 1
            if k == 0:
                cut.frames_in(len(block), name)

    reading = Reading(cut.size if is_long else table.columns, None, None, table.timed, pieces if is_long else rows)
    return reading, is_long
