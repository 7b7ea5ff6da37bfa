"""From a one-dimensional signal to the tracks of objects that differ from its noise only in their statistics.

Evidence of each frame, accumulated along every velocity; peaks above what noise reaches; tracks of the peaks.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, count, islice
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.accumulate.false_alarm import ExtremeValue, NullScores, frame_law
from elusive.filters.accumulate.null_scores import deviation_of
from elusive.filters.accumulate.recurrent import RecurrentState
from elusive.io import SignalFrame
from elusive.preprocess.standardise import LEAST_FRAMES
from elusive.preprocess.whiten import NoiseModel
from elusive.runner import timed
from elusive.systems.signals.law import noise_law
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.whitened import Whitened, missing_samples
from elusive.tracking import Follower, Footprint, PeakTrack, ReadBack, Step, Track, read_back
from elusive.tracking.follow import FollowedState
from elusive.tracking.memory import Memory
from elusive.tracking.rest import moves

__all__ = ["SignalState", "SignalTracking", "track_signal"]

FRAME_DIGITS = 6  # of a time counted in frames
REFUSED = "they are constant, half one value, or hold samples that are NaN, infinite or silent"
BESIDE = 2  # reaches of an object's evidence, beyond which another thing stands out
MOVES = 0.5  # probability from which a track moves: in a frame, to be no level; in the mean, to be shown
UNKNOWN = np.full((2, 2), np.nan)
NOTHING: Mapping[int, ReadBack] = {}


class SignalState(NamedTuple):
    """What is known after a frame."""

    taken: Array  # (n,) the samples as the filter takes them, white; complex for complex frames; zero in a gap
    score: NDArray[np.floating[Any]]  # (n,) accumulated evidence, in deviations of noise's; 0 in calibration frames
    threshold: float = math.nan  # NaN in calibration frames
    law: ExtremeValue | None = None  # of the highest score of noise; None in calibration frames and in gaps
    read_back: Mapping[int, ReadBack] = NOTHING  # of tracks confirmed in this frame: where they were before
    noise: NoiseModel | None = None  # what is known of it, where it is estimated as frames come
    alone: float = math.nan  # probability that noise's evidence is as high in this frame alone, beside all tracks
    spread: float = 1.0  # of what accumulates along the worst velocity without an object, to that of white noise
    lowest: float = 0.0  # evidence accumulated along any way that moves, where there is no track
    gap: bool = False  # a frame that is constant, or in which too many samples are missing


class _Known(NamedTuple):
    """What the next frame is taken with."""

    noise: Whitened
    quiet: Sequence[Array]  # calibration frames, until it is known what noise does
    followed: FollowedState
    moved: Mapping[int, float]  # by track that is confirmed, or was: its probabilities to move less MOVES, in all
    start_s: float = math.nan  # of the first frame that is not for calibration
    law: ExtremeValue = ExtremeValue(0.0, 1.0)
    null: NullScores | None = None  # what noise does, where it was simulated
    explained: NDArray[np.bool_] | None = None  # samples of the next frame in which objects on their way will be


def track_signal(
    frames: Iterable[Array | SignalFrame],
    parameters: SignalTracking,
    times_s: Iterable[float] | None = None,
    memory: Memory | None = None,
) -> Iterator[Step]:
    """Track objects through the frames of a signal, lazily; a live stream and a file are the same.

    The results of calibration frames come together, once the last of them has been seen.

    Parameters
    ----------
    frames
        ``(n,)`` each, or with its time.
    parameters
        What to do, with the time between frames (see :meth:`SignalTracking.bind`).
    times_s
        Of frames without; by default as far apart as the parameters say.
    memory
        Where the state is kept, and gone on from.

    Yields
    ------
    Step
        A frame's, with a :class:`SignalState`. The score of a track is one minus the probability that noise alone
        holds as high a peak in a frame: no posterior probability of existence. ``extra`` has the evidence of its
        newest peak, in deviations of noise's, the probability that it moves, and whether it is shown: the mean of
        that probability since it was confirmed is above one half.

    Raises
    ------
    DataError
        If no frame can be used, or one has another size or is shorter than the window; if the filter would need more
        than half of the machine's memory; or if time runs backwards.
    """
    memory = memory or Memory()
    known, rng = memory.held or (None, np.random.default_rng(parameters.seed))
    times = (number * parameters.interval_s for number in count()) if times_s is None else times_s
    stream: Iterator[Any] = ((getattr(frame, "samples", frame), time_s) for frame, time_s in timed(frames, times))
    calibration = [] if known is not None else list(islice(stream, parameters.calibration_frames))
    first = list(islice(stream, 1))
    if not first:
        if known is None and parameters.calibration_frames:
            raise DataError(
                f"calibration_frames: the signal has {len(calibration)} frames, all of them taken for calibration; "
                "take fewer."
            )
        return
    stream = chain(first, stream)
    ((frame, _),) = first
    parameters.bind(frame.size, parameters.interval_s)
    follower = Follower(
        parameters.recursion,
        parameters.tracks,
        Footprint.of_object(parameters.statistic.window, parameters.object_size),
        clutter=parameters.noise == "estimated",
    )
    if known is None:
        known = _Known(parameters.whitened, (), follower.init(rng, -1.0), {})
    quiet = [frame for frame, _ in calibration if missing_samples(frame).mean() == 0]
    if calibration:
        if any(np.iscomplexobj(one) for one in quiet):
            raise DataError(
                "calibration_frames: is of real samples, and these are complex (I and Q); leave it out, and the noise "
                "is learnt from the frames as they come, or give their magnitude."
            )
        if len(quiet) < LEAST_FRAMES:
            raise DataError(
                f"calibration_frames: {len(calibration) - len(quiet)} of its {len(calibration)} frames cannot be used, "
                f"and {LEAST_FRAMES} are needed: {REFUSED}; choose other frames, or leave it out."
            )
        noise = known.noise.calibrated(quiet)
        memory.keep(calibration[-1][1], known := known._replace(noise=noise, quiet=quiet), rng)
        for one, time_s in calibration:
            _, taken = noise.step(one, rng)
            zero = np.zeros(one.shape)
            yield Step(time_s, one, SignalState(zero if taken is None else taken, zero, gap=taken is None), ())
    yield from _follow(stream, parameters, follower, known, rng, memory)


def _follow(
    frames: Iterable[tuple[Array, float]],
    parameters: SignalTracking,
    follower: Follower,
    known: _Known,
    rng: Generator,
    memory: Memory,
) -> Iterator[Step]:
    """Accumulate, find peaks and track them, once it is known what noise does; inside, time counts frames."""
    flt, interval_s = parameters.recursion, parameters.interval_s
    noise, quiet, state, moved, start_s, law, null, explained = known
    read, fastest = 0, float(np.abs(flt.motion_vectors(1)).max())

    def threshold(recurrent: RecurrentState, seen: int) -> float:
        nonlocal law
        law = frame_law(recurrent.score) if null is None else null.at(seen)
        return law.threshold(parameters.false_alarm.probability)

    for frame, time_s in frames:
        read += 1
        start_s = time_s if math.isnan(start_s) else start_s
        now = round((time_s - start_s) / interval_s, FRAME_DIGITS)
        noise, taken = noise.step(frame, rng, explained)
        found = None if taken is None else noise.evidence.of_taken(taken)
        if state.seen == 0 and taken is not None and parameters.false_alarm.source == "simulation":
            # not before it is known that the frames can be used
            null, quiet = noise_law(flt, noise, taken, quiet, rng), ()
        state = follower.step(state, now, found, threshold, rng)
        back = {
            track.track: read_back(
                track.trail.values(now, track.path), track.trail.places(now, track.path, frame.shape, flt.border)
            )
            for track in state.tracks
            if track.status == "confirmed" and track.track not in moved
        }
        scale = follower.scale(state, now)
        moving = [moves(track, scale, fastest) for track in state.tracks]
        moved = _moved(moved, state.tracks, moving)
        explained = _explained(frame.size, state.tracks, moving)
        memory.keep(time_s, _Known(noise, quiet, state, moved, start_s, law, null, explained), rng)
        shown = tuple(
            _track(track, law, interval_s, each, moved.get(track.track, each - MOVES) > 0)
            for track, each in zip(state.tracks, moving, strict=True)
        )
        if taken is None:
            score = state.score if state.seen else np.zeros(frame.shape, np.float32)
            missed = SignalState(np.zeros(frame.shape), score, read_back=back, noise=noise.model, gap=True)
            yield Step(time_s, frame, missed, shown)
        else:
            alone = math.nan if found is None else _alone(found, state.tracks, null)
            recurrent = state.search.recurrent
            spread = 1.0 if recurrent.belief is None else float(recurrent.belief.spreads.max())
            lowest = 0.0 if state.tracks else _lowest(recurrent, flt.smoothing, parameters.statistic.window)
            seen = SignalState(taken, state.score, state.threshold, law, back, noise.model, alone, spread, lowest)
            yield Step(time_s, frame, seen, shown)
    if state.seen == 0:
        raise DataError(
            f"none of its {read} frames can be used: {REFUSED}; choose others with start and stop, or replace the "
            "samples."
        )


def _alone(evidence: Array, tracks: Sequence[PeakTrack], null: NullScores | None) -> float:
    """Probability that noise's evidence of one frame is as high as this is beside confirmed tracks."""
    deviation = deviation_of(evidence)
    if null is None or len(null.ages) == 1 or deviation == 0:
        return math.nan
    beside = evidence.copy()
    for track in tracks:
        if track.status == "confirmed":
            reach = BESIDE * track.footprint.reach
            near = np.arange(-reach, reach + 1)
            beside[(round(float(track.position[0])) + near) % len(beside)] = 0.0
    return null.at(1).probability(float(beside.max()) / deviation)


