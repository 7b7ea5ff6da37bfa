"""CLEAR MOT: misses, false positives, mismatches, MOTA and MOTP of several targets.

Bernardin and Stiefelhagen (2008), EURASIP J. Image and Video Processing, 246309, section 2.1; Mendieta (2017),
eqs. 4.1 to 4.7. A pair of the last frame stays a pair while it is within the gate; what is left is assigned so that
as many pairs as possible are made and their distances are least in sum.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.metrics._assignment import linear_sum_assignment
from elusive.metrics.target_table import Sightings, frames_of

BEYOND = 1e6  # cost of a pair beyond the gate, in gates: more than any number of pairs within it


class ClearMot(NamedTuple):
    """Counts and deviations over a recording; the arrays hold a number for each frame."""

    targets: NDArray[np.int64]  # (T,) true targets, g
    misses: NDArray[np.int64]  # (T,) m, eq. 4.4
    false_positives: NDArray[np.int64]  # (T,) fp, eq. 4.5
    mismatches: NDArray[np.int64]  # (T,) mme, eq. 4.6
    deviations: Array  # (M,) distance of each pair, eq. 4.1, in the places' unit
    pairs: NDArray[np.int64]  # (M, 3) frame, target and track of each pair

    @property
    def mota(self) -> float:
        """Multiple object tracking accuracy, eq. 4.7; NaN without a true target."""
        wrong = self.misses.sum() + self.false_positives.sum() + self.mismatches.sum()
        return 1 - float(wrong) / float(self.targets.sum()) if self.targets.any() else float("nan")

    @property
    def motp(self) -> float:
        """Mean deviation of the pairs, eq. 4.3, in the places' unit; NaN without a pair."""
        return float(self.deviations.mean()) if self.deviations.size else float("nan")

    @property
    def max_deviation(self) -> float:
        """Largest deviation of a pair, eq. 4.2; NaN without a pair."""
        return float(self.deviations.max()) if self.deviations.size else float("nan")


def clear_mot(
    truth: Sightings,
    tracks: Sightings,
    gate: float = 2.0,
    frames: int | None = None,
    before: Mapping[int, int] | None = None,
) -> ClearMot:
    """Compare tracks with the truth, frame by frame.

    Parameters
    ----------
    truth, tracks
        From :func:`~elusive.metrics.target_table.sightings`.
    gate
        Distance up to which a track can stand for a target, in the places' unit.
    frames
        Frames to score; all up to the last in which there is something, by default.
    before
        The track that stood last for each target in earlier frames, where a recording is scored piece by piece.

    Returns
    -------
    ClearMot
        A target that is taken over by another track than the one that stood for it last, however long ago, is a
        mismatch.

    Raises
    ------
    ParameterError
        If the gate is not positive.
    DataError
        If truth and tracks have places of different dimension, or a row lies beyond the frames given.
    """
    if not gate > 0:
        raise ParameterError(f"gate: must be above zero (got {gate}).")
    count = frames_of(truth, tracks, frames)
    numbers = np.zeros((4, count), np.int64)
    deviations: list[float] = []
    matched: list[tuple[int, int, int]] = []
    last = dict(before or {})  # the track that stood last for each target
    for frame, (targets, names, apart) in enumerate(truth.apart(tracks, count)):
        pairs = _kept(targets, names, apart, last, gate)
        pairs |= _assigned(apart, pairs, gate)
        switched = 0
        for row, column in pairs.items():
            target, track = int(targets[row]), int(names[column])
            switched += last.get(target, track) != track
            last[target] = track
            deviations.append(float(apart[row, column]))
            matched.append((frame, target, track))
        numbers[:, frame] = len(targets), len(targets) - len(pairs), len(names) - len(pairs), switched
    present, missed, false, mismatched = numbers
    who = np.array(matched, np.int64).reshape(-1, 3)
    return ClearMot(present, missed, false, mismatched, np.array(deviations), who)


def _kept(
    targets: NDArray[np.int64], names: NDArray[np.int64], apart: Array, last: dict[int, int], gate: float
) -> dict[int, int]:
    """Return the pairs (row: column) of an earlier frame that are still within the gate."""
    column_of = {int(name): column for column, name in enumerate(names)}
    pairs: dict[int, int] = {}
    for row, target in enumerate(targets):
        column = column_of.get(last.get(int(target), -1))
        if column is not None and column not in pairs.values() and apart[row, column] <= gate:
            pairs[row] = column
    return pairs


def _assigned(apart: Array, taken: dict[int, int], gate: float) -> dict[int, int]:
    """Return further pairs, of the rows and columns that are left."""
    rows = np.array([row for row in range(apart.shape[0]) if row not in taken], dtype=np.int64)
    columns = np.array([column for column in range(apart.shape[1]) if column not in taken.values()], dtype=np.int64)
    if not (rows.size and columns.size):
        return {}
    left = apart[np.ix_(rows, columns)]
    at, to = linear_sum_assignment(np.where(left <= gate, left, BEYOND * gate))
    return {int(rows[a]): int(columns[b]) for a, b in zip(at, to, strict=True) if left[a, b] <= gate}
