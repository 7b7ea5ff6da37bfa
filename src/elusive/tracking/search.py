"""Targets that are not known yet: paths of much evidence, to a fraction of a cell, out of a map of what is left over.

Mazurek (2013), eq. 7, over a coarse bank of velocities; then each peak of the map is refined in the evidence of the
latest frames, and taken out of all that has been accumulated, so that it leaves no ghosts at other velocities. What
other targets explain is taken out before (Hogbom's (1974) CLEAN, in the evidence of moving points).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from scipy import ndimage

from elusive.contracts import Array
from elusive.filters.accumulate.recurrent import Map, RecurrentFilter, RecurrentState
from elusive.tracking.extent import Scale, age_of, as_wide_as_seen, centred, patch_of
from elusive.tracking.footprint import Footprint
from elusive.tracking.trail import Seen, Trail, cut, frame_deviation

MEMORIES = 4  # of 1 / (1 - alpha) frames that are remembered
REMEMBERED_BYTES = 2**27  # at most
AT_ONCE = 8  # targets taken out of a frame; what is left is found in the next
TRIED = 8  # peaks of a map that are looked at, until one is a target
LEAST_FRAMES = 1.8  # that a path's evidence must come from: one frame tells no velocity
STEADY = 4.0  # frames of a steady target, to those that most of its evidence, which is noise too, comes from
RECUT = 2  # times that patches are cut about a better path
STAGES = 4  # frames of the first climb, which are doubled up to all


class Candidate(NamedTuple):
    """A target that was not known."""

    path: Array  # (4,) x, y in the scene, vx, vy
    score: float  # in deviations of what target-free evidence accumulates to
    trail: Trail  # before it was taken out
    age: float  # how long ago its evidence came, in the mean
    lasting: int  # frames that its evidence came in, about
    footprint: Footprint  # as wide as it is seen to be


class SearchState(NamedTuple):
    """What is accumulated, and the latest frames; changed in place, so that the latest state alone is valid."""

    recurrent: RecurrentState
    past: tuple[Seen, ...]


class VelocitySearch:
    """Finds new targets in evidence that the known ones do not explain.

    Parameters
    ----------
    flt
        Accumulates the evidence.
    footprint
        What a target does to it.
    clutter
        Whether scores are held against what the evidence itself accumulates to, or against white noise.
    """

    def __init__(self, flt: RecurrentFilter, footprint: Footprint, clutter: bool = False) -> None:
        self.filter, self.footprint, self.clutter = flt, footprint, clutter

    def init(self, rng: Generator, time_s: float = math.nan) -> SearchState:
        """Return the state before the first frame."""
        return SearchState(self.filter.init(rng, time_s), ())

    def remembered(self, cells: int) -> int:
        """Return how many frames of so many cells are remembered."""
        return max(2, min(math.ceil(MEMORIES / (1 - self.filter.smoothing)), REMEMBERED_BYTES // (4 * cells)))

    def step(
        self, state: SearchState, time_s: float, evidence: Map | None, scene_px: Sequence[float], rng: Generator
    ) -> SearchState:
        """Return the state at a time, after evidence ``(n,)`` or ``(rows, columns)`` that is left over, or none.

        ``scene_px`` says where the scene is, x[, y]: how far from where it was in the first frame.

        Raises
        ------
        DataError
            As :meth:`~elusive.filters.accumulate.recurrent.RecurrentFilter.step`.
        """
        recurrent = state.recurrent
        if recurrent.scene_px or any(scene_px):
            recurrent = self.filter.carried(recurrent, np.subtract(scene_px, recurrent.scene_px or 0.0))
        recurrent = self.filter.step(recurrent, time_s, evidence, rng)
        if self.clutter:
            self.filter.learn_clutter(
                recurrent, recurrent.score.size / (2 * self.footprint.half) ** recurrent.score.ndim
            )
        if evidence is None:
            return SearchState(recurrent, state.past)
        kept = np.array(np.atleast_2d(evidence), dtype=np.float32)
        seen = Seen(time_s, np.array([*scene_px, 0.0][:2]), kept, frame_deviation(kept))
        return SearchState(recurrent, (*state.past, seen)[-self.remembered(kept.size) :])

    def candidates(self, state: SearchState, threshold: float, rng: Generator) -> tuple[SearchState, list[Candidate]]:
        """Take the targets that stand out of the map out of the state, the strongest first, and return both.

        Parameters
        ----------
        state
            The latest.
        threshold
            Score above which a cell is an alarm; infinity finds nothing.
        rng
            Not used: nothing is drawn.
        """
        found: list[Candidate] = []
        while len(found) < AT_ONCE:
            candidate = self._strongest(state, threshold)
            if candidate is None:
                break
            found.append(candidate)
            self.take_out(state, candidate.path, candidate.footprint)
            # the map of what is left, in which the strongest is no ghost
            recurrent = self.filter.step(state.recurrent, state.recurrent.time_s, None, rng)
            state = state._replace(recurrent=recurrent)
        return state, found

    def _strongest(self, state: SearchState, threshold: float) -> Candidate | None:
        recurrent = state.recurrent
        if recurrent.belief is None or not state.past:
            return None
        score, velocity = np.atleast_2d(recurrent.score), np.atleast_2d(recurrent.velocity)
        if not score.max() > threshold:
            return None
        around = ndimage.maximum_filter(score, size=3, mode="wrap" if self.filter.border == "circular" else "nearest")
        cells = np.argwhere((score == around) & (score > threshold))
        order = np.argsort(-score[tuple(cells.T)], kind="stable")[:TRIED]
        for row, column in cells[order].tolist():
            vx, vy = recurrent.belief.vectors[velocity[row, column]]
            start = np.array([column, row, vx, vy], dtype=float)
            start[:2] -= state.past[-1].scene_px
            candidate = self._refined(state, start, threshold)
            if candidate is not None:
                return candidate
        return None

    def _refined(self, state: SearchState, start: Array, threshold: float) -> Candidate | None:
        """Refine a peak; None where less is left of it than the threshold, or all in one frame."""
        now, smoothing, step = state.recurrent.time_s, self.filter.smoothing, max(1.0, self.footprint.half)
        trail = cut(state.past, now, start, 3 * math.ceil(step), self.filter.border)
        scale, footprint = Scale(now, smoothing, state.recurrent, threshold), self.footprint
        if not scale.score(trail, start) > threshold:
            return None
        shorter, frames = start, STAGES
        while frames < len(trail.times_s):
            shorter, frames = trail.climbed(now, shorter, smoothing, step, frames), 2 * frames
        paths = [trail.climbed(now, path, smoothing, step) for path in (start, shorter)]
        path = max(paths, key=lambda path: trail.total(now, path, smoothing))
        # what the first patches, about a coarse path, did not reach
        for _ in range(RECUT):
            trail = cut(state.past, now, path, self.patch, self.filter.border)
            path = trail.climbed(now, path, smoothing, self.footprint.slope)
        for _ in range(RECUT):
            # to the middle of all that is seen of it
            trail = cut(state.past, now, path, self.patch, self.filter.border)
            footprint = as_wide_as_seen(self.footprint, trail, path, scale)
            if footprint == self.footprint:
                break
            path = centred(trail, path, self.footprint, footprint, scale)
        score = scale.score(trail, path)
        shares = smoothing ** trail.ages(now) * np.maximum(trail.values(now, path), 0.0)
        most = shares.sum() ** 2 / ((shares**2).sum() or 1.0)
        if score <= threshold or most < LEAST_FRAMES:
            return None
        lasting = math.ceil(STEADY * most)
        return Candidate(path, score, trail, age_of(trail, path, now, smoothing), lasting, footprint)

    @cached_property
    def patch(self) -> int:
        """Cells to each side of a target that its trail keeps."""
        return patch_of(self.footprint)

    def take_out(self, state: SearchState, path: Array, footprint: Footprint) -> None:
        """Take a target on a path at the state's time out of the latest frames and of what has been accumulated."""
        now, recurrent, border = state.recurrent.time_s, state.recurrent, self.filter.border
        sizes = cut(state.past, now, path, 2, border).values(now, path)
        for seen, size in zip(state.past, np.maximum(sizes, 0.0), strict=True):
            place = path[:2] - (now - seen.time_s) * path[2:] + seen.scene_px
            rows, columns, removed = footprint.remove(seen.evidence, place, size, seen.deviation, border)
            if removed.size:
                scene = tuple(seen.scene_px[: recurrent.score.ndim].tolist())
                self.filter.forget(recurrent, seen.time_s, scene, (int(rows[0]), int(columns[0])), removed)
