"""One-dimensional signals, read lazily frame by frame: arrays (time, sample), and long recordings cut into frames."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io._opened import existing_file
from elusive.io._raw_samples import Raw, RawForm
from elusive.io._signal_csv import open_table
from elusive.io._signal_readings import Cut, FilePlace, Piece, Reading, open_array, open_raw, open_recording, read_table
from elusive.io._stack import MAX_PIXELS
from elusive.io.fill_values import without_fill

TEXT = (".csv", ".tsv", ".txt")
SUPPORTED = (".npy", ".wav", *TEXT)
FRAME_SAMPLES = 1200  # of a long recording, where nothing else is asked for


class SignalPlace(NamedTuple):
    """Where a frame of a file that grows stands."""

    number: int  # of the frame, from 0
    file: FilePlace


class SignalFrame(NamedTuple):
    """One frame of a signal."""

    time_s: float  # of its first sample; the frame's number where the recording has no clock
    samples: Array  # (n,) real or complex; NaN where missing
    place: SignalPlace | None = None  # where a run can go on from there


@dataclass(frozen=True)
class SignalSource:
    """A signal's frames, opened afresh at each iteration and never held whole in memory.

    Iterating yields :class:`SignalFrame`; each frame's samples are the caller's own, float64 or complex128;
    what is missing is NaN.
    """

    name: str
    samples: int
    """Samples of every frame."""
    length: int | None
    """Frames that iterating yields; None for text, whose end alone tells."""
    rate_hz: float | None
    """Frames a second; None where neither the file nor the caller says."""
    timed: bool
    """Whether times are seconds: from the rate, or from a column of the file."""
    start: int
    """Number in the file, from 0, of the first frame yielded."""
    _read: Callable[[int, int | None], Iterator[Piece]] = field(repr=False)
    _stop: int | None = field(repr=False)
    whole: bool = True
    """Whether iterating ends where the file does."""
    hop: int | None = None
    """Samples from the start of a frame to the next, of a long recording."""
    goes_on: bool = False
    """Whether frames of an earlier run come before the first."""

    def __iter__(self) -> Iterator[SignalFrame]:
        """Yield the frames.

        Raises
        ------
        DataError
            If a frame cannot be read, or there are fewer than two.
        """
        number = self.start
        with closing(self._read(self.start, self._stop)) as frames:  # type: ignore[type-var]
            for time_s, raw, place in frames:
                if time_s is None:
                    time_s = float(number) if self.rate_hz is None else number / self.rate_hz
                is_complex = np.iscomplexobj(raw)
                samples = np.array(raw, dtype=complex) if is_complex else without_fill(np.array(raw, dtype=float))
                yield SignalFrame(time_s, samples, place and SignalPlace(number, place))
                number += 1
        if not self.goes_on:
            _enough(number - self.start, self.name)


def open_signal(
    source: str | os.PathLike[str],
    *,
    frame_samples: int | None = None,
    hop_samples: int | None = None,
    channel: int | None = None,
    start: int = 0,
    stop: int | None = None,
    rate_hz: float | None = None,
    raw: RawForm | None = None,
) -> SignalSource:
    """Open a signal without reading its frames.

    Parameters
    ----------
    source
        ``.npy``: an array (time, sample), or a long recording of one dimension, real or complex. ``.wav``: a long
        recording; integers are scaled to -1 ... 1. ``.csv``, ``.tsv``, ``.txt``: a frame a line, or, with one column, a
        long recording; comma, semicolon or white space between; with or without a line of names; a first column named
        ``time_s`` is the time in seconds; an empty cell is a sample that is missing.
    frame_samples
        Samples of a frame, of a long recording only; 1200 by default. An incomplete last frame is left out.
    hop_samples
        Samples from the start of a frame to the start of the next; by default a frame follows the other. Frames may
        overlap.
    channel
        Channel of a WAVE file, from 0; a file of several needs it.
    start, stop
        First frame, and frame before which to stop, numbered from 0 as in a Python slice.
    rate_hz
        Frames a second, where the file does not say (or, a WAVE file, says wrong).
    raw
        How samples of a file without a header stand in it.

    Returns
    -------
    SignalSource
        The frames, each read when it is due.

    Raises
    ------
    DataError
        If there is no such signal, or its layout is not as above, or an argument does not fit it.
    """
    path = Path(source)
    if start < 0 or (stop is not None and stop <= start):
        raise DataError(f"start={start}, stop={stop}: choose 0 <= start < stop.")
    cut = cut_of(frame_samples, hop_samples)
    chosen = frame_samples is not None or hop_samples is not None
    reading, is_long = _open(path, cut, channel, raw, long_only=chosen)
    length, whole = None, stop is None or (reading.length is not None and stop >= reading.length)
    if reading.length is not None:
        _enough(reading.length, str(path))
        if start >= reading.length:
            raise DataError(f"{path}: has {reading.length} frames, numbered from 0; start={start} is past the last.")
        stop = reading.length if stop is None else min(stop, reading.length)
        length = stop - start
        _enough(length, str(path))
    hop = cut.hop if is_long else None
    opened = source_of(str(path), reading, rate_hz, hop)
    return replace(opened, start=start, length=length, whole=whole, _stop=stop)


def cut_of(frame_samples: int | None, hop_samples: int | None) -> Cut:
    """Return how a long recording is cut.

    Raises
    ------
    DataError
        If a frame would have no samples.
    """
    size = FRAME_SAMPLES if frame_samples is None else frame_samples
    cut = Cut(size, size if hop_samples is None else hop_samples)
    if cut.size < 2 or cut.hop < 1:
        raise DataError(
            f"frame_samples={cut.size}, hop_samples={cut.hop}: a frame has at least 2 samples, and the next begins at "
            "least one later."
        )
    return cut


def source_of(name: str, reading: Reading, rate_hz: float | None, hop: int | None) -> SignalSource:
    """Return all the frames of a reading.

    Raises
    ------
    DataError
        If their size or the rate cannot be.
    """
    if rate_hz is not None and not 0 < rate_hz < float("inf"):
        raise DataError(f"rate_hz={rate_hz}: must be a positive number of frames a second.")
    if not 2 <= reading.samples <= MAX_PIXELS:
        raise DataError(f"{name}: its frames have {reading.samples} samples; between 2 and {MAX_PIXELS} are read.")
    if rate_hz is not None and reading.timed:
        raise DataError(f"{name}: has times of its own (time_s); leave rate_hz={rate_hz:g} out.")
    rate = reading.rate_hz if rate_hz is None else rate_hz
    timed = reading.timed or rate is not None
    return SignalSource(name, reading.samples, None, rate, timed, 0, reading.read, None, True, hop)


def check_long(name: str, reading: Reading, *, is_long: bool, long_only: bool) -> None:
    """Refuse to cut what holds frames already.

    Raises
    ------
    DataError
        If that is asked.
    """
    if long_only and not is_long:
        raise DataError(
            f"{name}: holds frames already, of {reading.samples} samples; leave frame_samples and hop_samples out, "
            "which cut a long recording."
        )


def _open(path: Path, cut: Cut, channel: int | None, raw: RawForm | None, *, long_only: bool) -> tuple[Reading, bool]:
    suffix = path.suffix.lower()
    existing_file(path)
    if raw is not None:
        if channel is not None or suffix in SUPPORTED:
            what = "channel chooses in a WAVE file" if channel is not None else f"{suffix} says itself what it holds"
            raise DataError(f"{path}: raw={raw} is of samples without a header, and {what}; leave one of the two out.")
        return open_raw(path, cut, Raw.of(raw)), True
    if suffix not in SUPPORTED:
        raise DataError(
            f"{path}: files of type {suffix or '(none)'} are not read; give one of {', '.join(SUPPORTED)}, or --raw."
        )
    if channel is not None and suffix != ".wav":
        raise DataError(f"{path}: channel={channel} chooses in a WAVE file, and this is none; leave it out.")
    if suffix == ".wav":
        return open_recording(path, cut, channel), True
    reading, is_long = open_array(path, cut) if suffix == ".npy" else read_table(open_table(path), cut, str(path))
    check_long(str(path), reading, is_long=is_long, long_only=long_only)
    return reading, is_long


def _enough(frames: int, name: str) -> None:
    if frames == 0:
        raise DataError(f"{name}: holds no frame in the part asked for.")
    if frames == 1:
        raise DataError(f"{name}: gives one frame only; evidence is accumulated over frames, so give at least two.")
