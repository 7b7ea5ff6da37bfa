"""A camera or network stream that is opened again where it ends or breaks off; its clock goes on."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator

from elusive.errors import DataError
from elusive.io._arrived import ArrivedFrame
from elusive.io._streams import Stream
from elusive.io.sources.feed import FIRST_S, LONGEST_S

ENDS = ("http", "https")  # a file that is fetched: its end is its end


class StreamAgain:
    """Frames of a stream, tried again with longer and longer waits; what does not come at all is refused at once.

    Parameters
    ----------
    source, idle_s
        As of :class:`~elusive.io._streams.Stream`.
    say
        Told when it goes and comes back.

    Raises
    ------
    DataError
        If ffmpeg is not installed or there is no such camera.
    """

    def __init__(self, source: str, idle_s: float | None, say: Callable[[str], None]) -> None:
        self._source, self._idle_s, self._say = source, idle_s, say
        self._now = Stream(source, idle_s)
        self._halted = threading.Event()
        self.name, self.reconnected = self._now.name, 0

    def halt(self) -> None:
        """End the stream."""
        self._halted.set()
        self._now.halt()

    def __iter__(self) -> Iterator[ArrivedFrame]:
        """Yield the frames; their times go on over the time for which nothing came.

        Raises
        ------
        DataError
            If there is no video in it at the first time.
        """
        number, latest = 0, ArrivedFrame("", None, time.monotonic())
        wait_s, gone = FIRST_S, False
        while True:
            shift_s, why = math.nan, "has ended."
            try:
                for frame in self._now:
                    if gone:
                        gone, self.reconnected = False, self.reconnected + 1
                        self._say(f"{self.name}: is back after {frame.came_s - latest.came_s:.1f} s.")
                    if math.isnan(shift_s):
                        since_s = (latest.time_s or 0.0) + frame.came_s - latest.came_s
                        shift_s = since_s - (frame.time_s or 0.0) if number else 0.0
                    time_s = None if frame.time_s is None else frame.time_s + shift_s
                    latest = frame._replace(where=f"{self.name}, frame {number}", time_s=time_s)
                    yield latest
                    number, wait_s = number + 1, FIRST_S
                if self._source.partition("://")[0].lower() in ENDS:
                    return
            except DataError as error:
                if not number:
                    raise
                why = str(error).removeprefix(f"{self.name}: ")
            if self._is_over(latest.came_s):
                return
            if not gone:
                self._say(f"{self.name}: {why} It is tried again until it is back.")
            gone = True
            self._halted.wait(wait_s)
            wait_s = min(2 * wait_s, LONGEST_S)
            if not self._open(latest.came_s):
                return

    def _is_over(self, came_s: float) -> bool:
        idle = self._idle_s is not None and time.monotonic() - came_s >= self._idle_s
        return idle or self._halted.is_set()

    def _open(self, came_s: float) -> bool:
        """Open it again; a camera that is not there yet is waited for. Returns whether it is not over."""
        while not self._is_over(came_s):
            try:
                self._now = Stream(self._source, self._idle_s)
            except DataError:
                self._halted.wait(1.0)
                continue
            if self._halted.is_set():  # meanwhile
                self._now.halt()
            return True
        return False
