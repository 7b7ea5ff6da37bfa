"""Frames of a signal that is being written, each once its last sample is there: a file that grows, standard input.

They are the frames that :func:`~elusive.io.signals.open_signal` gives of the whole file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from functools import partial
from itertools import chain, count
from pathlib import Path
from typing import Any, BinaryIO, Protocol, cast

from elusive.contracts import Array
from elusive.errors import DataError, ElusiveError
from elusive.io._raw_samples import Raw, RawForm
from elusive.io._signal_csv import open_table
from elusive.io._signal_readings import Cut, Reading, channel_of, read_table
from elusive.io._stack import decoding
from elusive.io._standard_input import STANDARD_INPUT, standard_input
from elusive.io._wav import ADVICE, Wav, wav_header
from elusive.io.signals import TEXT, SignalSource, check_long, cut_of, source_of
from elusive.io.sources import Feed, is_address
from elusive.io.sources.grown import Grown
from elusive.io.sources.lines import every_line

__all__ = ["STANDARD_INPUT", "RawForm", "follow_signal"]

HEADER = 1 << 20  # octets, at most
UNTOLD_FROM = 0x7FFFF000  # octets: what writers put for a length that they do not know yet


class _Peekable(Protocol):
    """A buffered stream."""

    def read1(self, size: int, /) -> bytes: ...
    def peek(self, size: int, /) -> bytes: ...


class _BegunAnewError(ElusiveError):
    """A file that is followed was begun anew."""


class _Octets:
    """Octets of a file that grows, or of a pipe, in the order in which they come."""

    def __init__(self, file: BinaryIO, path: Path | None, feed: Feed) -> None:
        self._file, self._path, self._feed = file, path, feed  # no path: a pipe
        self._grown = None if path is None else Grown(file, str(path), feed)
        feed.stir()

    def take(self, count: int) -> bytes:
        """Wait for so many; fewer: nothing more comes.

        Raises
        ------
        _BegunAnewError
            If what comes next is the start of another.
        """
        parts, left = list[bytes](), count
        while left:
            part = cast(_Peekable, self._file).read1(left)
            if part:
                self._feed.stir()
                parts.append(part)
                left -= len(part)
            elif not self.waited():
                break
        return b"".join(parts)

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
        _BegunAnewError
            If what comes next is the start of another.
        """
        if self._path is None or self._grown is None or self._feed.over:
            return False
        if self._grown.begun_anew():
            self._file.close()
            self._file = self._path.open("rb")
            self._grown = Grown(self._file, str(self._path), self._feed)
            raise _BegunAnewError
        return True


def follow_signal(
    source: str,
    feed: Feed,
    *,
    frame_samples: int | None = None,
    hop_samples: int | None = None,
    channel: int | None = None,
    rate_hz: float | None = None,
    raw: RawForm | None = None,
) -> SignalSource:
    """Open a signal that is being written; waits for what says how it is laid out. Its frames are read once.

    Parameters
    ----------
    source
        A ``.wav``, text, or with ``raw`` any file; ``-`` for standard input.
    feed
        When it ends, and what cannot be used.
    frame_samples, hop_samples, channel, rate_hz, raw
        As :func:`~elusive.io.signals.open_signal` has them.

    Raises
    ------
    DataError
        If it is of no kind that can be followed, or an argument does not fit it.
    """
    if is_address(source):
        raise DataError(f"{source}: a signal is followed in a file or on standard input; pipe it, and give -.")
    cut, long_only = cut_of(frame_samples, hop_samples), frame_samples is not None or hop_samples is not None
    piped, path = source == STANDARD_INPUT, Path(source)
    name, suffix = "standard input" if piped else source, path.suffix.lower()
    if not piped and raw is None and suffix not in (".wav", *TEXT):
        raise DataError(
            f"{name}: files of type {suffix or '(none)'} are not followed; give a .wav, text, or --raw s16 and the "
            "like for samples without a header."
        )
    try:
        file = standard_input() if piped else path.open("rb")
    except OSError as error:
        raise DataError(f"{source}: cannot be read ({error.strerror}); check the path.") from None
    is_wave = raw is None and (suffix == ".wav" or (piped and cast(_Peekable, file).peek(4)[:4] in (b"RIFF", b"RF64")))
    if channel is not None and not is_wave:
        file.close()
        raise DataError(f"{name}: channel={channel} chooses in a WAVE file, and this is none; leave it out.")
    try:
        hop: int | None = cut.hop
        if is_wave or raw is not None:
            octets = _Octets(file, None if piped else path, feed)
            reading = _of_wave(octets, path, cut, channel, name) if raw is None else _of_raw(octets, cut, raw)
        else:
            opened: Iterator[BinaryIO] = chain([file], (path.open("rb") for _ in count()))
            lines = every_line(lambda: next(opened), name, None if piped else feed)
            reading, is_long = read_table(open_table(Path(name), lines, feed), cut, name)
            check_long(name, reading, is_long=is_long, long_only=long_only)
            hop = cut.hop if is_long else None
        return source_of(name, reading, rate_hz, hop)
    except DataError:
        file.close()
        raise


