"""A signal tracked while it is written: each frame's rows stand in the file before the next is taken."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import Any

from elusive.checks import write_checks
from elusive.errors import DataError
from elusive.io.arrivals import Coming
from elusive.io.signals import SignalFrame, SignalSource
from elusive.results import TrackLog
from elusive.results.live import LiveEnd, LiveStep, finished, follow_live, live_folder
from elusive.systems.signals.checks import findings_of
from elusive.systems.signals.facts import SignalFacts
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.results import log_of, values_of
from elusive.systems.signals.run import CLOCKED, bound_to, follow, interval_of, untold
from elusive.tracking import Step
from elusive.tracking.memory import Memory

LIVE_FILES = ("tracks.csv", "checks.json", "config.yaml")


class _Checked:
    """Takes steps in, and what is checked of them."""

    def __init__(self, log: TrackLog) -> None:
        self.log, self.facts = log, SignalFacts()

    def append(self, step: Step) -> None:
        self.facts.add(step)
        self.log.append(step, **values_of(step.state))

    def flush(self) -> None:
        self.log.flush()


def follow_signal_live(
    coming: Coming[SignalFrame],
    source: SignalSource,
    parameters: SignalTracking,
    out: Path,
    on_step: Callable[[LiveStep], None],
    memory: Memory | None = None,
    *,
    starts_anew: bool = False,
) -> LiveEnd:
    """Track objects while their signal is written; where times alone tell the interval, the first 16 are waited for.

    Parameters
    ----------
    coming
        :class:`~elusive.io.arrivals.Arrivals` of the source's frames.
    source
        From :func:`~elusive.io.live_signals.follow_signal`.
    parameters
        What to do.
    out
        Folder for LIVE_FILES.
    on_step
        Called after each frame.
    memory
        Where the tracker keeps its state, and goes on from.
    starts_anew
        Whether nothing that was told before comes again, as of a pipe; where frames are counted, they are counted on.

    Returns
    -------
    LiveEnd
        How it ended, and what was checked, in ``checks.json`` too.

    Raises
    ------
    DataError
        If the folder holds an earlier run's tracks, a frame of the first cannot be used, or frames come at another rate
        than in the run that is gone on from.
    """
    frames, memory = iter(coming), memory or Memory()
    first = list(islice(frames, CLOCKED)) if untold(source) and memory.held is None else []
    if memory.held is None:
        memory.first = interval_of(source, first)  # a restart shall not find another
    interval_s: float = memory.first
    if not untold(source) and (now_s := interval_of(source, ())) != interval_s:
        raise DataError(f"{source.name}: has a frame in {now_s:g} s now, and had one in {interval_s:g} s; begin anew.")
    bound = bound_to(source, parameters, interval_s)
    shift_s = 0.0
    if memory.held is not None and starts_anew and not untold(source):
        passed = 1 if source.rate_hz is None else max(1, round(memory.elapsed_s / interval_s))
        shift_s = memory.time_s + passed * interval_s

    def fresh() -> Iterator[SignalFrame]:
        for frame in memory.new(frame._replace(time_s=frame.time_s + shift_s) for frame in chain(first, frames)):
            memory.place = frame.place
            yield frame

    def told(step: Step) -> dict[str, Any]:
        return {name: round(value, 4) if value == value else None for name, value in values_of(step.state).items()}

    with live_folder(out, bound.to_yaml()) as folder, log_of(folder / "tracks.csv") as log:
        checked = _Checked(log)
        steps = follow(source, bound, fresh(), memory)
        end = follow_live(steps, coming, log, on_step, sink=checked, extra=told)
        findings = findings_of(bound, checked.facts) if checked.facts.frames else ()
        return finished(end._replace(findings=findings), log, partial(write_checks, folder, findings))
