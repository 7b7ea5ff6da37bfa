"""The run that `elusive serve` serves: what it goes on from, what it met, what its health page shows."""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil

from elusive.cli.seen import Seeing
from elusive.io.arrivals import Coming
from elusive.io.sinks import Sinks
from elusive.io.sinks.formats import json_line
from elusive.results.checkpoint import Checkpoint
from elusive.results.latency import Latencies
from elusive.results.live import LiveStep
from elusive.tracking.memory import Memory

HEEDED = 50  # latest sentences kept
RATE_OVER_S = 10.0
STEPS_HELD = 3000  # latest that are told to who begins to watch
BEHIND = 300  # steps that a watcher may lag; of more, the oldest are left out for it
SILENCE_S = 5.0  # after which a watcher is told so, whereby it is found out whether it is still there

now: Served | None = None
"""What is served by this process, if anything is."""


class Served:
    """A run with its checkpoint.

    Parameters
    ----------
    title
        Of the page.
    folder
        Where the checkpoint is kept.
    what
        What is run: the checkpoint of something else is refused.
    """

    def __init__(self, title: str, folder: Path, what: str) -> None:
        self.title = title
        self._checkpoint = Checkpoint(folder, what)
        self.memory: Memory = self._checkpoint.memory
        self._resumed_s = None if self._checkpoint.saved is None else self._checkpoint.told_s
        self._started_s = time.monotonic()
        self._steps, self._latest_s, self._tracks = 0, 0.0, 0
        self._latencies = Latencies()
        self._when: deque[float] = deque(maxlen=4096)
        self._heeded: deque[tuple[float, str]] = deque(maxlen=HEEDED)
        self._coming: Coming[Any] | None = None
        self._sinks: Sinks | None = None
        self._first = ""
        self._told: deque[str] = deque(maxlen=STEPS_HELD)
        self._watchers: set[queue.Queue[str]] = set()
        self._turn = threading.Lock()  # watchers come and go in threads of their own

    def close(self) -> None:
        """Let go of the checkpoint."""
        self._checkpoint.close()

    def begin(self, coming: Coming[Any], sinks: Sinks, first: Mapping[str, Any]) -> None:
        """Take note of the source, the sinks and what watchers are told first; sinks go on from the checkpoint."""
        self._coming, self._sinks, self._first = coming, sinks, json_line(first)
        if self._checkpoint.saved is not None:
            sinks.resume(self._checkpoint.saved.told)

    def heed(self, sentence: str) -> None:
        """Keep a sentence that was said."""
        self._heeded.append((time.time(), sentence))

    def is_new(self, live: LiveStep) -> bool:
        """Take in a step, and note in its record what a restart has missed; whether it has not been told before."""
        if live.step.time_s <= self._checkpoint.told_s:
            return False
        now_s = time.monotonic()
        self._steps, self._latest_s = self._steps + 1, now_s
        self._when.append(now_s)
        self._latencies.add(live.latency_s)
        self._tracks = sum(track["status"] == "confirmed" for track in live.record["tracks"])
        if self._resumed_s is not None:
            live.record["gap_s"] = round(live.step.time_s - self._resumed_s, 6)
            live.record["resumed"] = True
            self._resumed_s = None
        return True

    def keep(self, record: Mapping[str, Any], told: Any) -> str:
        """Keep a step before it is told; returns what is to be said of that, if anything is."""
        return self._checkpoint.keep(self.memory, record, told)

    def show(self, live: LiveStep, seeing: Seeing) -> None:
        """Tell a step to who watches, with what was measured."""
        with self._turn:
            self._told.append(json_line(live.record))
            watchers = list(self._watchers)
        line = json_line(live.record | {"seen": seeing(live.step.measurement)}) if watchers else ""
        for watcher in watchers:
            if watcher.full():
                with suppress(queue.Empty):
                    watcher.get_nowait()
            watcher.put_nowait(line)

    def watched(self) -> Iterator[str]:
        """Yield lines for one who watches: what was, then what comes; an empty one where nothing does."""
        mine: queue.Queue[str] = queue.Queue(BEHIND)
        try:
            with self._turn:
                told = list(self._told)
                self._watchers.add(mine)
            yield self._first or "{}"
            yield from told
            while True:
                try:
                    yield mine.get(timeout=SILENCE_S)
                except queue.Empty:
                    yield ""
        finally:
            self._watchers.discard(mine)

    def health(self) -> dict[str, Any]:
        """Return what the page shows."""
        now_s = time.monotonic()
        recent = [when_s for when_s in list(self._when) if now_s - when_s <= RATE_OVER_S]
        over_s = min(RATE_OVER_S, max(now_s - self._started_s, 1e-3))
        coming, sinks = self._coming, self._sinks
        return {
            "title": self.title,
            "up_s": round(now_s - self._started_s, 1),
            "steps": self._steps,
            "rate_hz": round(len(recent) / over_s, 3),
            "silent_s": round(now_s - (self._latest_s or self._started_s), 3),
            "latency_ms": self._latencies.record(),
            "dropped": 0 if coming is None else coming.dropped,
            "counts": {} if coming is None else dict(coming.counts),
            "tracks": self._tracks,
            "memory_mb": round(psutil.Process().memory_info().rss / 1e6, 1),
            "sinks": {} if sinks is None else {sink.name: dict(sink.counts) for sink in sinks.each},
            "findings": [{"unix_s": round(when_s, 3), "said": said} for when_s, said in list(self._heeded)],
        }