def _of_raw(octets: _Octets, cut: Cut, raw: RawForm) -> Reading:
    form = Raw.of(raw)
    return _reading(octets, form.block, form.decoded, cut, None, lambda: None, lambda: math.inf)


def _of_wave(octets: _Octets, path: Path, cut: Cut, channel: int | None, name: str) -> Reading:
    wav = _header(octets, path, name)

    def begun() -> None:
        other = _header(octets, path, name)
        if other._replace(offset=0, length=0) != wav._replace(offset=0, length=0):
            raise DataError(
                f"{name}: has {other.channels} channels at {other.rate_hz:g} Hz in blocks of {other.block} octets now, "
                f"and had {wav.channels} at {wav.rate_hz:g} Hz in {wav.block}; begin anew."
            )

    def told() -> float:
        """Ask for the samples that the header tells, which is written again as the file grows."""
        now = wav
        if not octets.is_pipe:
            with suppress(OSError, ValueError), path.open("rb") as file:  # as it is begun anew
                now = wav_header(file.read, path)
        return now.length if 0 < now.length * now.block < UNTOLD_FROM else math.inf

    decoded = partial(wav.decoded, channel=channel_of(wav, channel, name))
    return _reading(octets, wav.block, decoded, cut, wav.rate_hz / cut.hop, begun, told)


def _header(octets: _Octets, path: Path, name: str) -> Wav:
    while True:
        octets.head(HEADER)
        with suppress(_BegunAnewError), decoding(name, ADVICE):
            wav = wav_header(octets.take, path)
            octets.head(wav.offset)
            return wav


def _reading(
    octets: _Octets,
    block: int,
    decoded: Callable[[bytes], Array],
    cut: Cut,
    rate_hz: float | None,
    begun: Callable[[], None],
    told: Callable[[], float],
) -> Reading:
    """Cut samples into frames as they come; what stands behind their told length is none of them.

    ``begun`` reads what stands before the samples of a file that was begun anew, and ``told`` tells how many there are.
    """
    size, hop = cut.size * block, cut.hop * block

    def of_one() -> Iterator[bytes]:
        held, number = b"", 0
        while True:
            held += octets.take(size - len(held))
            if len(held) < size:
                return
            while number * cut.hop + cut.size > told():
                if not octets.waited():
                    return
            yield held
            number += 1
            held = held[hop:]
            if hop > size:
                octets.take(hop - size)

    def frames(start: int, stop: int | None) -> Iterator[tuple[float | None, Any]]:
        with closing(octets):
            while True:
                try:
                    for held in of_one():
                        yield None, decoded(held)
                except _BegunAnewError:
                    begun()
                else:
                    return

    return Reading(cut.size, None, rate_hz, False, frames)
