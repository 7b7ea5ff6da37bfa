"""How far existence holds in this recording: of the tracks that were given as much, the share that was there again.

The reliability of a probability (Murphy, 1973, J. Appl. Meteorol. 12, 595-600), learnt from the recording as it goes,
made monotone by pooling (Ayer et al., 1955, Ann. Math. Stat. 26, 641-647). A track is there again where its peak is in
enough of the next frames; what chance gives is counted beside each track, and taken off. What was just missed, or is
young, is there again less often than another of as much probability: each kind has a curve of its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.optimize import isotonic_regression

from elusive.contracts import Array
from elusive.model import Model, Positive
from elusive.preprocess.peaks import Peaks
from elusive.tracking._peak_kernels import nearest
from elusive.tracking.peak_targets import PeakTargets
from elusive.tracking.peak_warp import Warp

EDGES = np.array([0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.99, 0.998])  # of groups of alike probability
GROUPS, KINDS = len(EDGES) + 1, 4  # of each kind of tracks: missed or seen of late, young or old
MISSED = 0.1  # share of its existence in which a track is hidden, from which its latest peak was missed
OLD = 20  # frames, which a place's past is learnt from: what is younger may be of that
SURE = 0.9  # probability from which the filter is sure
SUPPOSED = 3.0  # outcomes of each group that existence itself is supposed to have given beforehand
TURN = 2.4  # radians between the directions in which chance is looked for, from one target to the next


class Watch(NamedTuple):
    """Tracks whose peaks are looked for: ``(n, 2)`` places, of the tracks and beside them."""

    time_s: float
    place: Array  # (n, 2)
    velocity: Array  # (n, 2) a frame
    level: Array  # (n,)
    bright: NDArray[np.bool_]  # (n,)
    scale: Array  # (n,) [px]
    visible: Array  # (n,) probability that it is there and may be seen
    group: NDArray[np.int64]  # (n,)
    seen: NDArray[np.int64]  # (n, 2) frames with a peak at the track, and beside it
    looks: int


class Reliability(NamedTuple):
    """What became of tracks, by their kind and by groups of alike probability."""

    outcomes: Array  # (K G, 4) how many, their probability, there again, there by chance; sums
    share: Array  # (K G,) of them that were there again beyond chance; NaN before that is known
    watch: Watch | None

    def carried(self, warp: Warp) -> Reliability:
        """Return it where the scene is deformed, and what is watched with it."""
        if self.watch is None or not warp.deforms:
            return self
        return self._replace(watch=self.watch._replace(place=self.watch.place + warp.way(self.watch.place)))


class Persistence(Model):
    """How a track's existence is set against what became of this recording's tracks."""

    looks: int = Field(5, ge=1, description="Frames in which a track's peak is looked for")
    again: int = Field(2, ge=1, description="Of them with its peak from which the track is there again")
    near_px: Positive = Field(2.5, description="Distance within which a peak is the track's [px]")
    near_level: Positive = Field(0.9, description="Difference of log contrast within which it is, relative")
    beside_px: Positive = Field(12.0, description="Distance at which chance is looked for [px]")
    least_outcomes: int = Field(2, ge=1, description="Outcomes without which existence is not told")

    def begin(self) -> Reliability:
        """Return what is known before any frame."""
        return Reliability(np.zeros((KINDS * GROUPS, 4)), np.full(KINDS * GROUPS, np.nan), None)

    def after(
        self,
        known: Reliability,
        time_s: float,
        interval_s: float,
        targets: PeakTargets,
        tracks: NDArray[np.int64],
        peaks: Peaks,
        most: int,
    ) -> Reliability:
        """Return what is known after a frame, of whose targets some are ``tracks``, which take ``most`` peaks."""
        outcomes, share, watch = known
        if watch is not None and not peaks.cut:
            watch = self._looked(watch, (time_s - watch.time_s) / interval_s, peaks, most)
            if watch.looks < self.looks:
                return known._replace(watch=watch)
            there = watch.seen >= self.again
            rows = np.column_stack([np.ones(len(there)), watch.visible, there])
            outcomes = outcomes.copy()
            np.add.at(outcomes, watch.group, rows)
            share = self.shares(outcomes)
        watch = Watch(
            time_s, targets.mean_place[tracks], targets.mean_velocity[tracks], targets.level[tracks],
            targets.bright[tracks], targets.scale[tracks], targets.visible[tracks], groups_of(targets)[tracks],
            np.zeros((len(tracks), 2), np.int64), 0,
        )  # fmt: skip
        return Reliability(outcomes, share, watch if len(tracks) else None)

    def shares(self, outcomes: Array) -> Array:
        """Return how often tracks of each kind and group were there again, ``(K G,)``; NaN of too few outcomes."""
        count, supposed, again, chance = outcomes.T
        if count.sum() < self.least_outcomes:
            return np.full(len(count), np.nan)
        middle = np.tile(np.convolve(np.concatenate([[0.0], EDGES, [1.0]]), [0.5, 0.5], "valid"), KINDS)
        supposed = np.where(count > 0, supposed / np.maximum(count, 1), middle)
        by_chance = chance.sum() / count.sum()
        beyond = (again - by_chance * count) / (1 - min(by_chance, 0.9))
        weights = count + SUPPOSED
        share = (beyond + SUPPOSED * supposed) / weights
        for first in range(0, KINDS * GROUPS, GROUPS):
            kind = slice(first, first + GROUPS)
            share[kind] = isotonic_regression(share[kind], weights=weights[kind]).x
        return np.asarray(np.clip(share, 0.0, 1.0))

    def sure_again(self, known: Reliability) -> tuple[float, int]:
        """Of what the filter was sure of: the share that was there again beyond chance, NaN of none, and how many."""
        count, _, again, chance = known.outcomes.T
        group = np.arange(KINDS * GROUPS)
        sure = (group >= KINDS // 2 * GROUPS) & (group % GROUPS >= np.searchsorted(EDGES, SURE, "right"))
        held, by_chance = float(again[sure].sum()), float(chance.sum() / max(count.sum(), 1.0))
        number = int(count[sure].sum())
        return ((held / number - by_chance) / (1 - min(by_chance, 0.9)) if number else math.nan), number

    def _looked(self, watch: Watch, frames: float, peaks: Peaks, most: int) -> Watch:
        """Look for each track's peak, where it should be by now and beside that."""
        found = self._features(peaks.places_px[:most] - peaks.offset_px, peaks.level[:most], peaks.bright[:most])
        place = watch.place + frames * watch.velocity
        turn = TURN * np.arange(len(place))
        beside = place + self.beside_px * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        order = np.argsort(found[:, 0])
        sought = (self._features(at, watch.level, watch.bright) for at in (place, beside))
        near = [nearest(found, order, at, 1.0)[1] >= 0 for at in sought]
        return watch._replace(seen=watch.seen + np.stack(near, axis=1), looks=watch.looks + 1)

    def _features(self, places: Array, level: Array, bright: NDArray[np.bool_]) -> Array:
        """Lay peaks out such that those of one track are less than 1 apart, ``(m, 4)``."""
        return np.column_stack([places / self.near_px, level / self.near_level, 10.0 * bright])


def groups_of(targets: PeakTargets) -> NDArray[np.int64]:
    """Return the group of each target, ``(n,)``: of those missed of late first, of those the young first."""
    seen = targets.hidden < MISSED * targets.existence
    group: NDArray[np.int64] = GROUPS * (2 * seen + (targets.age >= OLD)) + np.searchsorted(
        EDGES, targets.visible, "right"
    )
    return group
