"""IDF1: how much of the time each target has the one track that stands for it over the whole recording.

Ristani, Solera, Zou, Cucchiara and Tomasi (2016), Performance measures and a data set for multi-target, multi-camera
tracking, section 3: targets and tracks are paired once, so that the frames in which pairs agree are most.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from elusive.errors import ParameterError
from elusive.metrics._assignment import linear_sum_assignment
from elusive.metrics.target_table import Sightings, frames_of


class Identity(NamedTuple):
    """Rows of truth and tracks by the one-to-one pairing of targets and tracks."""

    true_positives: int  # IDTP: rows of a target that its track is within the gate of
    false_positives: int  # IDFP: rows of tracks that are left
    false_negatives: int  # IDFN: rows of targets that are left

    @property
    def idf1(self) -> float:
        """Share of rows that agree, ``2 IDTP / (2 IDTP + IDFP + IDFN)``; NaN without a row."""
        rows = 2 * self.true_positives + self.false_positives + self.false_negatives
        return 2 * self.true_positives / rows if rows else float("nan")

    @property
    def precision(self) -> float:
        """Share of the tracks' rows, IDP."""
        rows = self.true_positives + self.false_positives
        return self.true_positives / rows if rows else float("nan")

    @property
    def recall(self) -> float:
        """Share of the targets' rows, IDR."""
        rows = self.true_positives + self.false_negatives
        return self.true_positives / rows if rows else float("nan")


def identity(truth: Sightings, tracks: Sightings, gate: float = 2.0) -> Identity:
    """Pair targets and tracks once, and count.

    Parameters
    ----------
    truth, tracks
        From :func:`~elusive.metrics.target_table.sightings`.
    gate
        Distance up to which a track can stand for a target, in the places' unit.

    Raises
    ------
    ParameterError
        If the gate is not positive.
    DataError
        If truth and tracks have places of different dimension.
    """
    return paired(near_rows(truth, tracks, gate), len(truth.frame), len(tracks.frame))


def near_rows(truth: Sightings, tracks: Sightings, gate: float = 2.0) -> Counter[tuple[int, int]]:
    """Count the frames in which a target and a track are within the gate, by the numbers of both.

    Counts of a recording's pieces add up to the recording's. Arguments and errors as of :func:`identity`.
    """
    if not gate > 0:
        raise ParameterError(f"gate: must be above zero (got {gate}).")
    frames = frames_of(truth, tracks, None)
    together: Counter[tuple[int, int]] = Counter()
    for targets, names, apart in truth.apart(tracks, frames):
        row, column = np.nonzero(apart <= gate)
        together.update(zip(targets[row].tolist(), names[column].tolist(), strict=True))
    return together


def paired(together: Mapping[tuple[int, int], int], true_rows: int, track_rows: int) -> Identity:
    """Pair targets and tracks once, from :func:`near_rows` and the number of rows of truth and of tracks."""
    targets, names = (sorted({pair[part] for pair in together}) for part in (0, 1))
    row, column = ({number: at for at, number in enumerate(numbers)} for numbers in (targets, names))
    counts = np.zeros((len(targets), len(names)))
    for (target, track), count in together.items():
        counts[row[target], column[track]] = count
    agreed = int(counts[linear_sum_assignment(-counts)].sum())
    return Identity(agreed, track_rows - agreed, true_rows - agreed)
