"""Frames as they come: from a camera, a network stream, a folder that is written to, or standard input."""

from __future__ import annotations

import glob
import math
import os
from collections.abc import Callable, Iterator
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io import _growing
from elusive.io._arrived import ArrivedFrame
from elusive.io._growing import GrowingFolder
from elusive.io._images import IMAGES
from elusive.io._piped_frames import Piped
from elusive.io._standard_input import STANDARD_INPUT
from elusive.io._streams import is_stream
from elusive.io._streams_again import StreamAgain
from elusive.io.arrivals import Arrivals
from elusive.io.frames import BlankFrameError, clean_frame

CLOCKED = 5  # frames whose times tell how far apart frames are, where a stream has times
HELD_S, HELD_BYTES = 10.0, 1 << 28  # frames that wait for the tracker, at most
HOPELESS = 100  # frames that cannot be used, one after the other, before the first that can


class FramePlace(NamedTuple):
    """Where a frame stands in a folder."""

    number: int  # from 0, of all that came
    name: str  # of its file
    step: int  # by which names are numbered; 0 where they are not, evenly


class TimedFrame(NamedTuple):
    """A frame and its time."""

    time_s: float
    pixels: Array | None  # (rows, columns), NaN where masked; None where the frame cannot be used
    place: FramePlace | None = None  # None where it is not found again


class LiveFrames:
    """Frames as they come, in a bounded queue; iterated over once, and read from when the first is asked for.

    Where more come than are taken, the oldest are dropped and counted: their time passes. Frames that wait where they
    are, in a pipe or in a folder before this is read, are all handed over. A frame that cannot be used is there
    without pixels, and ``on_fault`` is told why.
    """

    def __init__(
        self,
        source: Piped | StreamAgain | GrowingFolder,
        rate_hz: float | None = None,
        held_s: float = HELD_S,
        held_bytes: int = HELD_BYTES,
        on_fault: Callable[[str], None] = lambda sentence: None,
    ) -> None:
        self.name = source.name
        self.came_s = math.nan
        self.unusable = 0
        """Frames that could not be used."""
        self._source, self._rate_hz, self._on_fault = source, rate_hz, on_fault
        self._before = 0  # frames that came in an earlier run, or since
        self._after: tuple[FramePlace, float] | None = None
        self._coming = Arrivals(
            enumerate(source),
            held_bytes,
            lambda item: 0.0 if item[1].raw is None else item[1].raw.nbytes,
            held_s,
            lambda item: not item[1].waits,
            source.halt,
        )
        self._frames = iter(self._coming)
        self._ahead: list[tuple[tuple[int, ArrivedFrame], float]] = []

    @property
    def dropped(self) -> int:
        """Frames that newer ones pushed out."""
        return self._coming.dropped

    @property
    def counts(self) -> dict[str, int]:
        """What the source met."""
        again = self._source.reconnected if isinstance(self._source, StreamAgain) else 0
        return {"late": self.late, "unusable": self.unusable, "reconnected": again}

    @property
    def late(self) -> int:
        """Files whose names come before one that had been read by then; they are left out."""
        return self._source.late if isinstance(self._source, GrowingFolder) else 0

    @property
    def starts_anew(self) -> bool:
        """Whether its times begin again where it is opened again."""
        return not isinstance(self._source, GrowingFolder)

    def go_on(self, place: FramePlace, elapsed_s: float) -> None:
        """Go on, before the first frame is asked for, after one of an earlier run, which need not be there any more.

        Those that came since and have been removed are counted by the files' numbers, as many at most as come in
        ``elapsed_s``, the time since.
        """
        if isinstance(self._source, GrowingFolder):
            self._source.go_on(place.name, place.step, elapsed_s)
            self._before, self._after = place.number + 1, (place, elapsed_s)

    def stop(self) -> None:
        """End soon, as if the source had ended."""
        self._coming.stop()

    @cached_property
    def _known(self) -> tuple[tuple[int, int], float, bool]:
        """Shape, usual interval and whether times are seconds, once enough frames have come to tell."""
        needed = CLOCKED if self._rate_hz is None else 1
        for item in self._frames:
            self._ahead.append((item, self._coming.came_s))
            usable = [(number, frame) for (number, frame), _ in self._ahead if frame.raw is not None]
            if usable and (len(usable) >= needed or usable[0][1].time_s is None):
                break
            if not usable and len(self._ahead) >= HOPELESS:
                raise DataError(f"{item[1].fault} None of {HOPELESS} frames can be used.")
        else:
            usable = [(number, frame) for (number, frame), _ in self._ahead if frame.raw is not None]
        if not usable:
            raise DataError(f"{self.name}: no frame came.")
        raw = usable[0][1].raw
        assert raw is not None
        shape = (int(raw.shape[0]), int(raw.shape[1]))
        times = [frame.time_s for _, frame in usable if frame.time_s is not None]
        if self._rate_hz is not None:
            return shape, 1 / self._rate_hz, True
        gaps = np.diff(times)
        return shape, float(np.median(gaps)) if (gaps > 0).any() else 1.0, bool(times)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of every frame; waits for the first.

        Raises
        ------
        DataError
            If the source fails or ends before.
        """
        return self._known[0]

    @property
    def interval_s(self) -> float:
        """Usual time between frames; 1 s where nothing is known. Waits as ``shape`` does."""
        return self._known[1]

    @property
    def timed(self) -> bool:
        """Whether times are seconds; else they are the frames' numbers."""
        return self._known[2]

    def __iter__(self) -> Iterator[TimedFrame]:
        """Yield the frames.

        Raises
        ------
        DataError
            If the source fails.
        """
        shape, interval_s, timed = self._known
        latest_s = -math.inf
        for (number, frame), came_s in chain(self._ahead, ((item, self._coming.came_s) for item in self._frames)):
            if self._after is not None:
                (before, elapsed_s), self._after = self._after, None
                self._before += self._lacking(before, frame, elapsed_s)
            number += self._before
            time_s: float | None = number / self._rate_hz if self._rate_hz else float(number)
            if timed and not self._rate_hz:
                time_s = frame.time_s
            if time_s is None or not time_s > latest_s:  # the stream's clock stood still, or was set back
                time_s = latest_s + interval_s
            latest_s, self.came_s = time_s, came_s
            place = FramePlace(number, frame.name, frame.step) if frame.name else None
            yield TimedFrame(time_s, self._usable(frame, shape), place)

    def _lacking(self, before: FramePlace, frame: ArrivedFrame, elapsed_s: float) -> int:
        """Return how many frames came since an earlier run and are gone; of a folder begun anew, as time tells."""
        passed = round(elapsed_s * self._rate_hz) if self._rate_hz else None
        if isinstance(self._source, GrowingFolder) and self._source.begun is not None:
            return 0 if passed is None else max(0, passed - self._source.begun)
        lacking = _growing.lacking(before.name, frame.name, before.step)
        return lacking if passed is None else min(lacking, passed)

    def _usable(self, frame: ArrivedFrame, shape: tuple[int, int]) -> Array | None:
        fault = frame.fault
        if frame.raw is not None:
            try:
                return clean_frame(frame.raw, shape, frame.where)
            except BlankFrameError as error:
                fault = f"{error}; it is left out."
            except DataError as error:
                fault = str(error)
        self.unusable += 1
        self._on_fault(fault)
        return None


