"""A recorded signal tracked from end to end: its tables, its report, the configuration that repeats it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.errors import DataError
from elusive.io import SignalFrame, SignalSource, Truth, atomic_folder
from elusive.results import Scored, write_recording
from elusive.systems.signals.checks import findings_of
from elusive.systems.signals.facts import SignalFacts
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.report import SignalTracked, signal_report
from elusive.systems.signals.results import SignalLog, tracked_of
from elusive.systems.signals.track import track_signal
from elusive.tracking import Step
from elusive.tracking.memory import Memory

FILES = ("tracks.csv", "result.nc", "report.html", "report.png", "checks.json", "config.yaml")
CLOCKED = 16  # frames whose times tell how far apart frames are, where the file has times


class SignalOutcome(NamedTuple):
    """What a tracked signal came to."""

    log: SignalLog
    tracked: SignalTracked
    scored: Scored | None  # None without a truth
    findings: tuple[Finding, ...] = ()


def bound_to(source: SignalSource, parameters: SignalTracking, interval_s: float | None = None) -> SignalTracking:
    """Return the parameters for a source's frames and the time between them, where that is not given.

    Raises
    ------
    DataError
        If the frames are too short, or need more memory than half of the machine's.
    """
    try:
        bound = parameters.bind(source.samples, interval_of(source, source) if interval_s is None else interval_s)
        _refuse_noise_that_moves(source, bound)
    except DataError as error:
        raise DataError(_placed(str(error), source.name, 0)) from None
    return bound


def untold(source: SignalSource) -> bool:
    """Say whether the frames' own times alone tell how far apart they are."""
    return source.rate_hz is None and source.timed


def interval_of(source: SignalSource, first: Iterable[SignalFrame]) -> float:
    """Return the time between frames [s], frames without a clock being a second apart; ``first`` are some."""
    if untold(source):
        return float(np.median(np.diff([frame.time_s for frame in islice(first, CLOCKED)])))
    return 1.0 if source.rate_hz is None else 1 / source.rate_hz


def _refuse_noise_that_moves(source: SignalSource, bound: SignalTracking) -> None:
    """Refuse frames that overlap so far that the noise which they share moves as slowly as an object."""
    if source.hop is None or source.hop >= source.samples:
        return
    velocities, window = bound.recursion.motion_vectors(1)[:, 0], bound.statistic.window
    nearest = float(np.abs(velocities + source.hop).min())
    if nearest <= window:
        raise DataError(
            f"hop_samples={source.hop}: frames share the samples of those before, {source.hop} samples further back, "
            f"and an object may move {-velocities.min():g} samples a frame: the same noise would be counted again and "
            f"again; take hops of more than {math.ceil(window - velocities.min())} samples, or a lower max_velocity."
        )


def follow(
    source: SignalSource,
    parameters: SignalTracking,
    frames: Iterable[SignalFrame] | None = None,
    memory: Memory | None = None,
) -> Iterator[Step]:
    """Track through a source's frames at their times, with parameters bound to it; ``frames`` as they come, live.

    The state is kept in ``memory``, and gone on from.

    Raises
    ------
    DataError
        If a frame cannot be used; the sentence says which.
    """
    read = 0

    def counted() -> Iterator[SignalFrame]:
        nonlocal read
        for frame in source if frames is None else frames:
            read += 1
            yield frame

    try:
        yield from track_signal(counted(), parameters, memory=memory)
    except DataError as error:
        raise DataError(_placed(str(error), source.name, source.start + read - 1)) from None


def track_signal_recording(
    source: SignalSource,
    parameters: SignalTracking,
    out: Path,
    *,
    truth: Truth | None = None,
    cutoff_samples: float | None = None,
    on_frame: Callable[[int], None] | None = None,
) -> SignalOutcome:
    """Track objects through a recording and write FILES.

    ``config.yaml`` repeats the run. Nothing is left in ``out`` if the recording cannot be used.

    Parameters
    ----------
    source
        From :func:`elusive.io.open_signal`.
    parameters
        What to do.
    out
        Folder for the results.
    truth
        Where objects truly are in the frames of the file; scores only.
    cutoff_samples
        Distance up to which a track can stand for an object, and c of GOSPA; None: an object's size.
    on_frame
        Called with the number of frames done.

    Raises
    ------
    DataError
        If a frame cannot be used, the recording needs more memory than half of the machine's, or the truth is
        of other frames.
    """
    bound = bound_to(source, parameters)
    config = bound.to_yaml()
    if truth is not None and source.length is not None:
        truth.check_frames(source.start, source.length, whole=source.whole)
    with atomic_folder(out) as folder:
        facts = SignalFacts()
        with SignalLog(source, bound, folder / "tracks.csv") as log:
            for number, step in enumerate(follow(source, bound), 1):
                log.take(step)
                facts.add(step)
                if on_frame is not None:
                    on_frame(number)
        tracked, scores = tracked_of(log, truth, cutoff_samples)
        findings = findings_of(bound, facts)
        write_recording(
            folder, log, findings, scores, title=source.name, config=config, more=log.evidence_map(), timed=source.timed
        )
        signal_report(tracked, log.signal, log.score, findings).write(folder)
    return SignalOutcome(log, tracked, scores, findings)


def _placed(fault: str, name: str, frame: int) -> str:
    """Say in which file and frame a fault is, where its sentence does not."""
    if fault.startswith(name):
        return fault
    return (
        f"{name}, frame {frame}: {fault.removeprefix('frame: ')}" if fault.startswith("frame: ") else f"{name}: {fault}"
    )
