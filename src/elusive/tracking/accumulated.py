"""Tracks of the peaks of accumulated evidence: candidate, confirmed, deleted.

Global nearest neighbour assignment (Blackman and Popoli, 1999, section 6.4). What a filter has accumulated fades
slowly, and a peak outlives its target; a track is therefore judged by the fresh evidence at its predicted place,
which is independent of what made the peak: confirmed by Wald's (1945) sequential test, ended by Page's (1954).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import FROM_RECORDING, Model
from elusive.tracking.fresh import Fresh, ring, sample
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.peaks import Border, Peak, wrapped
from elusive.tracking.track import Status

REMEMBERED = 64  # updates in which a track's peaks are counted: more than a track without any can live
FADED = 1.0  # score of a remnant, in noise deviations, that no longer hides anything


class PeakTrack(NamedTuple):
    """One track after a frame."""

    life: Life
    position: tuple[float, ...]  # x[, y] in samples
    velocity: tuple[float, ...]  # vx[, vy] in samples a frame
    score: float  # of its newest peak
    first_frame: int  # of its first peak, counted from 1
    fresh: Fresh  # what its place has shown since the first peak

    @property
    def track(self) -> int:
        """Number, from 1."""
        return self.life.track or 0

    @property
    def status(self) -> Status:
        """Candidate, confirmed or deleted."""
        return self.life.status or "candidate"


class Remnant(NamedTuple):
    """What a track whose target has gone has left in the accumulated evidence."""

    position: tuple[float, ...]
    velocity: tuple[float, ...]
    score: float  # what the peak has faded to


class PeakTrackerState(NamedTuple):
    """Tracks after a frame; a deleted track is shown once as such."""

    frames: int  # frames so far, missing ones too
    seen: int  # frames with evidence
    shape: tuple[int, ...]  # of the evidence; empty before the first
    tracks: tuple[PeakTrack, ...]
    remnants: tuple[Remnant, ...]
    born: int  # tracks begun so far


class PeakTracker(Model):
    """Links peaks to tracks, and says when a track is believed and when it has ended.

    A track's predicted place is its last plus its velocity. Peaks within the gate are assigned to tracks so that the
    sum of distances is least, and a track follows its peak by a share of the way, its velocity by a smaller one. It
    is confirmed once it has had ``confirm_frames`` peaks and fresh evidence speaks for it; it is deleted once fresh
    evidence is noise again, once it has had no peak in ``miss_frames`` frames, or when it leaves a bounded map. The
    peak that remains where fresh evidence ended a track fades by alpha a frame and begins no track of its own, unless
    it is above what fading explains by more than the threshold: then a target has come back.
    """

    gate: float = Field(5.0, gt=0, description="Farthest a peak may be from a track's predicted place [samples]")
    confirm_frames: int = Field(3, ge=1, description="Frames with a peak that a confirmed track has had")
    confirm_risk: float = Field(
        0.01, gt=0, le=1, description="Probability that a track of a false alarm is ever confirmed; 1: by frames alone"
    )
    miss_frames: int = Field(5, ge=1, description="Frames in a row without a peak after which a track is deleted")
    deletion_frames: float = Field(
        2000.0, ge=1, description="Mean frames, at least, between wrong deletions of a target that is there"
    )
    position_gain: float = Field(0.5, gt=0, le=1, description="Share of a peak's offset that the position follows")
    velocity_gain: float = Field(0.1, ge=0, le=1, description="Share of it that the velocity follows, a frame")
    smoothing: float = Field(
        0.98, ge=0, lt=1, description="Weight of the past in the filter, alpha", json_schema_extra=FROM_RECORDING
    )
    border: Border = Field("circular", description="As in the filter", json_schema_extra=FROM_RECORDING)

    def init(self) -> PeakTrackerState:
        """Return the state before the first frame: no track."""
        return PeakTrackerState(0, 0, (), (), (), 0)

    def step(
        self,
        state: PeakTrackerState,
        peaks: Sequence[Peak],
        evidence: ArrayLike | None,
        threshold: float,
        elapsed: float = 1.0,
    ) -> PeakTrackerState:
        """Return the tracks after one more frame.

        Parameters
        ----------
        state
            The tracks so far.
        peaks
            Peaks of the frame's score map, the strongest first.
        evidence
            The frame's evidence, as given to the filter; None for a missing frame.
        threshold
            That the peaks are above.
        elapsed
            Since the frame before, in usual intervals between frames.

        Raises
        ------
        DataError
            If the evidence is not finite, or of another number of axes than the peaks.
        """
        values = None if evidence is None else _evidence(evidence, peaks)
        seen = state.seen + (values is not None)
        shape = state.shape if values is None else values.shape
        period = ring(shape) if shape and self.border == "circular" else None
        alive = [self._predicted(track, values, period, elapsed) for track in state.tracks if track.life.lives]
        links, free = self._assign(alive, peaks, period)
        tracks = []
        for track, link in zip(alive, links, strict=True):
            followed = track if link is None else self._followed(track, peaks[link], period)
            tracks.append(self._judged(followed, shape, None if values is None and link is None else link is not None))
        fade = 1.0 if values is None else self.smoothing
        remnants = [self._faded(remnant, fade, period, elapsed) for remnant in state.remnants]
        born = state.born
        for i in free:
            if not self._left_over(peaks[i], remnants, threshold, period):
                track = self._started(born, state.frames + 1, peaks[i], seen)
                born = track.track
                tracks.append(track)
        ended = [
            Remnant(track.position, track.velocity, track.score)
            for track in tracks
            if track.status == "deleted" and track.life.missed < self.miss_frames
        ]
        kept = [remnant for remnant in remnants if remnant.score > FADED]
        return PeakTrackerState(state.frames + 1, seen, shape, tuple(tracks), (*kept, *ended), born)

    def _predicted(self, track: PeakTrack, values: Array | None, period: Array | None, elapsed: float) -> PeakTrack:
        """Move a track by its velocity and take in what its place shows."""
        position = _moved(track.position, np.multiply(elapsed, track.velocity), period)
        if values is None:
            return track._replace(position=position)
        return track._replace(position=position, fresh=track.fresh.after(sample(values, position), self.smoothing))

    def _assign(
        self, tracks: list[PeakTrack], peaks: Sequence[Peak], period: Array | None
    ) -> tuple[list[int | None], list[int]]:
        """Return the peak of each track, and the peaks left, so that the sum of distances within the gate is least."""
        links: list[int | None] = [None] * len(tracks)
        if tracks and peaks:
            places = np.array([peak.position for peak in peaks])
            way = wrapped(np.array([track.position for track in tracks])[:, None] - places, period)
            distance = np.linalg.norm(way, axis=-1)
            # a pair outside the gate costs more than any set of pairs within it
            cost = np.where(distance <= self.gate, distance, self.gate * (1 + min(distance.shape)))
            from scipy.optimize import linear_sum_assignment  # slow to load

            for row, column in zip(*linear_sum_assignment(cost), strict=True):
                if distance[row, column] <= self.gate:
                    links[row] = int(column)
        taken = set(links)
        return links, [i for i in range(len(peaks)) if i not in taken]

    def _followed(self, track: PeakTrack, peak: Peak, period: Array | None) -> PeakTrack:
        """Draw a predicted track to its peak."""
        off = wrapped(np.subtract(peak.position, track.position), period)
        return track._replace(
            position=_moved(track.position, self.position_gain * off, period),
            velocity=tuple((np.add(track.velocity, self.velocity_gain * off)).tolist()),
            score=peak.score,
        )

    @cached_property
    def _lifecycle(self) -> Lifecycle:
        window = max(REMEMBERED, self.confirm_frames * self.miss_frames)
        return Lifecycle(
            confirm_frames=self.confirm_frames, confirm_window=window,
            delete_frames=self.miss_frames, drop_frames=self.miss_frames,
        )  # fmt: skip

    def _judged(self, track: PeakTrack, shape: tuple[int, ...], peak: bool | None) -> PeakTrack:
        """Confirm or delete a track; ``peak``: whether it had one, None where the frame is missing."""
        gone = track.fresh.against > math.log(self.deletion_frames) or (
            self.border == "bounded" and _outside(track.position, shape)
        )
        life, number = track.life, track.track
        if peak is not None:
            believed = track.fresh.best >= -math.log(self.confirm_risk)
            life, _ = self._lifecycle.step(life, float(peak), number, believed=believed, gone=gone)
        elif gone:
            life = life._replace(status="deleted")
        return track._replace(life=life)

    def _started(self, born: int, frame: int, peak: Peak, seen: int) -> PeakTrack:
        life, _ = self._lifecycle.step(Life(), 1.0, born, believed=self.confirm_risk == 1)
        fresh = Fresh.expecting(peak.score, self.smoothing, max(seen, 1))
        return PeakTrack(life, peak.position, peak.velocity, peak.score, frame, fresh)

    def _faded(self, remnant: Remnant, fade: float, period: Array | None, elapsed: float) -> Remnant:
        position = _moved(remnant.position, np.multiply(elapsed, remnant.velocity), period)
        return remnant._replace(position=position, score=fade * remnant.score)

    def _left_over(self, peak: Peak, remnants: list[Remnant], threshold: float, period: Array | None) -> bool:
        """Say whether a peak is what a deleted track has left."""
        for remnant in remnants:
            way = wrapped(np.subtract(peak.position, remnant.position), period)
            if np.linalg.norm(way) <= self.gate and peak.score - remnant.score <= threshold:
                return True
        return False


def _moved(position: tuple[float, ...], way: ArrayLike, period: Array | None) -> tuple[float, ...]:
    place = np.add(position, way)
    return tuple((place if period is None else place % period).tolist())


def _evidence(evidence: ArrayLike, peaks: Sequence[Peak]) -> Array:
    values = np.asarray(evidence, dtype=float)
    if values.ndim not in (1, 2) or not np.isfinite(values).all() or not values.any():
        raise DataError("evidence: must be a finite (n,) or (rows, columns) map, not all zero; None if it is missing.")
    if any(len(peak.position) != values.ndim for peak in peaks):
        raise DataError(f"peaks: must have {values.ndim} coordinates, as the evidence has axes.")
    return values


def _outside(position: tuple[float, ...], shape: tuple[int, ...]) -> bool:
    return any(not 0 <= round(x) < n for x, n in zip(position, reversed(shape), strict=True))