def _lowest(recurrent: RecurrentState, smoothing: float, window: int) -> float:
    """Return the lowest evidence along any way that leaves a window's place, in deviations of noise's."""
    belief = recurrent.belief
    if belief is None or recurrent.deviation == 0:
        return 0.0
    moves_on = np.abs(belief.vectors[:, 0]) > (1 - smoothing) * window
    lowest = belief.planes[: len(belief.vectors)].min(axis=(1, 2)) / belief.spreads
    return float(lowest.min(where=moves_on, initial=0.0)) / recurrent.deviation


def _explained(samples: int, tracks: Sequence[PeakTrack], moving: Sequence[float]) -> NDArray[np.bool_] | None:
    """Return the samples of the next frame that objects will cover which move; None where there are none."""
    explained = np.zeros(samples, np.bool_)
    for track, moves_too in zip(tracks, moving, strict=True):
        if track.status == "confirmed" and moves_too > MOVES:
            half = math.ceil(track.footprint.half)
            explained[(round(track.position[0] + track.velocity[0]) + np.arange(-half, half + 1)) % samples] = True
    return explained if explained.any() else None


def _moved(moved: Mapping[int, float], tracks: Sequence[PeakTrack], moving: Sequence[float]) -> dict[int, float]:
    """Add a frame to what is known of confirmed tracks: above zero where one moves in the mean."""
    return {
        track.track: moved.get(track.track, 0.0) + (moves_too - MOVES if track.status == "confirmed" else 0.0)
        for track, moves_too in zip(tracks, moving, strict=True)
        if track.status == "confirmed" or track.track in moved
    }


def _track(track: PeakTrack, law: ExtremeValue, interval_s: float, moving: float, shown: bool) -> Track:
    (x,), (vx,) = track.position, track.velocity
    score, mean = 1 - law.probability(track.score), np.array([x, vx / interval_s])
    extra = {"evidence": track.score, "moves": moving, "shown": float(shown)}
    return Track(track.track, track.status, math.nan, mean, UNKNOWN, score, extra)
