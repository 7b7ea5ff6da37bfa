"""Several targets in maps of evidence: the known followed, what they do not explain searched for new ones.

Each known target is followed along its own trail, less what the others explain there; the rest is accumulated over
all trajectories, Mazurek (2013), eq. 7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from elusive.contracts import Array, interval_since
from elusive.errors import DataError
from elusive.filters.accumulate.recurrent import Map, RecurrentFilter, RecurrentState
from elusive.tracking.accumulated import PeakTrack, PeakTracker
from elusive.tracking.extent import Scale, age_of, as_wide_as_seen, centred
from elusive.tracking.footprint import Border, Footprint
from elusive.tracking.fresh import Fresh
from elusive.tracking.lifecycle import Life
from elusive.tracking.neighbours import same, together, way, without_doubles
from elusive.tracking.search import Candidate, SearchState, VelocitySearch
from elusive.tracking.trail import Seen, cut, frame_deviation

STEADY = 0.3  # deviation of a target's evidence in a frame about its level, to that, where nothing says otherwise
ENTWINED = 0.5  # share of another's evidence at a target's place beyond which a frame tells nothing of it alone
Threshold = Callable[[RecurrentState, int], float]  # of a state, with so many frames of evidence accumulated


class FollowedState(NamedTuple):
    """Tracks after a frame; a deleted track is shown once as such. Changed in place: the latest alone is valid."""

    time_s: float
    frames: int  # frames so far, missing ones too
    seen: int  # frames with evidence
    tracks: tuple[PeakTrack, ...]
    born: int  # tracks begun so far
    search: SearchState
    threshold: float  # that a path of evidence must exceed; infinity before any evidence
    score: Map  # the map of the best trajectories, with the known targets, whose evidence is not accumulated there


class Follower:
    """Follows known targets and finds new ones in maps of evidence.

    Parameters
    ----------
    flt
        Accumulates what no known target explains.
    tracker
        When tracks are believed and end.
    footprint
        What a target does to evidence.
    clutter
        Whether evidence is held against what it accumulates to without a target, or against white noise.
    """

    def __init__(self, flt: RecurrentFilter, tracker: PeakTracker, footprint: Footprint, clutter: bool = False) -> None:
        self.tracker, self.footprint = tracker, footprint
        self.search = VelocitySearch(flt, footprint, clutter)

    def init(self, rng: Generator, time_s: float = math.nan) -> FollowedState:
        """Return the state before the first frame: no track."""
        search = self.search.init(rng, time_s)
        return FollowedState(time_s, 0, 0, (), 0, search, math.inf, search.recurrent.score)

    def step(
        self,
        state: FollowedState,
        time_s: float,
        evidence: ArrayLike | None,
        threshold: Threshold,
        rng: Generator,
        scene_px: Sequence[float] | None = None,
    ) -> FollowedState:
        """Return the tracks at a time.

        Parameters
        ----------
        state
            The latest.
        time_s
            Of the evidence.
        evidence
            ``(n,)`` or ``(rows, columns)``, of mean zero without a target; None for a missing frame.
        threshold
            Score above which there is a target, for what is left over.
        rng
            Not used: nothing is drawn.
        scene_px
            Where the scene of the first frame is now, x[, y].

        Raises
        ------
        DataError
            If time runs backwards, or the evidence is not finite or of another shape than before.
        """
        elapsed = interval_since(state.time_s, time_s)
        given = None if evidence is None else _checked(evidence)
        axes = given.ndim if given is not None else state.score.ndim
        scene = (0.0,) * axes if scene_px is None else tuple(scene_px)
        at = np.array([*scene, 0.0][:2])
        tracks = [_moved(track, elapsed) for track in state.tracks if track.life.lives]
        left = given
        if given is not None and tracks:
            left = np.array(given, dtype=np.float32)
            tracks = self._explained(np.atleast_2d(left), at, tracks, self.scale(state, time_s))
        search = self.search.step(state.search, time_s, left, scene, rng)
        recurrent, seen = search.recurrent, state.seen + (given is not None)
        if recurrent.belief is None:
            return state._replace(time_s=time_s, frames=state.frames + 1, search=search)
        limit, shape = threshold(recurrent, max(seen, 1)), recurrent.score.shape
        scale = Scale(time_s, self.search.filter.smoothing, recurrent, limit)
        tracks = [track._replace(score=scale.score(track.trail, track.path)) for track in tracks]
        judged = [
            self._judged(self._placed(track, at, shape), shape, None if given is None else track.score > limit)
            for track in tracks
        ]
        born, found = state.born, list[Candidate]()
        best = recurrent.score
        if given is not None:
            search, found = self.search.candidates(search, limit, rng)
        for candidate in found:
            track = self._started(candidate, born, state.frames + 1, max(seen, 1))
            if not any(same(other, track, shape, self.search.filter.border) for other in judged):
                born = track.track
                judged.append(self._placed(track, at, shape))
        judged = without_doubles(judged, time_s, shape, self.search.filter.border)
        score = self._shown(best, [track for track in judged if track.life.lives])
        return FollowedState(time_s, state.frames + 1, seen, tuple(judged), born, search, limit, score)

    def scale(self, state: FollowedState, time_s: float) -> Scale:
        """Return what evidence is measured by after a state's frame."""
        return Scale(time_s, self.search.filter.smoothing, state.search.recurrent, state.threshold)

    def _explained(self, evidence: Map, at: Array, tracks: list[PeakTrack], scale: Scale) -> list[PeakTrack]:
        """Follow the tracks to where a frame's evidence has them, and take them out of it, in place."""
        deviation, flt, time_s = frame_deviation(evidence), self.search.filter, scale.time_s
        frame = Seen(time_s, at, evidence.copy(), deviation)
        most, patch = self.search.remembered(evidence.size), self.search.patch
        paths = np.array([track.path for track in tracks])
        sizes, shape, followed = self._sizes(frame, paths, tracks), evidence.shape, list[PeakTrack]()
        for track in tracks:
            others = [(other, size) for other, size in zip(tracks, sizes, strict=True) if other is not track]
            own = cut([self._without(frame, track, others)], time_s, track.path, patch, flt.border)
            value = float(own.values(time_s, track.path)[0])
            trail = track.trail.after(own, most)
            path = centred(trail, track.path, self.footprint, track.footprint, scale)
            if np.abs(path[:2] - track.path[:2]).max() > math.ceil(track.footprint.half) + 2:
                path = track.path  # it has climbed away from all that is known of it
            hidden = max((_share(other, track, shape, flt.border) for other, _ in others), default=0.0)
            apart = [one for one in others if not together(track, one[0], patch, shape, flt.border)]
            seen = cut([self._without(frame, track, apart)], time_s, track.path, patch, flt.border)
            fresh = track.fresh.after(value / deviation / scale.recurrent.spread(path[2:]), flt.smoothing)
            about = track.about.after(seen, most)
            followed.append(track._replace(
                path=path, trail=trail, age=age_of(trail, path, time_s, flt.smoothing), about=about,
                footprint=as_wide_as_seen(self.footprint, about, path, scale),
                fresh=fresh if hidden < ENTWINED else track.fresh,
            ))  # fmt: skip
        paths = np.array([track.path for track in followed])
        for track, size in zip(followed, self._sizes(frame, paths, tracks), strict=True):
            track.footprint.remove(evidence, track.path[:2] + at, size, deviation, flt.border)
        return followed

    def _sizes(self, frame: Seen, paths: Array, tracks: Sequence[PeakTrack]) -> Array:
        """How much evidence each target adds at its place in a frame, ``(n,)``: all together, and near their levels.

        Evidence at their places is G a with noise of covariance G, for matched filters of white noise.
        """
        if not math.isfinite(self.footprint.unknown):
            return np.zeros(len(tracks))
        now = frame.time_s
        read = [float(cut([frame], now, path, 2, self.search.filter.border).values(now, path)[0]) for path in paths]
        level = np.array([track.fresh.level for track in tracks])
        certain = 1 / (np.array([track.fresh.spread for track in tracks]) + (STEADY * level) ** 2)
        between = self.footprint.between(paths[:, :2]) + np.diag(certain)
        found: Array = np.linalg.solve(between, np.array(read) / frame.deviation + certain * level)
        return frame.deviation * np.maximum(found, 0.0)

    def _without(self, frame: Seen, track: PeakTrack, others: Sequence[tuple[PeakTrack, float]]) -> Seen:
        """Return a frame about a target, less what others explain; of those that are masked, where they are nearer."""
        here = frame.evidence.copy() if others else frame.evidence
        shape, border = (here.shape[0], here.shape[1]), self.search.filter.border
        for other, size in others:
            if np.abs(way(track.path, other.path, shape, border)).max() > self.search.patch + other.footprint.reach + 2:
                continue
            rows, columns, share = other.footprint.box(other.path[:2] + frame.scene_px, shape, border)
            if not math.isfinite(self.footprint.unknown):
                cells = np.stack(np.meshgrid(columns, rows), axis=-1) - frame.scene_px
                share = np.where(
                    share > track.footprint.share(way(track.path, cells, shape, border)).prod(axis=-1), share, 0
                )
            at = np.ix_(rows, columns)
            here[at] = other.footprint.left_over(here[at], share, size, frame.deviation)
        return frame._replace(evidence=here)

    def _placed(self, track: PeakTrack, at: Array, shape: tuple[int, ...]) -> PeakTrack:
        """Place a track in the frame."""
        lengths = np.array(shape[::-1])
        place = (track.path[:2] + at)[: len(lengths)]
        if self.search.filter.border == "circular":
            place %= lengths
        velocity = track.path[2 : 2 + len(lengths)]
        return track._replace(position=tuple(place.tolist()), velocity=tuple(velocity.tolist()))

    def _judged(self, track: PeakTrack, shape: tuple[int, ...], hit: bool | None) -> PeakTrack:
        """Confirm or delete a track."""
        place, lengths = np.array(track.position), np.array(shape[::-1])
        outside = bool(((place < -0.5) | (place > lengths - 0.5)).any()) and self.search.filter.border == "bounded"
        return track._replace(life=self.tracker.judged(track.life, track.track, track.fresh, hit, outside=outside))

    def _started(self, candidate: Candidate, born: int, frame: int, seen: int) -> PeakTrack:
        life, _ = self.tracker.lifecycle.step(Life(), 1.0, born, believed=self.tracker.confirm_risk == 1)
        fresh = Fresh.expecting(candidate.score, self.search.filter.smoothing, seen, min(candidate.lasting, seen))
        return PeakTrack(
            life, (), (), candidate.score, frame, fresh, candidate.path, candidate.trail, candidate.age,
            candidate.trail, candidate.footprint,
        )  # fmt: skip

    def _shown(self, score: Map, tracks: Sequence[PeakTrack]) -> Map:
        """Return a map of scores with those of the known targets at their places."""
        shown = np.array(np.atleast_2d(score))
        for track in tracks:
            place = np.append(track.position, 0.0)[:2]
            rows, columns, share = track.footprint.box(
                place, (shown.shape[0], shown.shape[1]), self.search.filter.border
            )
            at = np.ix_(rows, columns)
            shown[at] = np.maximum(shown[at], track.score * share)
        return shown.reshape(score.shape)


def _share(other: PeakTrack, track: PeakTrack, shape: tuple[int, ...], border: Border) -> float:
    """Share of another's evidence at a track's place."""
    return float(other.footprint.share(way(other.path, track.path, shape, border)).prod())


def _moved(track: PeakTrack, elapsed_s: float) -> PeakTrack:
    path = track.path.copy()
    path[:2] += elapsed_s * path[2:]
    return track._replace(path=path)


def _checked(evidence: ArrayLike) -> Array:
    values = np.asarray(evidence, dtype=float)
    if values.ndim not in (1, 2) or not np.isfinite(values).all():
        raise DataError("evidence: must be a finite (n,) or (rows, columns) map; None if it is missing.")
    return values
