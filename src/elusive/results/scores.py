"""Scores of a log's tracks against where targets truly were, the same for every system.

CLEAR MOT (Bernardin and Stiefelhagen, 2008), IDF1 (Ristani et al., 2016), OSPA (Schuhmacher, Vo and Vo, 2008) and
GOSPA (Rahmathullah, Garcia-Fernandez and Svensson, 2017). Steps are scored some at a time, so that a recording of any
length is: what is kept is counts, and a number for each pair of a target and a track that were near each other.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.metrics import Identity, clear_mot, gospa, ospa, sightings, sightings_of
from elusive.metrics.identity_scores import near_rows, paired
from elusive.results.log import TrackLog
from elusive.results.table import STATUSES
from elusive.tracking.track import Status

STEPS_AT_ONCE = 1024
CONFIRMED: tuple[Status, ...] = ("confirmed",)


class Scores(NamedTuple):
    """What the tracks are worth over a recording; distances are in the log's unit."""

    steps: int
    targets: int  # true targets, summed over the steps
    misses: int
    false: int
    mismatches: int
    pairs: int
    squares: float  # of the pairs' deviations, summed
    deviation: float  # the pairs' mean, MOTP; NaN without a pair
    greatest: float  # of the pairs' deviations; NaN without a pair
    ospa: float  # mean over the steps
    gospa: float  # mean over the steps
    identity: Identity
    strays: int  # tracks that never were within the gate of a target
    gate: float
    unit: str

    @property
    def mota(self) -> float:
        """Multiple object tracking accuracy; NaN without a true target."""
        return 1 - (self.misses + self.false + self.mismatches) / self.targets if self.targets else math.nan

    @property
    def rmse(self) -> float:
        """Root mean square deviation of the pairs; NaN without a pair."""
        return math.sqrt(self.squares / self.pairs) if self.pairs else math.nan

    def lines(self, words: str = "") -> list[tuple[str, str]]:
        """Return what a table about the run says; ``words`` stand behind each name."""
        near = f"within {self.gate:g} {self.unit}"
        off = f"{self.rmse:.2f} {self.unit} RMS, {self.greatest:.2f} greatest" if self.pairs else "no target is found"
        counted = f"{self.misses} misses, {self.false} false, {self.mismatches} mismatches"
        found = f"{100 * (1 - self.misses / self.targets):.0f} %" if self.targets else "no target is there"
        return [
            (f"Targets found {near}{words}", f"{found}{' of their times' if self.targets else ''}"),
            (f"Error there{words}", off),
            (f"MOTA{words}", f"{self.mota:.3f}: {counted} of {self.targets}"),
            (f"IDF1, OSPA, GOSPA{words}", f"{self.identity.idf1:.3f}, {self.ospa:.2f}, {self.gospa:.2f} {self.unit}"),
            (f"Tracks that never met a target{words}", str(self.strays)),
        ]


def score(
    log: TrackLog,
    truth: ArrayLike,
    gate: float,
    statuses: Collection[Status] = CONFIRMED,
    period: float = math.inf,
) -> Scores:
    """Score a log's tracks.

    Parameters
    ----------
    log
        The tracks.
    truth
        Places at the log's steps in its unit, ``(T, targets, axes)``, NaN where a target is absent: the log's first
        axes.
    gate
        Distance up to which a track can stand for a target, and the cutoff of OSPA and GOSPA.
    statuses
        Of the tracks that count.
    period
        Of a line whose ends meet. Distances are then chords of a circle, a fraction ``(gate / period)^2`` shorter.

    Raises
    ------
    DataError
        If the truth has another number of steps than the log, or more axes.
    """
    places = np.asarray(truth, dtype=np.float64)
    count, axes = len(log.steps), len(log.columns.axes)
    if places.ndim != 3 or len(places) != count or places.shape[2] > axes:
        raise DataError(
            f"truth: has shape {places.shape} for {count} steps of {axes} axes; give (steps, targets, axes)."
        )
    totals = Counter[str]()
    squares = deviation = ospa_sum = gospa_sum = 0.0
    greatest, last = math.nan, dict[int, int]()
    near: Counter[tuple[int, int]] = Counter()
    tracks: set[int] = set()
    codes = [STATUSES.index(status) for status in statuses]
    rows = log.rows
    edges = np.searchsorted(rows["step"], [*range(0, count, STEPS_AT_ONCE), count])
    for number, (start, stop) in enumerate(pairwise(edges)):
        first = number * STEPS_AT_ONCE
        block = places[first : first + STEPS_AT_ONCE]
        part = rows[start:stop]
        part = part[np.isin(part["status"], codes)]
        true = sightings_of(_ring(block, period))
        at = _ring(part["position"][:, : places.shape[2]], period)
        found = sightings(part["step"] - first, part["track"], at.reshape(len(part), true.place.shape[1]))
        mot = clear_mot(true, found, gate, len(block), last)
        last |= {target: track for _, target, track in mot.pairs.tolist()}
        totals.update(
            targets=int(mot.targets.sum()), misses=int(mot.misses.sum()), false=int(mot.false_positives.sum()),
            mismatches=int(mot.mismatches.sum()), pairs=len(mot.deviations), true_rows=len(true.frame),
            track_rows=len(found.frame),
        )  # fmt: skip
        squares += float((mot.deviations**2).sum())
        deviation += float(mot.deviations.sum())
        greatest = float(np.fmax(greatest, mot.max_deviation))
        ospa_sum += float(ospa(true, found, gate, 2.0, len(block)).sum())
        gospa_sum += float(gospa(true, found, gate, 2.0, len(block)).distance.sum())
        near += near_rows(true, found, gate)
        tracks |= set(part["track"].tolist())
    pairs = totals["pairs"]
    return Scores(
        count, totals["targets"], totals["misses"], totals["false"], totals["mismatches"], pairs, squares,
        deviation / pairs if pairs else math.nan, greatest, ospa_sum / max(count, 1), gospa_sum / max(count, 1),
        paired(near, totals["true_rows"], totals["track_rows"]), len(tracks - {track for _, track in near}), gate,
        log.columns.unit,
    )  # fmt: skip


def known_truth(truth: Array | None, start: int, frames: int) -> Array | None:
    """Return the part of a truth, a row a frame of the file, that belongs to the frames of a run.

    Raises
    ------
    DataError
        If the truth has fewer rows than there are frames.
    """
    if truth is not None and len(truth) < start + frames:
        raise DataError(
            f"truth: has {len(truth)} rows for {start + frames} frames; give one row a frame of the file, nan where "
            "a target is absent."
        )
    return None if truth is None else truth[start : start + frames]


def _ring(places: Array, period: float) -> Array:
    """Lay a line whose ends meet out as a circle; other places stay."""
    if math.isinf(period):
        return places
    angle = 2 * math.pi * places / period
    return period / (2 * math.pi) * np.concatenate([np.cos(angle), np.sin(angle)], axis=-1)
