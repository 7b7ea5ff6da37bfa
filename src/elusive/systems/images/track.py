"""From a sequence of frames to tracks and the probability, in each frame, that a target is there.

The frames are whitened where the sensor model asks for it, then filtered; existence decides about tracks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import count
from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.io.live_frames import TimedFrame
from elusive.preprocess.copied import is_copy
from elusive.runner import timed
from elusive.sensors import ImageSensor
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.peaks import PeakImages
from elusive.systems.images.recurrent import RecurrentImages, SeveralState
from elusive.systems.images.several import SeveralImages
from elusive.tracking import Life, Lifecycle, Step, Track
from elusive.tracking.memory import Memory

__all__ = ["ImageTracking", "track_images"]

ORDER = {"confirmed": 0, "candidate": 1, "deleted": 2}
UNKNOWN = np.full((4, 4), np.nan)


def track_images(
    frames: Iterable[Array | TimedFrame | None],
    parameters: ImageTracking,
    times_s: Iterable[float] | None = None,
    memory: Memory | None = None,
) -> Iterator[Step]:
    """Track one target, or several, through frames, lazily; a live stream and a file are the same.

    A copy of the last frame is taken as missing: its noise is no new evidence, and what moves does not rest in it.

    Parameters
    ----------
    frames
        ``(rows, columns)`` each, perhaps with its time; ``None`` where one is missing, NaN where a pixel is masked.
    parameters
        What to do, with a sensor of the frames' size (see :meth:`ImageTracking.bind`).
    times_s
        Of the frames that have none of their own; by default as far apart as the parameters say.
    memory
        Where the state is kept, and gone on from.

    Yields
    ------
    Step
        A frame's; a track's existence is a posterior probability, of filter ``peaks`` by how often tracks of this
        recording that were believed as much were there again; filter ``recurrent`` has a score alone.

    Raises
    ------
    DataError
        If a frame has another size than the sensor, or time runs backwards.
    """
    times = (number * parameters.interval_s for number in count()) if times_s is None else times_s
    memory = memory or Memory()
    recursion = parameters.recursion
    fresh = (None, np.random.default_rng(parameters.seed), _One(parameters.lifecycle), None)
    state, rng, one, last = memory.held or fresh
    laid_out = _layout(parameters, one)
    stream: Iterator[Any] = ((getattr(frame, "pixels", frame), time_s) for frame, time_s in timed(frames, times))
    for frame, time_s in stream:
        if state is None:
            # what is known before any frame holds an interval before the first: a target may appear in that
            state = recursion.init(rng, time_s - parameters.interval_s)
        new = None if frame is None or is_copy(frame, last) else parameters.levelled(frame)
        state = recursion.step(state, time_s, new, rng)
        tracks = laid_out(state)
        if new is not None:
            last = np.array(frame)  # whoever yields frames may write the next one over it
        memory.keep(time_s, state, rng, one, last)
        yield Step(time_s, frame, state, tracks)


def _layout(parameters: ImageTracking, one: _One) -> Callable[[Any], tuple[Track, ...]]:
    """How the tracks of a state are laid out."""
    if isinstance(parameters.filter, RecurrentImages):
        return lambda state: _accumulated(state, parameters.interval_s)
    sensor = parameters.sensor if parameters.has_intensity else None
    if isinstance(parameters.filter, PeakImages):
        return lambda state: tuple(sorted(state.tracks, key=_oldest_first))
    if isinstance(parameters.filter, SeveralImages):
        return lambda state: tuple(sorted((_seen(track, sensor) for track in state.tracks), key=_oldest_first))
    return lambda state: tuple(_seen(track, sensor) for track in one.tracks(state))


def _seen(track: Track, sensor: Any) -> Track:
    """Say how bright a track is, where the sensor knows."""
    if sensor is None:
        return track
    intensity = float(track.mean[-1])
    return track._replace(extra={"intensity": intensity, **_snr_db(sensor, intensity)})


def _snr_db(sensor: Any, intensity: float) -> dict[str, float]:
    if not isinstance(sensor, ImageSensor):
        return {}
    return {"snr_db": sensor.snr_db_of(intensity) if intensity > 0 else -math.inf}


class _One:
    """The life of one target, frame by frame."""

    def __init__(self, lifecycle: Lifecycle) -> None:
        self._lifecycle = lifecycle
        self._life, self._born = Life(), 0
        self._latest: tuple[Array, Array] | None = None  # a belief without particles has no moments

    def tracks(self, state: Any) -> tuple[Track, ...]:
        """Return the track after a frame, or none."""
        self._life, self._born = self._lifecycle.step(self._life, state.existence, self._born)
        if np.isfinite(state.mean).all():
            self._latest = state.mean, state.covariance
        if self._life.track is None or self._life.status is None or self._latest is None:
            return ()
        mean, covariance = self._latest
        return (Track(self._life.track, self._life.status, state.existence, mean, covariance),)


def _accumulated(state: SeveralState, interval_s: float) -> tuple[Track, ...]:
    """Lay out the tracks that are known after a frame, the oldest confirmed first; velocities a second."""
    tracks = []
    for track, score in zip(state.tracks, state.scores, strict=True):
        (x, y), (vx, vy) = track.position, track.velocity
        mean = np.array([x, vx / interval_s, y, vy / interval_s])
        tracks.append(Track(track.track, track.status, math.nan, mean, UNKNOWN, score))
    return tuple(sorted(tracks, key=_oldest_first))


def _oldest_first(track: Track) -> tuple[int, int]:
    return ORDER[track.status], track.track
