"""The report of a tracked signal: one HTML file that asks nothing of the network, and one figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.report import drawing as draw
from elusive.report.page import Report, track_table
from elusive.report.scored import gospa_chart
from elusive.results import Scored

TIMES_SHOWN = 1000  # columns of a picture at most
SAMPLES_SHOWN = 400  # rows of a picture at most
NOTE = "By chance: how probable it is that noise alone raises so high a score in a frame."


class Waterfall:
    """Keeps a signal over time in bounded memory, whatever its length: ``(columns, rows)``, a block to a cell.

    A cell is the largest of its block's values, or, kind ``first``, the first of them. When there are too many
    columns, pairs of them are merged.
    """

    def __init__(
        self, kind: Literal["largest", "first"], *, times: int = TIMES_SHOWN, samples: int = SAMPLES_SHOWN
    ) -> None:
        self.kind = kind
        self.stride = 1  # frames a column
        self.shrink = 1  # samples a row
        self._most = (max(2, times), samples)
        self._columns: list[NDArray[np.float32]] = []
        self._frames = 0

    def offer(self, values: NDArray[np.floating[Any]]) -> None:
        """Take one frame's values ``(n,)``."""
        if not self._columns:
            self.shrink = -(-values.size // self._most[1])
        starts = np.arange(0, values.size, self.shrink)
        rows = values[starts] if self.kind == "first" else np.maximum.reduceat(values, starts)
        column = rows.astype(np.float32)
        if self._frames % self.stride == 0:
            if len(self._columns) == self._most[0]:
                self._halve()
            if self._frames % self.stride == 0:
                self._columns.append(column)
        elif self.kind == "largest":
            np.maximum(self._columns[-1], column, out=self._columns[-1])
        self._frames += 1

    def _halve(self) -> None:
        pairs = zip(self._columns[::2], self._columns[1::2], strict=False)
        merged = [first if self.kind == "first" else np.maximum(first, second) for first, second in pairs]
        self._columns = merged + self._columns[2 * len(merged) :]
        self.stride *= 2

    def picture(self) -> NDArray[np.float32]:
        """Return the cells, ``(columns, rows)``."""
        return np.stack(self._columns)


class Path1D(NamedTuple):
    """A track along a signal."""

    track: int
    frames: NDArray[np.int64]  # (k,) numbers of the frames of the run
    x: Array  # (k,) samples
    sure: NDArray[np.bool_]  # (k,) whether it was confirmed by then; else a candidate, or read back


class SignalTracked(NamedTuple):
    """A tracked signal, as arrays over time."""

    title: str
    verdict: str
    times: Array  # (T,)
    time_unit: str  # "s" or "frame"
    samples: int  # of a frame
    highest: Array  # (T,) highest score of each frame, NaN where there is none yet
    threshold: Array  # (T,) score above which there is an alarm, NaN where there is none yet
    paths: Sequence[Path1D]
    truth: Array | None  # (T, objects) samples, NaN where absent; None where it is not known
    rows: Sequence[tuple[str, str]]  # what the table about the run says
    header: Sequence[str]  # of the table of tracks
    tracks: Sequence[Sequence[str]]  # its lines
    scored: Scored | None = None  # None without a truth


def signal_report(
    tracked: SignalTracked, signal: Waterfall, score: Waterfall, findings: Sequence[Finding] = ()
) -> Report:
    """Return the scores and the tracks, the highest score and the signal, one above the other."""
    table = track_table(tracked.header, tracked.tracks, {str(one.track) for one in tracked.paths})
    drawn = _drawing(tracked, signal, score)
    return Report(tracked.title, tracked.verdict, drawn, tracked.rows, findings, table, NOTE)


def _drawing(tracked: SignalTracked, signal: Waterfall, score: Waterfall) -> draw.Drawing:
    """Return what a report draws; a column of a picture holds as many frames as it merged."""
    starts = np.arange(0, len(tracked.times), score.stride)
    truth = _truth(tracked)
    top = _score_scale(tracked)
    found = _waterfall(
        "Accumulated evidence: the highest score over the velocities", tracked, score, (0.0, top), "score"
    )
    found["layers"] += [*truth, *(_drawn(one, tracked) for one in tracked.paths)]
    seen = _waterfall("Signal, as the filter takes it", tracked, signal, _grey_scale(signal), "grey")
    worth = None if tracked.scored is None else gospa_chart(*tracked.scored.series, span=12)
    panels = [found, _highest(tracked, starts, score.stride), worth, seen]
    return draw.drawing(
        "Signal, accumulated evidence and tracks over time", tracked.times[starts], panels,
        unit="s" if tracked.time_unit == "s" else "frame",
        start=len(starts) - 1,
    )  # fmt: skip


def _waterfall(
    title: str, tracked: SignalTracked, kept: Waterfall, scale: tuple[float, float], colours: str
) -> draw.Panel:  # fmt: skip
    """Return cells over time and place; what is later than the time shown is still to come where it plays."""
    cells = kept.picture()
    step = float(np.median(np.diff(tracked.times))) if len(tracked.times) > 1 else 1.0
    first = float(tracked.times[0]) - step / 2
    ends = first, first + step * len(cells) * kept.stride
    values = draw.scaled(cells.T.astype(np.float64), *scale)
    edges = (*ends, -0.5, cells.shape[1] * kept.shrink - 0.5)
    layers = [draw.image(values, edges, colours, unit="deviations" if colours == "score" else "")]
    panel = draw.chart(title, tracked.times, layers, axis="x", unit="sample", reach=(-0.5, tracked.samples - 0.5))
    panel["y"]["group"] = "samples"
    last = float(tracked.times[-1]) + step / 2
    return panel | {
        "extent": [first, last, *panel["extent"][2:]],
        "span": 12,
        "height": 320,
        "night": True,
        "bare": True,
    }


def _truth(tracked: SignalTracked) -> list[draw.Layer]:
    if tracked.truth is None:
        return []
    style: Any = {"width": 4, "alpha": 0.5, "name": "truth"}
    places = [_broken_at_ends(x, tracked.samples) for x in tracked.truth.T]
    return [draw.line(tracked.times, x, "--truth", **style) for x in places]


def _drawn(path: Path1D, tracked: SignalTracked) -> draw.Layer:
    """Return a track over time and place, broken where it leaves the ring at one end."""
    x = _broken_at_ends(path.x, tracked.samples)
    times = tracked.times[path.frames]
    return draw.track(
        path.track, times, np.column_stack([np.where(np.isfinite(x), times, np.nan), x]), "--accent",
        sure=path.sure, values=[draw.numbers("at sample", path.x)],
    )  # fmt: skip


def _highest(tracked: SignalTracked, starts: NDArray[np.int64], stride: int) -> draw.Panel:
    times, ends = tracked.times[starts], np.minimum(starts + stride, len(tracked.times)) - 1
    highest, threshold = np.fmax.reduceat(tracked.highest, starts), tracked.threshold[ends]
    there = None
    if tracked.truth is not None:
        there = draw.spans(np.asarray(np.isfinite(tracked.truth).any(axis=1)), tracked.times, "object truly there")
    lines = [
        draw.line(times, threshold, "--soft", dash=[5, 4], width=1.5, name="threshold"),
        draw.line(times, highest, "--mark", name="highest score"),
    ]
    known = np.concatenate([[1.0], highest[np.isfinite(highest)], threshold[np.isfinite(threshold)]])
    top = 1.08 * float(known.max())
    unit = "deviations of noise"
    layers = [there, *lines]
    return draw.chart("Is something there?", tracked.times, layers, axis="score", unit=unit, reach=(0.0, top), span=12)


def _broken_at_ends(x: Array, samples: int) -> Array:
    """Return places with NaN where a path leaves the ring at one end to come back at the other."""
    found: Array = np.array(x, dtype=np.float64)
    found[1:][np.abs(np.diff(x)) > samples / 2] = np.nan
    return found


def _score_scale(tracked: SignalTracked) -> float:
    """Score that is drawn brightest: noise stays dark, and a strong object does not hide a weak one."""
    if not np.isfinite(tracked.threshold).any():
        return 1.0
    threshold, highest = float(np.nanmedian(tracked.threshold)), float(np.nanmax(tracked.highest))
    return max(1.5 * threshold, min(highest, 3.0 * threshold))


def _grey_scale(signal: Waterfall) -> tuple[float, float]:
    low, high = np.percentile(signal.picture(), [0.5, 99.5])
    return float(low), float(high)
