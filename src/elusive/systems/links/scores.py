"""Scores of people tracked through a radio network against where they truly were, gathered over a log of any length.

Mendieta (2017), eqs. 4.1-4.7 (CLEAR MOT), with IDF1 and GOSPA beside them. Frames are scored some at a time: what is
kept is counts, and a number for each pair of a person and a track that were near each other.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from elusive.io import TrackRow
from elusive.io.path_truth import PathTruth
from elusive.metrics import Sightings, clear_mot, gospa, sightings, sightings_of
from elusive.metrics.identity_scores import near_rows, paired

GATE_M = 2.0  # of the thesis's scores, section 4.1
FRAMES_AT_ONCE = 1024
SCORED = (("", ("confirmed",)), (", candidates too", ("confirmed", "candidate")))  # words, statuses


class LinkScores:
    """Scores confirmed tracks, and those with candidates, over the frames after calibration with somebody there.

    Parameters
    ----------
    truth
        Where people truly were.
    """

    def __init__(self, truth: PathTruth) -> None:
        self._truth = truth
        self._counts = [_Counts() for _ in SCORED]
        self._times: list[float] = []
        self._calibrating: list[bool] = []
        self._rows: list[tuple[int, TrackRow]] = []  # with the frame's number among those above

    def offer(self, time_s: float, rows: Sequence[TrackRow], *, calibrating: bool) -> None:
        """Take in one more frame's rows."""
        self._rows += [(len(self._times), row) for row in rows]
        self._times.append(time_s)
        self._calibrating.append(calibrating)
        if len(self._times) >= FRAMES_AT_ONCE:
            self._score()

    def lines(self) -> list[tuple[str, str]]:
        """Return what the table about the run says of the scores so far."""
        self._score()
        return [line for (words, _), counts in zip(SCORED, self._counts, strict=True) for line in counts.lines(words)]

    def _score(self) -> None:
        if not self._times:
            return
        places = self._truth.interpolated(self._times)[..., :2]
        places[self._calibrating] = np.nan
        true = sightings_of(places)
        for (_, statuses), counts in zip(SCORED, self._counts, strict=True):
            rows = [(frame, row) for frame, row in self._rows if row.status in statuses]
            found = sightings(
                np.array([frame for frame, _ in rows], np.int64), np.array([row.track for _, row in rows], np.int64),
                np.array([(row.x, row.y) for _, row in rows]).reshape(-1, 2),
            )  # fmt: skip
            counts.add(true, found, len(self._times))
        self._times, self._calibrating, self._rows = [], [], []


class _Counts:
    """What the scores are made of, over the frames so far."""

    def __init__(self) -> None:
        self._frames = self._targets = self._misses = self._false = self._mismatches = 0
        self._pairs, self._deviation_m, self._greatest_m = 0, 0.0, math.nan
        self._gospa_m = 0.0
        self._last: dict[int, int] = {}  # the track that stood last for each person
        self._near: Counter[tuple[int, int]] = Counter()
        self._true_rows = self._track_rows = 0

    def add(self, true: Sightings, found: Sightings, frames: int) -> None:
        mot = clear_mot(true, found, GATE_M, frames, self._last)
        self._last |= {target: track for _, target, track in mot.pairs.tolist()}
        self._frames += frames
        self._targets += int(mot.targets.sum())
        self._misses += int(mot.misses.sum())
        self._false += int(mot.false_positives.sum())
        self._mismatches += int(mot.mismatches.sum())
        self._pairs += len(mot.deviations)
        self._deviation_m += float(mot.deviations.sum())
        self._greatest_m = float(np.fmax(self._greatest_m, mot.max_deviation))
        self._gospa_m += float(gospa(true, found, GATE_M, 2.0, frames).distance.sum())
        self._near += near_rows(true, found, GATE_M)
        self._true_rows += len(true.frame)
        self._track_rows += len(found.frame)

    def lines(self, words: str) -> list[tuple[str, str]]:
        wrong = self._misses + self._false + self._mismatches
        mota = 1 - wrong / self._targets if self._targets else math.nan
        deviation = f"no pair within {GATE_M:g} m"
        if self._pairs:
            mean_m = self._deviation_m / self._pairs
            deviation = f"{mean_m:.2f} m mean, {self._greatest_m:.2f} m greatest, of pairs within {GATE_M:g} m"
        idf1 = paired(self._near, self._true_rows, self._track_rows).idf1
        counted = f"{self._misses} misses, {self._false} false, {self._mismatches} mismatches"
        return [
            (f"MOTA{words}", f"{mota:.3f}: {counted} of {self._targets}"),
            (f"Deviation{words}", deviation),
            (f"IDF1, GOSPA{words}", f"{idf1:.3f}, {self._gospa_m / self._frames:.2f} m"),
        ]