def is_live(source: str) -> bool:
    """Whether a source is a camera, a network stream or standard input, which cannot be read as a recording."""
    return source == STANDARD_INPUT or is_stream(source)


def open_live_frames(
    source: str | os.PathLike[str],
    *,
    rate_hz: float | None = None,
    idle_s: float | None = None,
    held_s: float = HELD_S,
    held_bytes: int = HELD_BYTES,
    on_fault: Callable[[str], None] = lambda sentence: None,
) -> LiveFrames:
    """Open a source of frames that are still to come.

    Parameters
    ----------
    source
        ``camera:0``; the address of a network stream (``rtsp://``, ``rtmp://``, ``http://``, ``udp://``, ``tcp://``,
        ``rtp://``, ``srt://``), both by the extra ``video``; a folder that images are written to, a glob of such, or an
        image that is written over;
        ``-``, standard input: YUV4MPEG2, or PGM, PNG or ``.npy`` one after the other.
    rate_hz
        Frames a second, where the source does not say or says wrong; frames are then counted.
    idle_s
        End after this time without a frame; None waits for ever. Not for standard input, whose writer ends it.
    held_s, held_bytes
        How long, and how many, frames wait for the tracker at most, before the oldest are dropped.
    on_fault
        Told why a frame cannot be used, and when a stream goes and is back.

    Raises
    ------
    DataError
        If there is no such folder or camera, or the argument does not fit the source.
    """
    text = os.fspath(source)
    if rate_hz is not None and not 0 < rate_hz < math.inf:
        raise DataError(f"rate_hz={rate_hz}: must be a positive number of frames a second.")
    opened: Piped | StreamAgain | GrowingFolder
    if text == STANDARD_INPUT:
        opened = Piped()
    elif is_stream(text):
        opened = StreamAgain(text, idle_s, on_fault)
    else:
        path = Path(text)
        pattern = path.name if glob.has_magic(path.name) and not path.exists() else None
        if path.is_file() and path.suffix.lower() in IMAGES:  # which a camera writes over
            pattern = glob.escape(path.name)
        opened = GrowingFolder(path if pattern is None else path.parent, pattern, idle_s, on_fault)
    return LiveFrames(opened, rate_hz, held_s, held_bytes, on_fault)
