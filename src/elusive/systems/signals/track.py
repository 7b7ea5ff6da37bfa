"""From a one-dimensional signal to the tracks of objects that differ from its noise only in their statistics.

Evidence of each frame, accumulated along every velocity; peaks above what noise reaches; tracks of the peaks.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.accumulate.false_alarm import NullScores, frame_law
from elusive.io import SignalSource, atomic_folder
from elusive.systems.signals.evidence import SignalEvidence, noise_law
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.results import SignalOutcome, SignalResult, SignalRun
from elusive.tracking import find_peaks, read_back

__all__ = ["SignalTracking", "track_signal", "track_signal_recording"]

REMEMBERED_BYTES = 2**26  # of evidence kept for reading tracks back
MEMORIES = 3  # of 1 / (1 - alpha) frames kept for it


def track_signal(frames: Iterable[Array], parameters: SignalTracking) -> Iterator[SignalResult]:
    """Track objects through the frames of a signal, lazily; a live stream and a file are the same.

    The results of calibration frames come together, once the last of them has been seen.

    Parameters
    ----------
    frames
        ``(n,)`` each.
    parameters
        What to do.

    Yields
    ------
    SignalResult
        One a frame.

    Raises
    ------
    DataError
        If a frame cannot be used: NaN, all equal, another size, shorter than the window; or if the filter would need
        more than half of the machine's memory.
    """
    rng = np.random.default_rng(parameters.seed)
    stream = iter(frames)
    calibration = list(islice(stream, parameters.calibration_frames))
    first = list(islice(stream, 1))
    if not first:
        if parameters.calibration_frames:
            raise DataError(
                f"calibration_frames: the signal has {len(calibration)} frames, all of them taken for calibration; "
                "take fewer."
            )
        return
    stream = chain(first, stream)
    parameters.check(first[0].size)
    evidence = parameters.evidence
    if calibration:
        evidence = evidence.calibrated(calibration)
        for frame in calibration:
            taken = evidence.taken(frame)
            yield SignalResult(taken, np.zeros(taken.shape, np.float32), math.nan, None, (), {})
    evidence.evidence(first[0])  # what cannot be used is refused before noise is simulated at length
    null = None
    if parameters.false_alarm.source == "simulation":
        null = noise_law(parameters.filter, evidence, first[0], calibration, rng)
    yield from _follow(stream, parameters, evidence, null, rng)


def _follow(
    frames: Iterable[Array],
    parameters: SignalTracking,
    evidence: SignalEvidence,
    null: NullScores | None,
    rng: Generator,
) -> Iterator[SignalResult]:
    """Accumulate, find peaks and track them, once it is known what noise does."""
    flt, tracker = parameters.filter, parameters.tracker
    vectors, tracks, state = flt.motion_vectors(1), tracker.init(), flt.init(rng, -1.0)
    before: deque[Any] = deque()
    confirmed: set[int] = set()
    for number, frame in enumerate(frames):
        taken = evidence.taken(frame)
        found = evidence.statistic.evidence(taken)
        if before.maxlen is None:
            before = deque(maxlen=_remembered(flt.smoothing, found.size))
        before.append(found.astype(np.float32))
        state = flt.step(state, float(number), found, rng)
        law = frame_law(state.score) if null is None else null.at(state.frames)
        threshold = law.threshold(parameters.false_alarm.probability)
        peaks = find_peaks(
            state.score, state.velocity, vectors, threshold,
            smoothing=flt.smoothing, frames=state.frames, window=parameters.statistic.window,
            object_size=parameters.object_size, fluctuation=math.sqrt(2 / parameters.object_size), border=flt.border,
        )  # fmt: skip
        tracks = tracker.step(tracks, peaks, found, threshold)
        back = {
            track.track: read_back(list(before), track.position, track.velocity, flt.border)
            for track in tracks.tracks
            if track.status == "confirmed" and track.track not in confirmed
        }
        confirmed.update(back)
        yield SignalResult(taken, state.score, threshold, law, tracks.tracks, back)


def _remembered(smoothing: float, samples: int) -> int:
    """Return how many frames of evidence are kept."""
    return max(2, min(math.ceil(MEMORIES / (1 - smoothing)), REMEMBERED_BYTES // (4 * samples)))


def track_signal_recording(
    source: SignalSource,
    parameters: SignalTracking,
    out: Path,
    *,
    truth: Array | None = None,
    on_frame: Callable[[int], None] | None = None,
) -> SignalOutcome:
    """Track objects through a recording and write ``tracks.csv``, ``result.nc``, ``report.html``, ``report.png``.

    ``config.yaml`` beside them repeats the run. Nothing is left in ``out`` if the recording cannot be used.

    Parameters
    ----------
    source
        From :func:`elusive.io.open_signal`.
    parameters
        What to do.
    out
        Folder for the results.
    truth
        ``(T, objects)`` places in samples for each frame of the file, NaN where an object is absent; scores only.
    on_frame
        Called with the number of frames done.

    Raises
    ------
    DataError
        If a frame cannot be used, the recording needs more memory than half of the machine's, or the truth has fewer
        rows than there are frames.
    """
    try:
        parameters.check(source.samples)
    except DataError as error:
        raise DataError(_placed(str(error), source.name, 0)) from None
    run = SignalRun(source, parameters.filter.border == "circular", parameters.object_size)

    def timed() -> Iterator[Array]:
        for frame in source:
            run.times.append(frame.time_s)
            yield frame.samples

    with atomic_folder(out) as folder:
        try:
            for number, result in enumerate(track_signal(timed(), parameters), 1):
                run.offer(result)
                if on_frame is not None:
                    on_frame(number)
        except DataError as error:
            raise DataError(_placed(str(error), source.name, source.start + len(run.times) - 1)) from None
        outcome = run.outcome(parameters.described, truth)
        run.write(folder, outcome, parameters.to_yaml())
    return outcome


def _placed(fault: str, name: str, frame: int) -> str:
    """Say in which file and frame a fault is, where its sentence does not."""
    if fault.startswith(name):
        return fault
    return (
        f"{name}, frame {frame}: {fault.removeprefix('frame: ')}" if fault.startswith("frame: ") else f"{name}: {fault}"
    )
