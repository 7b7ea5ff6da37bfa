"""What tracking a sequence of frames came to: its log of tracks, its scores, and what the report says."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri

from elusive.contracts import Array
from elusive.filters import BernoulliFilter, ExistenceParticleFilter
from elusive.filters.particle.recorded import RecordedState
from elusive.preprocess.background import LEVELS
from elusive.report.clock import Clock
from elusive.results import CONFIRMED, DELETED, Scored, TrackLog
from elusive.results.spool import Records
from elusive.sensors import ClutterSensor, ImageSensor
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.peaks import PeakImages
from elusive.systems.images.recurrent import RecurrentImages, SeveralState
from elusive.systems.images.report import Tracked
from elusive.tracking import Step

QUANTILES = tuple(f"whitened_at_{level:g}" for level in LEVELS)  # of the whitened pixels [noise deviations]


class ImageLog(TrackLog):
    """The log of a run: of every frame the probability that anything is there, or the highest score."""

    def __init__(
        self, parameters: ImageTracking, path: Path | None = None, *, hidden: bool = False, live: bool = False
    ) -> None:
        accumulated = isinstance(parameters.filter, RecurrentImages)
        self.several = not isinstance(parameters.filter, BernoulliFilter | ExistenceParticleFilter)
        self.measure = "score" if accumulated else "existence"  # of every frame
        everything = isinstance(parameters.filter, PeakImages)
        bright = ("intensity", "snr_db") if everything or isinstance(parameters.sensor, ImageSensor) else ("intensity",)
        added = ("score",) if accumulated else bright if parameters.has_intensity or everything else ()
        added = (*added, *(("moves", "shown") if everything else ()))
        values = (self.measure, *(QUANTILES if isinstance(parameters.sensor, ClutterSensor) else ()))
        super().__init__(parameters.filter.state_names, "px", added, values, path, live=live)
        # what report, figures and scores are of
        self.shown: ImageLog = self
        if everything and parameters.show == "moving" and not (hidden or live):
            self.shown = ImageLog(parameters, hidden=True)

    def append(self, step: Step, **values: float) -> None:
        """Take in a frame's step with what is known of the frame."""
        state: Any = step.state
        values = {**values, **self.frame_values(step)}
        if isinstance(state, RecordedState | SeveralState) and state.whitener.output is not None:
            values |= zip(QUANTILES, state.whitener.output.quantiles[0].tolist(), strict=True)
        super().append(step, **values)
        if self.shown is not self:
            shown = tuple(track for track in step.tracks if track.extra["shown"] and track.status == "confirmed")
            self.shown.append(step._replace(tracks=shown), **values)

    def frame_values(self, step: Step) -> dict[str, float]:
        """Return the probability that anything is there, or the highest score."""
        return {self.measure: float(getattr(step.state, self.measure))}

    @property
    def whitened(self) -> dict[float, float]:
        """Mean quantile of the whitened pixels, by its probability; nothing where frames were not whitened."""
        found = {}
        for level, name in zip(LEVELS, QUANTILES, strict=True):
            if name in self.step_values and np.isfinite(self.steps[name]).any():
                found[level] = float(np.nanmean(self.steps[name]))
        return found


