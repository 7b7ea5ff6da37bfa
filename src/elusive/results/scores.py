"""Scores of a log's tracks against where targets truly were, the same for every system.

CLEAR MOT (Bernardin and Stiefelhagen, 2008), IDF1 (Ristani et al., 2016), OSPA (Schuhmacher, Vo and Vo, 2008), GOSPA
(Rahmathullah, Garcia-Fernandez and Svensson, 2017; alpha = 2) and NEES (Bar-Shalom, Li and Kirubarajan, 2001, eq.
5.4.2-2). Steps are scored some at a time, so that a recording of any length is: what is kept is counts, a number for
each pair of a target and a track that were near each other, and GOSPA at each step.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Collection
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.csv_files import write_csv
from elusive.metrics import ClearMot, Gospa, Identity, clear_mot, gospa, ospa, sightings, sightings_of
from elusive.metrics.consistency import squared_deviations
from elusive.metrics.identity_scores import near_rows, paired
from elusive.results.log import TrackLog
from elusive.results.spool import Records
from elusive.results.table import STATUSES
from elusive.tracking.track import Status

STEPS_AT_ONCE = 1024
ORDER = 2.0  # p of GOSPA and OSPA
FILES = ("scores.json", "scores.csv")
CONFIRMED: tuple[Status, ...] = ("confirmed",)
PARTS = ("localisation", "missed", "false")


class Scores(NamedTuple):
    """What the tracks are worth over a recording; distances are in the log's unit."""

    targets: int  # true targets, summed over the steps
    misses: int
    false: int
    mismatches: int  # identity switches
    motp: float  # mean deviation of the pairs; NaN without a pair
    rmse: float  # root mean square of them
    greatest: float  # of them
    ospa: float  # mean over the steps
    gospa: Gospa  # of each step (T,)
    identity: Identity
    nees: float  # of the pairs, mean; NaN where no covariance is known
    held: float  # share of the pairs whose truth is in the track's 95 % ellipse; NaN likewise
    strays: int  # tracks that never were within the cutoff of a target
    cutoff: float  # distance from which a track stands for no target, and c of OSPA and GOSPA
    axes: int
    unit: str

    @property
    def mota(self) -> float:
        """Multiple object tracking accuracy; NaN without a true target."""
        return 1 - (self.misses + self.false + self.mismatches) / self.targets if self.targets else math.nan

    @property
    def found(self) -> float:
        """Share of the targets' times at which a track stands for them; NaN without a true target."""
        return 1 - self.misses / self.targets if self.targets else math.nan

    @property
    def mean_gospa(self) -> float:
        """Mean over the steps."""
        return float(self.gospa.distance.mean()) if len(self.gospa.distance) else math.nan

    @property
    def rms_gospa(self) -> dict[str, float]:
        """Root mean square over the steps, and of its parts, whose squares add up to its own."""
        names = ("gospa", *PARTS)
        squares = (self.gospa.distance**ORDER, *self.gospa[1:])
        return {
            name: math.sqrt(values.mean()) if len(values) else math.nan
            for name, values in zip(names, squares, strict=True)
        }

    def lines(self) -> list[tuple[str, str]]:
        """Return what a table about the run says."""
        found = f"{100 * self.found:.0f} % of their times" if self.targets else "no target is there"
        off = (
            f"{self.rmse:.2f} {self.unit} RMS, {self.greatest:.2f} greatest"
            if math.isfinite(self.rmse)
            else "no target is found"
        )
        whole, *parts = self.rms_gospa.values()
        wrong = f"{self.misses} misses, {self.false} false, {self.mismatches} mismatches of {self.targets}"
        made = ", ".join(f"{name} {value:.2f}" for name, value in zip(PARTS, parts, strict=True))
        rows = [
            (f"Targets found within {self.cutoff:.3g} {self.unit}", found),
            ("Error there", off),
            ("MOTA", f"{self.mota:.3f}: {wrong}"),
            ("IDF1", f"{self.identity.idf1:.3f}"),
            (
                f"GOSPA (c {self.cutoff:.3g} {self.unit}, p {ORDER:g})",
                f"{self.mean_gospa:.2f} on average; RMS {whole:.2f}: {made}",
            ),
            ("Tracks that never met a target", str(self.strays)),
        ]
        if math.isfinite(self.nees):
            said = (
                f"{self.nees:.2f}, {self.axes} if the deviations are right; {100 * self.held:.0f} % in the 95 % ellipse"
            )
            rows.append(("NEES", said))
        return rows

    @property
    def numbers(self) -> dict[str, float]:
        """All by name."""
        return {
            "found": self.found, "mota": self.mota, "motp": self.motp, "idf1": self.identity.idf1, "rmse": self.rmse,
            "greatest": self.greatest, "targets": self.targets, "misses": self.misses, "false": self.false,
            "mismatches": self.mismatches, "strays": self.strays, "ospa": self.ospa, "gospa": self.mean_gospa,
            **{f"rms_{name}": value for name, value in self.rms_gospa.items()}, "nees": self.nees,
            "in_95_ellipse": self.held,
        }  # fmt: skip


