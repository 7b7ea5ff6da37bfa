"""Frames of a signal that is being written, each once its last sample is there: a file that grows, standard input.

They are the frames that :func:`~elusive.io.signals.open_signal` gives of the whole file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import replace
from functools import partial
from itertools import chain, count
from pathlib import Path
from typing import BinaryIO, cast

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io._followed_octets import BegunAnewError, Octets, Peekable
from elusive.io._opened import readable
from elusive.io._raw_samples import Raw, RawForm
from elusive.io._signal_csv import open_table
from elusive.io._signal_readings import Cut, FilePlace, Piece, Reading, channel_of, read_table
from elusive.io._stack import decoding
from elusive.io._standard_input import STANDARD_INPUT, standard_input
from elusive.io._wav import ADVICE, Wav, wav_header
from elusive.io.signals import TEXT, SignalPlace, SignalSource, check_long, cut_of, source_of
from elusive.io.sources import Feed, is_address
from elusive.io.sources.lines import every_line

__all__ = ["STANDARD_INPUT", "RawForm", "follow_signal"]

HEADER = 1 << 20  # octets, at most
UNTOLD_FROM = 0x7FFFF000  # octets: what writers put for a length that they do not know yet


def follow_signal(
    source: str,
    feed: Feed,
    *,
    frame_samples: int | None = None,
    hop_samples: int | None = None,
    channel: int | None = None,
    rate_hz: float | None = None,
    raw: RawForm | None = None,
    after: SignalPlace | None = None,
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
    after
        Frame of an earlier run to go on after. Of a file that is another now, all are new, and they are counted on.

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
    with readable(source):
        file = standard_input() if piped else path.open("rb")
    is_wave = raw is None and (suffix == ".wav" or (piped and cast(Peekable, file).peek(4)[:4] in (b"RIFF", b"RF64")))
    if channel is not None and not is_wave:
        file.close()
        raise DataError(f"{name}: channel={channel} chooses in a WAVE file, and this is none; leave it out.")
    try:
        hop: int | None = cut.hop
        if is_wave or raw is not None:
            octets = Octets(file, None if piped else path, feed)
            known = None if after is None else after.file
            if raw is None:
                reading = _of_wave(octets, path, cut, channel, name, known)
            else:
                form = Raw.of(raw)
                reading = _reading(octets, form.block, form.decoded, cut, None, lambda: None, lambda: math.inf, known)
        else:
            opened: Iterator[BinaryIO] = chain([file], (path.open("rb") for _ in count()))
            lines = every_line(lambda: next(opened), name, None if piped else feed)
            reading, is_long = read_table(open_table(Path(name), lines, feed), cut, name)
            check_long(name, reading, is_long=is_long, long_only=long_only)
            hop = cut.hop if is_long else None
        found = source_of(name, reading, rate_hz, hop)
        return found if after is None else replace(found, start=after.number + 1, goes_on=True)
    except DataError:
        file.close()
        raise


def _of_wave(octets: Octets, path: Path, cut: Cut, channel: int | None, name: str, known: FilePlace | None) -> Reading:
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
    return _reading(octets, wav.block, decoded, cut, wav.rate_hz / cut.hop, begun, told, known, wav.offset)


def _header(octets: Octets, path: Path, name: str) -> Wav:
    while True:
        octets.head(HEADER)
        with suppress(BegunAnewError), decoding(name, ADVICE):
            wav = wav_header(octets.take, path)
            octets.head(wav.offset)
            return wav


def _reading(
    octets: Octets,
    block: int,
    decoded: Callable[[bytes], Array],
    cut: Cut,
    rate_hz: float | None,
    begun: Callable[[], None],
    told: Callable[[], float],
    known: FilePlace | None,
    offset: int = 0,
) -> Reading:
    """Cut samples into frames as they come; what stands behind their told length is none of them.

    ``begun`` reads what stands before the samples of a file that was begun anew, and ``told`` tells how many there are.
    ``known`` is where a run before came to, and ``offset`` what stands before the samples then.
    """
    size, hop = cut.size * block, cut.hop * block
    shared, passed = max(0, size - hop), max(0, hop - size)

    def of_one(known: FilePlace | None) -> Iterator[Piece]:
        held, number = b"", 0
        if known is not None and octets.went_on(known):
            number = 1 + (known.at - offset - size) // hop
            octets.back(shared)
        while True:
            if number:
                held = held[-shared:] if shared else b""
                octets.take(passed)
            held += octets.take(size - len(held))
            if len(held) < size:
                return
            while number * cut.hop + cut.size > told():
                if not octets.waited():
                    return
            yield Piece(None, decoded(held), octets.place(held))
            number += 1

    def frames(start: int, stop: int | None) -> Iterator[Piece]:
        after = known
        with closing(octets):
            while True:
                try:
                    yield from of_one(after)
                except BegunAnewError:
                    begun()
                    after = None
                else:
                    return

    return Reading(cut.size, None, rate_hz, False, frames)