def tracked_of(
    title: str, log: ImageLog, shape: tuple[int, int], *, timed: bool, truth: Array | None, scores: Scored | None = None
) -> Tracked:
    """Gather what a log shows for the report; ``truth`` is ``(T, targets, 2)`` [px], NaN where a target is absent."""
    followed, log = log, log.shown
    frames = len(log.steps)
    living = log.rows[log.rows["status"] != DELETED]
    measure = np.array(log.steps[log.measure])
    estimate, deviation = np.full((2, frames, 2), np.nan)
    if log.measure == "score":
        measure = np.full(frames, np.nan)
        np.fmax.at(measure, living["step"], living["added"][:, 0])
    if not log.several:
        estimate[living["step"]] = living["position"]
        deviation[living["step"]] = np.sqrt(np.diagonal(living["covariance"], axis1=1, axis2=2))
    return Tracked(
        Path(title).name or title, log.times_s.copy(), "s" if timed else "frame", measure, estimate, deviation,
        None if truth is None else truth[:, 0], shape,
        _table(log, shape, measure, timed=timed) + _besides(followed) + _noise(log) + _scores(scores),
        others=() if truth is None else list(np.moveaxis(truth[:, 1:], 1, 0)),
        tracks=_over_time(log, "position", frames) if log.several else None,
        existences=_over_time(log, "existence", frames) if log.several and log.measure == "existence" else None,
        scored=scores,
    )  # fmt: skip


def _over_time(log: TrackLog, name: str, frames: int) -> dict[int, Array]:
    """Place or existence in each frame of each track that was ever confirmed, NaN where it does not live."""
    found = {}
    for number, rows in log.confirmed().items():
        found[number] = np.full((frames, *rows[name].shape[1:]), np.nan)
        living = rows[rows["status"] != DELETED]
        found[number][living["step"]] = living[name]
    return found


def _table(log: ImageLog, shape: tuple[int, int], measure: Array, *, timed: bool) -> list[tuple[str, str]]:
    frames, sure = len(log.steps), log.rows[log.rows["status"] == CONFIRMED]
    there, sign = (np.isfinite(measure), "a track lives") if log.measure == "score" else (measure > 0.5, "P above .5")
    table = [
        ("Frames", f"{frames}, {shape[1]} x {shape[0]} pixels"),
        ("Is something there?", f"{sign} in {int(there.sum())} of {frames} frames"),
        ("Confirmed tracks", _listed(np.unique(sure["track"]).tolist())),
    ]
    if len(sure):
        first: Records = sure[0]
        when = Clock.of(log.times_s, "s" if timed else "frame").say(float(first["time_s"]))
        x, y = first["position"]
        table.append(("First confirmed", f"{when}, at x {x:.1f}, y {y:.1f}"))
    return table


def _scores(scores: Scored | None) -> list[tuple[str, str]]:
    return [] if scores is None else scores.lines()


def _besides(log: ImageLog) -> list[tuple[str, str]]:
    """Say how much is followed that is not shown, and whether it could be told how far existence holds."""
    if log.shown is log:
        return []
    sure, shown = (set(rows["track"][rows["status"] == CONFIRMED].tolist()) for rows in (log.rows, log.shown.rows))
    said = [
        ("Followed, not shown", f"{len(sure - shown)} confirmed tracks at rest, or hardly told from it (--show all)")
    ]
    existence = log.rows["existence"]
    if len(existence) and not np.isfinite(existence).any():
        said.append(("Existence", "empty: too few tracks, or frames, to tell how often such tracks are there again"))
    return said


def _listed(numbers: Sequence[int], most: int = 12) -> str:
    """Write numbers, and how many there are where they are too many to write."""
    shown = ", ".join(map(str, numbers[:most]))
    return f"{len(numbers)}: {shown}, ..." if len(numbers) > most else shown or "none"


def _noise(log: TrackLog) -> list[tuple[str, str]]:
    """Say how near the whitened pixels come to the Gaussian they should be."""
    if QUANTILES[0] not in log.step_values or not np.isfinite(log.steps[QUANTILES[0]]).any():
        return []
    ends = [0, len(LEVELS) // 2, -1]
    found = [np.nanmean(log.steps[QUANTILES[k]]) for k in ends]
    values = [" / ".join(f"{value:.1f}" for value in row) for row in (found, ndtri(np.array(LEVELS)[ends]))]
    levels = " / ".join(f"{100 * LEVELS[k]:g}" for k in ends)
    return [(f"Whitened pixels at {levels} %", f"{values[0]} (a Gaussian's: {values[1]})")]
