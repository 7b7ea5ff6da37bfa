"""Pairs of tracks that are not told apart: two people who walk together, or one person twice.

Two who walk each on their own are within each other's ellipses now and then; what of one person a site lets err for
seconds makes a second track that goes wherever the first does.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from elusive.contracts import X, Y
from elusive.tracking.track import Step, Track

TOGETHER = 5.99  # squared distance in deviations of both, below which 95 % of those of one place are
LEAST_S, FEWEST = 5.0, 20  # for which a pair is there, and in how many frames
BESIDE = 0.8  # share of these: .94 to 1 where one person was two, .41 and less of two who walk


class Pair(NamedTuple):
    """Two tracks that have been there together."""

    began_s: float
    time_s: float
    frames: int = 0
    together: int = 0
    place: tuple[float, float] = (0.0, 0.0)  # of the first, when they were last together [m]

    @property
    def share(self) -> float:
        """Share of the frames in which they are not told apart; 0 of too few."""
        known = self.frames >= FEWEST and self.time_s - self.began_s >= LEAST_S
        return self.together / self.frames if known else 0.0


class Pairs:
    """Finds the pair that is told apart least, at constant memory."""

    def __init__(self) -> None:
        self._now: dict[tuple[int, int], Pair] = {}
        self._gone: Pair | None = None

    @property
    def closest(self) -> Pair | None:
        """The pair that is told apart in the least share of its frames; none: no pair was there long enough."""
        known = [pair for pair in (*self._now.values(), self._gone) if pair is not None and pair.share > 0]
        return max(known, key=lambda pair: pair.share, default=None)

    def add(self, step: Step) -> None:
        """Take in a step."""
        sure = sorted((track for track in step.tracks if track.status == "confirmed"), key=lambda track: track.track)
        self._gone = self.closest
        self._now = {(one.track, two.track): self._after((one, two), step.time_s) for one, two in combinations(sure, 2)}

    def _after(self, tracks: tuple[Track, Track], time_s: float) -> Pair:
        one, two = tracks
        before = self._now.get((one.track, two.track), Pair(time_s, time_s))._replace(time_s=time_s)
        off, covariance = (one.mean - two.mean)[[X, Y]], (one.covariance + two.covariance)[np.ix_([X, Y], [X, Y])]
        pair = before._replace(frames=before.frames + 1)
        if off @ np.linalg.solve(covariance, off) >= TOGETHER:
            return pair
        return pair._replace(together=before.together + 1, place=(float(one.mean[X]), float(one.mean[Y])))
