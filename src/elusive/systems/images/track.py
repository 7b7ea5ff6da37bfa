"""From a sequence of frames to tracks and the probability, in each frame, that a target is there.

The frames are whitened where the sensor model asks for it, then filtered; existence decides about tracks.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import count
from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.runner import timed
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.recurrent import SeveralState
from elusive.tracking import Life, Lifecycle, Step, Track

__all__ = ["ImageTracking", "track_images"]

ORDER = ("confirmed", "candidate", "deleted")
UNKNOWN = np.full((4, 4), np.nan)


def track_images(
    frames: Iterable[Array | None], parameters: ImageTracking, times_s: Iterable[float] | None = None
) -> Iterator[Step]:
    """Track one target, or several, through frames, lazily; a live stream and a file are the same.

    Parameters
    ----------
    frames
        ``(rows, columns)`` each; ``None`` where one is missing, NaN where a pixel is masked.
    parameters
        What to do, with a sensor of the frames' size (see :meth:`ImageTracking.bind`).
    times_s
        Of the frames; by default as far apart as the parameters say.

    Yields
    ------
    Step
        A frame's; of one target the track's existence is a posterior probability, of several there is a score alone.

    Raises
    ------
    DataError
        If a frame has another size than the sensor, or time runs backwards.
    """
    times = (number * parameters.interval_s for number in count()) if times_s is None else times_s
    rng = np.random.default_rng(parameters.seed)
    recursion = parameters.recursion
    state: Any = None
    one = _One(parameters.lifecycle, parameters.has_intensity)
    for frame, time_s in timed(frames, times):
        if state is None:
            # what is known before any frame holds an interval before the first: a target may appear in that
            state = recursion.init(rng, time_s - parameters.interval_s)
        state = recursion.step(state, time_s, frame, rng)
        several = isinstance(state, SeveralState)
        yield Step(time_s, frame, state, _several(state, parameters.interval_s) if several else one.tracks(state))


class _One:
    """The life of one target, frame by frame."""

    def __init__(self, lifecycle: Lifecycle, has_intensity: bool) -> None:
        self._lifecycle, self._has_intensity = lifecycle, has_intensity
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
        extra = {"intensity": float(mean[-1])} if self._has_intensity else {}
        return (Track(self._life.track, self._life.status, state.existence, mean, covariance, extra=extra),)


def _several(state: SeveralState, interval_s: float) -> tuple[Track, ...]:
    """Lay out the tracks that are known after a frame, the oldest confirmed first; velocities a second."""
    tracks = []
    for track, score in zip(state.tracks, state.scores, strict=True):
        (x, y), (vx, vy) = track.position, track.velocity
        mean = np.array([x, vx / interval_s, y, vy / interval_s])
        tracks.append(Track(track.track, track.status, math.nan, mean, UNKNOWN, score))
    return tuple(sorted(tracks, key=lambda track: (ORDER.index(track.status), track.track)))
