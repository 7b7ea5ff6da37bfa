"""A live run, of any system: each step's rows stand in the files, and its line is told, before the next is taken.

Rows that a full disk refuses are held, and the run goes on; what is refused at the end is told, the rest is written.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from elusive.checks import Finding
from elusive.errors import DataError
from elusive.io.arrivals import Coming
from elusive.io.atomic import existing_folder, refused
from elusive.results.latency import Latencies
from elusive.results.log import TrackLog
from elusive.tracking.track import Step

USUAL = 20  # latest intervals that say what is usual
LONGER = 3.0  # times the longest of them, for nothing to be a gap
NO_NUMBERS: Mapping[str, Any] = {}


class Sink(Protocol):
    """What a system takes its steps in with: a :class:`~elusive.results.TrackLog`, or what is round that."""

    def append(self, step: Step) -> None:
        """Take in a step."""
        ...

    def flush(self) -> None:
        """Hand what has been written to the system, for others to read."""
        ...


class LiveStep(NamedTuple):
    """A step that has been tracked and written."""

    step: Step
    latency_s: float  # from the measurement's coming to its rows in the files
    record: dict[str, Any]  # as told: what is not known is None
    remarks: tuple[str, ...] = ()  # what is to be heeded from this step on


class LiveEnd(NamedTuple):
    """What a live run came to."""

    steps: int
    dropped: int
    latencies: Latencies
    counts: Mapping[str, int]  # what the source met, and ``gaps``: times without measurements, far longer than usual
    fault: str | None  # why it ended, where that was no plain end
    findings: tuple[Finding, ...] = ()  # what was checked
    remarks: tuple[str, ...] = ()  # what is to be heeded of the last steps and of the files
    unwritten: tuple[str, ...] = ()  # of the results, what the system refused to write

    def record(self, **more: Any) -> dict[str, Any]:
        """Return the last line."""
        told = {"steps": self.steps, "dropped": self.dropped, "latency_ms": self.latencies.record()}
        lacks = {"unwritten": list(self.unwritten)} if self.unwritten else {}
        return {"summary": told | dict(self.counts) | more | lacks | {"fault": self.fault}}


@contextmanager
def live_folder(out: Path, config: str, names: Iterable[str] = ("tracks.csv",)) -> Iterator[Path]:
    """Give the folder of a live run, with its configuration.

    Raises
    ------
    DataError
        If it holds an earlier run's tables, or cannot be written to.
    """
    for name in names:
        if (out / name).exists():
            raise DataError(f"{out / name}: is there already, of an earlier run; name another folder.")
    existed, folder = out.exists(), existing_folder(out)
    path = folder / "config.yaml"
    try:
        with refused(path):
            path.write_text(config, encoding="utf-8")
    except DataError:
        with suppress(OSError):
            path.unlink(missing_ok=True)
            if not existed:
                folder.rmdir()
        raise
    yield folder


def follow_live(
    steps: Iterator[Step],
    coming: Coming[Any],
    log: TrackLog,
    on_step: Callable[[LiveStep], None],
    *,
    sink: Sink | None = None,
    extra: Callable[[Step], Mapping[str, Any]] = lambda step: NO_NUMBERS,
) -> LiveEnd:
    """Take steps in as they come, until the source ends, fails, or is stopped.

    Parameters
    ----------
    steps
        Of a tracker that takes its measurements from ``coming``.
    coming
        The source.
    log
        Of the tracks.
    on_step
        Called after each.
    sink
        What takes the steps in, where that is more than the log.
    extra
        What a system adds to a step's record.

    Raises
    ------
    DataError
        If the source fails before the first step. What fails later ends the run, and is told in what is returned.
    """
    count, latencies, fault, gaps = 0, Latencies(), None, Gaps()
    into: Sink = log if sink is None else sink
    names = log.columns.names[1:]
    while True:
        try:
            step = next(steps, None)
            if step is None:
                break
            into.append(step)
            into.flush()
        except DataError as error:
            if not count:
                raise
            fault = str(error)
            break
        count += 1
        latency_s = time.monotonic() - coming.came_s
        latencies.add(latency_s)
        tracks = [dict(zip(names, cells[1:], strict=True)) for cells in log.latest]
        told = {"time_s": step.time_s, "unix_s": round(time.time() - latency_s, 6)}
        told |= {"latency_ms": round(1e3 * latency_s, 3), "dropped": coming.dropped, **extra(step)}
        gap_s = gaps.before(step.time_s)
        if gap_s:
            told["gap_s"] = round(gap_s, 6)
        on_step(LiveStep(step, latency_s, told | {"tracks": tracks}, log.said()))
    return LiveEnd(count, coming.dropped, latencies, {**coming.counts, "gaps": gaps.count}, fault)


def finished(end: LiveEnd, log: TrackLog, *writes: Callable[[], None]) -> LiveEnd:
    """Do what is left of a run, each though another is refused; nothing that was tracked goes with what is not written.

    Parameters
    ----------
    end
        How it ended.
    log
        Of the tracks; it is closed, and what it has to say is told.
    writes
        What writes the results.
    """
    unwritten = []
    for write in (log.close, *writes):
        try:
            write()
        except DataError as error:
            unwritten.append(str(error))
    return end._replace(remarks=log.said(), unwritten=tuple(unwritten))


class Gaps:
    """Finds times without measurements that are longer than what has been usual."""

    def __init__(self) -> None:
        self.count = 0
        self._usual = deque[float](maxlen=USUAL)
        self._latest_s = math.nan

    def before(self, time_s: float) -> float:
        """Return how long nothing came before a measurement [s]; 0 where that is usual."""
        gap_s, self._latest_s = time_s - self._latest_s, time_s
        if len(self._usual) >= USUAL // 2 and gap_s > LONGER * max(self._usual):
            self.count += 1
            return gap_s
        if gap_s > 0:
            self._usual.append(gap_s)
        return 0.0
