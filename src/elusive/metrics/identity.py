"""IDF1: how much of the time each target has the one track that stands for it over the whole recording.

Ristani, Solera, Zou, Cucchiara and Tomasi (2016), Performance measures and a data set for multi-target, multi-camera
tracking, section 3: targets and tracks are paired once, so that the frames in which pairs agree are most.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from elusive.errors import ParameterError
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
    if not gate > 0:
        raise ParameterError(f"gate: must be above zero (got {gate}).")
    frames = frames_of(truth, tracks, None)
    targets, target_of = np.unique(truth.identity, return_inverse=True)
    names, name_of = np.unique(tracks.identity, return_inverse=True)
    together = np.zeros((len(targets), len(names)))
    numbered = truth._replace(identity=target_of), tracks._replace(identity=name_of)
    for (rows, true), (columns, placed) in zip(*(table.in_frames(frames) for table in numbered), strict=True):
        if len(rows) and len(columns):
            near = np.linalg.norm(true[:, None] - placed[None], axis=2) <= gate
            together[np.ix_(rows, columns)] += near
    agreed = int(together[linear_sum_assignment(-together)].sum())
    return Identity(agreed, len(tracks.frame) - agreed, len(truth.frame) - agreed)