class Scored(NamedTuple):
    """The scores of a run."""

    times_s: Array  # (T,)
    confirmed: Scores
    candidates_too: Scores

    def lines(self) -> list[tuple[str, str]]:
        """Return what a table about the run says."""
        more = self.candidates_too
        said = f"MOTA {more.mota:.3f}, IDF1 {more.identity.idf1:.3f}, GOSPA {more.mean_gospa:.2f} {more.unit}"
        return [*self.confirmed.lines(), ("With candidates", said)]

    @property
    def series(self) -> tuple[Array, Gospa, float, str]:
        """What is drawn over time: times, GOSPA of confirmed tracks, its c and unit."""
        return self.times_s, self.confirmed.gospa, self.confirmed.cutoff, self.confirmed.unit

    @property
    def text(self) -> str:
        """All as JSON; null where there is no number."""
        one = self.confirmed
        about = {"unit": one.unit, "cutoff": one.cutoff, "order": ORDER}
        tables = {"confirmed": one.numbers, "with_candidates": self.candidates_too.numbers}
        known = {
            name: {key: value if math.isfinite(value) else None for key, value in numbers.items()}
            for name, numbers in tables.items()
        }
        return json.dumps(about | known, indent=1) + "\n"

    def write(self, folder: Path) -> None:
        """Write FILES: all scores, and the confirmed tracks' GOSPA at each step with its parts (to the power p)."""
        (folder / FILES[0]).write_text(self.text, encoding="utf-8")
        columns = np.column_stack([self.times_s, *self.confirmed.gospa])
        write_csv(folder / FILES[1], ("time_s", "gospa", *PARTS), columns.tolist())


def scored(log: TrackLog, truth: ArrayLike, cutoff: float, period: float = math.inf) -> Scored:
    """Score a log's confirmed tracks, and its candidates with them; arguments and errors as of :func:`score`."""
    return Scored(
        log.times_s.copy(), score(log, truth, cutoff, CONFIRMED, period),
        score(log, truth, cutoff, (*CONFIRMED, "candidate"), period),
    )  # fmt: skip


def score(
    log: TrackLog,
    truth: ArrayLike,
    cutoff: float,
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
    cutoff
        Distance up to which a track can stand for a target, and c of OSPA and GOSPA.
    statuses
        Of the tracks that count.
    period
        Of a line whose ends meet. Distances are then chords of a circle, a fraction ``(cutoff / period)^2`` shorter.

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
    axes = places.shape[2]
    totals = Counter[str]()
    ospa_sum, last = 0.0, dict[int, int]()
    parts = [Gospa(*np.zeros((4, 0)))]
    apart: list[Array] = []
    squared: list[Array] = []
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
        at = _ring(part["position"][:, :axes], period)
        found = sightings(part["step"] - first, part["track"], at.reshape(len(part), true.place.shape[1]))
        mot = clear_mot(true, found, cutoff, len(block), last)
        last |= {target: track for _, target, track in mot.pairs.tolist()}
        totals.update(
            targets=int(mot.targets.sum()), misses=int(mot.misses.sum()), false=int(mot.false_positives.sum()),
            mismatches=int(mot.mismatches.sum()), true_rows=len(true.frame), track_rows=len(found.frame),
        )  # fmt: skip
        apart.append(mot.deviations)
        squared.append(_squared_deviations(mot, block, part, first, period))
        ospa_sum += float(ospa(true, found, cutoff, ORDER, len(block)).sum())
        parts.append(gospa(true, found, cutoff, ORDER, len(block)))
        near += near_rows(true, found, cutoff)
        tracks |= set(part["track"].tolist())
    off, nees = (np.concatenate([np.zeros(0), *pieces]) for pieces in (apart, squared))
    nees = nees[np.isfinite(nees)]
    motp, rmse, greatest = (off.mean(), math.sqrt(np.mean(off**2)), off.max()) if len(off) else (math.nan,) * 3
    return Scores(
        totals["targets"], totals["misses"], totals["false"], totals["mismatches"], float(motp), rmse, float(greatest),
        ospa_sum / max(count, 1), Gospa(*map(np.concatenate, zip(*parts, strict=True))),
        paired(near, totals["true_rows"], totals["track_rows"]), float(nees.mean()) if len(nees) else math.nan,
        float(np.mean(nees <= chdtri(axes, 0.05))) if len(nees) else math.nan,
        len(tracks - {track for _, track in near}), cutoff, axes, log.columns.unit,
    )  # fmt: skip


def _squared_deviations(mot: ClearMot, truth: Array, rows: Records, first: int, period: float) -> Array:
    """Squared error of each pair in deviations of its covariance, ``(M,)``; NaN where that is not known."""
    frame, target, track = mot.pairs.T
    span = int(rows["track"].max(initial=0)) + 1
    keys = (rows["step"] - first) * span + rows["track"]
    order = np.argsort(keys)
    pair = rows[order[np.searchsorted(keys, frame * span + track, sorter=order)]]
    axes = truth.shape[2]
    off = pair["position"][:, :axes] - truth[frame, target]
    if math.isfinite(period):
        off = (off + period / 2) % period - period / 2
    covariance = pair["covariance"][:, :axes, :axes]
    found = np.full(len(frame), np.nan)
    known = np.isfinite(covariance).all(axis=(1, 2))
    powers = np.linalg.eigvalsh(covariance[known])
    known[known] = powers[:, 0] > np.finfo(np.float64).eps * powers[:, -1]
    found[known] = squared_deviations(off[known], covariance[known])
    return found


def _ring(places: Array, period: float) -> Array:
    """Lay a line whose ends meet out as a circle; other places stay."""
    if math.isinf(period):
        return places
    angle = 2 * math.pi * places / period
    return period / (2 * math.pi) * np.concatenate([np.cos(angle), np.sin(angle)], axis=-1)
