"""What tracking a signal came to: its log of tracks, where they were before that, and what the report says."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from elusive.contracts import Array
from elusive.io import SignalSource, Truth
from elusive.report.clock import Clock
from elusive.results import CONFIRMED, Scored, TrackLog, scored
from elusive.results.netcdf import Variable
from elusive.results.spool import Records
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.report import Path1D, SignalTracked, Waterfall
from elusive.systems.signals.summary import apart, header, levels, line_of, verdict
from elusive.systems.signals.track import SignalState
from elusive.tracking import ReadBack, Step

KEPT = (2048, 2048)  # scores kept for result.nc, frames and samples; of more, the largest of each block


STATE, ADDED, OF_FRAMES = ("x", "vx"), ("score", "evidence", "moves", "shown"), ("highest", "threshold")


def log_of(path: Path) -> TrackLog:
    """Return the log of a run that may last."""
    return TrackLog(STATE, "samples", ADDED, OF_FRAMES, path, live=True, keeps=False)


def values_of(state: SignalState) -> dict[str, float]:
    """Return what is logged of every frame: the highest score, and the threshold."""
    highest = math.nan if state.law is None else float(state.score.max())
    return {"highest": highest, "threshold": state.threshold}


class SignalLog(TrackLog):
    """The log of a run, with pictures of the signal and of its evidence, in memory that does not grow with the frames.

    Parameters
    ----------
    source
        Where the frames come from.
    parameters
        What is done, bound to the source.
    path
        Of ``tracks.csv``.
    """

    def __init__(self, source: SignalSource, parameters: SignalTracking, path: Path | None = None) -> None:
        super().__init__(STATE, "samples", ADDED, OF_FRAMES, path)
        self.source, self.parameters = source, parameters
        self.period = source.samples if parameters.filter.border == "circular" else math.inf
        self.signal, self.score = Waterfall("first"), Waterfall("largest")
        self.read_back: dict[int, tuple[int, ReadBack]] = {}  # by track: the step of its confirmation
        self._kept = Waterfall("largest", times=KEPT[0], samples=KEPT[1])

    def take(self, step: Step) -> None:
        """Append a frame's step."""
        state: SignalState = step.state
        number = len(self.steps)
        self.append(step, **values_of(state))
        self.signal.offer(np.abs(state.taken) if np.iscomplexobj(state.taken) else state.taken)
        for kept in (self.score, self._kept):
            kept.offer(state.score)
        self.read_back |= {track: (number, back) for track, back in state.read_back.items()}

    def shown(self) -> TrackLog:
        """Return what report, figures and scores are of: all, or the tracks that move, as their last row has it."""
        if self.parameters.show == "all":
            return self
        last = ADDED.index("shown")
        return self.only([number for number, rows in self.by_track() if rows["added"][-1, last]])

    def evidence_map(self) -> dict[str, Variable]:
        """Return the evidence at every sample over time, of long recordings the largest of each block."""
        cells, times = self._kept.picture(), self.times_s[:: self._kept.stride]
        about = {"long_name": "accumulated evidence in deviations of noise", "units": "1",
                 "frames_a_cell": self._kept.stride, "samples_a_cell": self._kept.shrink}  # fmt: skip
        return {
            "evidence_map": (("map_time", "sample"), cells, about),
            "map_time": (("map_time",), np.array(times), {"units": "s"}),
            "sample": (("sample",), np.arange(cells.shape[1]) * self._kept.shrink, {"units": "1"}),
        }

    def earlier(self) -> dict[int, Array]:
        """Return where tracks were before they were found, ``(k, 2)`` step and x, up to where another track stands."""
        found: dict[int, Array] = {}
        rows, first = self.rows, {number: int(rows["step"][0]) for number, rows in self.by_track()}
        size = self.parameters.object_size
        for number, (step, back) in self.read_back.items():
            begin = step - len(back.positions) + 1
            path: list[tuple[int, float]] = []
            for k in range(first[number] - 1, begin - 1, -1):
                x = float(back.positions[k - begin, 0])
                here = rows[np.searchsorted(rows["step"], k) : np.searchsorted(rows["step"], k, "right")]
                others = [*here["position"][:, 0], *(xs[1] for other in found.values() for xs in other if xs[0] == k)]
                if len(others) and (apart(np.array(others) - x, self.period) <= size).any():
                    break  # it goes on where another track of the same object ended
                path.insert(0, (k, x))
            found[number] = np.array(path).reshape(-1, 2)
        return found


def tracked_of(
    log: SignalLog, truth: Truth | None, cutoff_samples: float | None = None
) -> tuple[SignalTracked, Scored | None]:
    """Gather a log for the report, and score it where the truth is known.

    Raises
    ------
    DataError
        If the truth is of other frames.
    """
    source, parameters, count = log.source, log.parameters, len(log.steps)
    known = None if truth is None else truth.aligned(log.times_s, source.start, whole=source.whole)
    scores = None
    times, unit = log.times_s.copy(), "s" if source.timed else "frame"
    clock = Clock.of(times, unit)
    highest, threshold = (np.array(log.steps[name]) for name in ("highest", "threshold"))
    shown = log.shown()
    sure, followed = shown.confirmed(), log.confirmed()
    resting = len(followed) - len(sure)
    earlier = log.earlier()
    lines = [line_of(number, rows, earlier.get(number), times, clock, log.period) for number, rows in sure.items()]
    rate = f", {1 / parameters.interval_s:g} a second" if source.timed else ""
    table = [
        ("Frames", f"{count} of {source.samples} samples{rate}"),
        *parameters.described,
        ("Threshold", levels(threshold)),
        ("Frames with an alarm", f"{int(np.sum(highest > threshold))}"),
        ("Candidates never confirmed", f"{len(log.by_track().numbers) - len(followed)}"),
    ]
    if shown is not log:
        table.append(("Followed, not shown", f"{resting} confirmed tracks at rest (--show all)"))
    if known is not None:
        scores = scored(shown, known, parameters.object_size if cutoff_samples is None else cutoff_samples, log.period)
        table += scores.lines()
    tracked = SignalTracked(
        Path(source.name).name or source.name, verdict(lines, clock, resting), times, unit, source.samples,
        highest, threshold,
        [_path(number, rows, earlier.get(number)) for number, rows in sure.items()],
        None if known is None else known[:, :, 0], table, header(clock), lines, scores,
    )  # fmt: skip
    return tracked, scores


def _path(number: int, rows: Records, earlier: Array | None) -> Path1D:
    before = np.empty((0, 2)) if earlier is None else earlier
    return Path1D(
        number,
        np.concatenate([before[:, 0].astype(np.int64), rows["step"]]),
        np.concatenate([before[:, 1], rows["position"][:, 0]]),
        np.concatenate([np.zeros(len(before), bool), rows["status"] == CONFIRMED]),
    )
