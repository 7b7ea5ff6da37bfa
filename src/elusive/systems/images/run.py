"""Frames tracked from end to end, recorded or as they come: tables, report, the configuration that repeats it."""

from __future__ import annotations

import gc
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding, grave, write_checks
from elusive.errors import DataError
from elusive.io import FrameSource, Truth, atomic_folder
from elusive.io.live_frames import LiveFrames, TimedFrame
from elusive.results import Scored, scored, write_mot_csv, write_recording, write_result
from elusive.results.live import LiveEnd, LiveStep, finished, follow_live, live_folder
from elusive.systems.images.checks import FrameChecks
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.report import NEAR_PX, FrameKeeper, Tracked, images_report
from elusive.systems.images.results import ImageLog, tracked_of
from elusive.systems.images.track import track_images
from elusive.systems.images.turning import turning_as_seen
from elusive.tracking import Step
from elusive.tracking.memory import Memory

LIVE_FILES = ("tracks.csv", "result.nc", "checks.json", "config.yaml")
FILES = ("tracks.csv", "tracks_mot.csv", "result.nc", "report.html", "report.png", "checks.json", "config.yaml")


WARMING, WARMING_SIDE = 14, 64  # frames, and pixels of their sides, on which compiled code is loaded


class Outcome(NamedTuple):
    """What a tracked recording came to."""

    log: ImageLog
    tracked: Tracked
    scored: Scored | None  # None without a truth
    findings: tuple[Finding, ...] = ()


class _Run:
    """Takes steps in: tables as they come, what a report shows and what is checked at constant memory."""

    def __init__(self, parameters: ImageTracking, log: ImageLog, keeper: FrameKeeper | None = None) -> None:
        self.checks, self.count = FrameChecks(parameters), 0
        self._log, self._keeper = log, keeper

    def append(self, step: Step) -> None:
        """Take in a step; of a frame that is missing there is nothing to see."""
        self._log.append(step)
        if step.measurement is not None and self._keeper is not None:
            self._keeper.offer(self.count, step.measurement)
        self.checks.take(step)
        self.count += 1

    def flush(self) -> None:
        """Hand what has been written to the system."""
        self._log.flush()


def follow(source: FrameSource | LiveFrames, parameters: ImageTracking, memory: Memory | None = None) -> Iterator[Step]:
    """Track through a source's frames at their times; live perhaps from where a run had come to."""
    if isinstance(source, LiveFrames):
        memory = memory or Memory()
        yield from track_images(_new(source, memory), parameters.bind(source.shape, source.interval_s), memory=memory)
    else:
        bound = parameters.bind(source.shape, source.interval_s)
        yield from track_images(source, bound, source.times_s())


def _new(source: LiveFrames, memory: Memory) -> Iterator[TimedFrame]:
    """Yield the frames that are not known; what the memory keeps is of the frame that was yielded last."""
    shift_s = memory.time_s + memory.elapsed_s if memory.held is not None and source.starts_anew else 0.0
    memory.first = 0  # no frame is kept
    for frame in memory.new(frame._replace(time_s=frame.time_s + shift_s) for frame in source):
        memory.place = frame.place
        yield frame


def track_recording(
    source: FrameSource,
    parameters: ImageTracking,
    out: Path,
    *,
    truth: Truth | None = None,
    cutoff_px: float | None = None,
    on_frame: Callable[[int], None] | None = None,
) -> Outcome:
    """Track a recording and write FILES.

    ``config.yaml`` repeats the run. Nothing is left in ``out`` if the recording cannot be used.

    Parameters
    ----------
    source
        From :func:`elusive.io.open_frames`.
    parameters
        What to do; the sensor takes its size from the source, and time its unit.
    out
        Folder for the results.
    truth
        Where targets truly are in the frames of the file; scores only.
    cutoff_px
        Distance up to which a track can stand for a target, and c of GOSPA; None: 4 px.
    on_frame
        Called with the number of frames done.

    Raises
    ------
    DataError
        If a frame cannot be used, or the truth is of other frames.
    """
    bound = turning_as_seen(source, parameters.bind(source.shape, source.interval_s))
    config = bound.to_yaml()
    if truth is not None and source.length is not None:
        truth.check_frames(source.start, source.length, whole=source.whole)
    with atomic_folder(out) as folder:
        with ImageLog(bound, folder / "tracks.csv") as log:
            keeper = FrameKeeper()
            run = _Run(bound, log, keeper)
            for step in follow(source, bound):
                run.append(step)
                if on_frame is not None:
                    on_frame(run.count)
        known = None if truth is None else truth.aligned(log.times_s, source.start, whole=source.whole)
        scores = None if known is None else scored(log.shown, known, NEAR_PX if cutoff_px is None else cutoff_px)
        tracked = tracked_of(source.name, log, source.shape, timed=source.timed, truth=known, scores=scores)
        write_mot_csv(folder / "tracks_mot.csv", log.shown, sigma_px=bound.spread_px, first_frame=source.start)
        findings = run.checks.findings(log.whitened)
        write_recording(folder, log, findings, scores, title=source.name, config=config, timed=source.timed)
        tracked = tracked._replace(believed=not grave(findings))
        images_report(tracked, keeper, findings).write(folder)
    return Outcome(log, tracked, scores, findings)


def track_live(
    source: LiveFrames,
    parameters: ImageTracking,
    out: Path,
    on_step: Callable[[LiveStep], None],
    memory: Memory | None = None,
) -> LiveEnd:
    """Track through frames as they come, until the source ends, fails, or is stopped; at constant memory.

    A frame's rows stand in ``tracks.csv`` before the next is taken; ``result.nc`` and ``checks.json`` are
    written at the end.

    Parameters
    ----------
    source
        From :func:`~elusive.io.live_frames.open_live_frames`.
    parameters
        What to do; the sensor takes its size from the source, and time its unit.
    out
        Folder for LIVE_FILES.
    on_step
        Called after each frame.
    memory
        Where the tracker keeps its state.

    Raises
    ------
    DataError
        If no frame comes, the folder holds an earlier run's tracks, or the first frame cannot be used.
    """
    _load_compiled(parameters)
    # what is loaded stays: looking through all of it for garbage, now and then, would hold up a frame by .1 s
    gc.collect()
    gc.freeze()
    memory = memory or Memory()
    if memory.place is not None:
        source.go_on(memory.place, memory.elapsed_s)
    bound = parameters.bind(source.shape, source.interval_s)  # waits for the first frame
    config = bound.to_yaml()
    with live_folder(out, config) as folder, ImageLog(bound, folder / "tracks.csv", live=True) as log:
        run = _Run(bound, log)
        end = follow_live(follow(source, bound, memory), source, log, on_step, sink=run, extra=log.frame_values)
        findings = run.checks.findings(log.whitened)
        named = partial(write_result, title=source.name, config=config, timed=source.timed)
        return finished(
            end._replace(findings=findings), log, partial(named, folder / "result.nc", log),
            partial(write_checks, folder, findings),
        )  # fmt: skip


def _load_compiled(parameters: ImageTracking) -> None:
    """Track a point through a few made-up frames: compiled code is loaded while nothing has come yet."""
    rng = np.random.default_rng(0)
    frames = 100 + rng.normal(size=(WARMING, WARMING_SIDE, WARMING_SIDE))
    for k, frame in enumerate(frames):
        frame[WARMING_SIDE // 2, 10 + k] += 50.0
    with suppress(DataError):  # as of a window that is larger
        deque(track_images(frames, parameters.bind((WARMING_SIDE, WARMING_SIDE))), maxlen=0)
