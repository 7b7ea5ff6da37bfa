"""What tracking a signal came to: a result a frame, the tracks over time, their table and what the report says."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.accumulate.false_alarm import ExtremeValue
from elusive.io import SignalSource, SignalTrackRow, write_netcdf, write_signal_tracks_csv
from elusive.systems.signals.report import Path1D, SignalTracked, Waterfall, write_signal_html, write_signal_png
from elusive.systems.signals.summary import Point, apart, header, levels, line_of, scored, verdict
from elusive.tracking import PeakTrack, ReadBack

KEPT = (2048, 2048)  # scores kept for result.nc, frames and samples; of more, the largest of each block


class SignalResult(NamedTuple):
    """What is known after a frame."""

    taken: Array  # (n,) the samples as the filter takes them
    score: NDArray[np.floating[Any]]  # (n,) accumulated evidence, in deviations of noise's; 0 in calibration frames
    threshold: float  # NaN in calibration frames
    law: ExtremeValue | None  # of the highest score of noise; None in calibration frames
    tracks: tuple[PeakTrack, ...]
    read_back: Mapping[int, ReadBack]  # of tracks confirmed in this frame: where they were before, by their number


class SignalOutcome(NamedTuple):
    """What a tracked signal came to."""

    rows: list[SignalTrackRow]
    tracked: SignalTracked


class SignalRun:
    """Gathers results over a recording in memory that grows with the tracks, not with the frames' samples."""

    def __init__(self, source: SignalSource, ring: bool, object_size: int) -> None:
        self.times: list[float] = []  # may run ahead of the results
        self._source = source
        self._period = source.samples if ring else math.inf
        self._size = object_size
        self._highest: list[float] = []
        self._threshold: list[float] = []
        self._tracks: dict[int, list[Point]] = {}
        self._sure: dict[int, float] = {}  # probability that noise alone reaches the track's highest score
        self._signal = Waterfall("first")
        self._score = Waterfall("largest")
        self._kept = Waterfall("largest", times=KEPT[0], samples=KEPT[1])

    def offer(self, result: SignalResult) -> None:
        """Take in one more frame's result."""
        frame = len(self._highest)
        self._highest.append(math.nan if result.law is None else float(result.score.max()))
        self._threshold.append(result.threshold)
        self._signal.offer(result.taken)
        for kept in (self._score, self._kept):
            kept.offer(result.score)
        for track in result.tracks:
            (x,), (vx,) = track.position, track.velocity
            points = self._tracks.setdefault(track.track, [])
            points.append(Point(frame, track.status, track.score, x, vx))
            if result.law is not None:
                chance = result.law.probability(track.score)
                self._sure[track.track] = min(chance, self._sure.get(track.track, 1.0))
        for number, back in result.read_back.items():
            points, first = self._tracks[number], frame - len(back.positions) + 1
            for k in range(points[0].frame - 1, first - 1, -1):
                x = float(back.positions[k - first, 0])
                if self._taken(number, k, x):
                    break  # it goes on where another track of the same object ended
                points.insert(0, Point(k, "read-back", math.nan, x, points[0].vx))

    def _taken(self, number: int, frame: int, x: float) -> bool:
        """Whether another track stands at a place in a frame."""
        return any(
            apart(np.array(point.x - x), self._period) <= self._size
            for other, points in self._tracks.items()
            if other != number and points[0].frame <= frame <= points[-1].frame
            for point in points[frame - points[0].frame :][:1]
        )

    def outcome(self, described: Sequence[tuple[str, str]], truth: Array | None) -> SignalOutcome:
        """Return the table and what the report shows.

        Raises
        ------
        DataError
            If the truth has fewer rows than the recording has frames.
        """
        source, count = self._source, len(self._highest)
        known = None
        if truth is not None:
            after = source.start + count
            if len(truth) < after:
                raise DataError(
                    f"truth: has {len(truth)} rows for {after} frames; give one a frame of the file, nan if absent."
                )
            known = truth[source.start : after]
        times = np.array(self.times[:count])
        unit = "s" if source.timed else "frame"
        rate = source.rate_hz
        if rate is None:
            rate = (count - 1) / (times[-1] - times[0]) if source.timed else 1.0
        rows = list(self._rows(times, rate))
        confirmed = {n: points for n, points in self._tracks.items() if any(p.status == "confirmed" for p in points)}
        lines = [
            line_of(number, points, self._sure.get(number, 1.0), times, unit, rate, self._period)
            for number, points in confirmed.items()
        ]
        paths = [
            Path1D(
                number,
                np.array([point.frame for point in points]),
                np.array([point.x for point in points]),
                np.array([point.status == "confirmed" for point in points]),
            )
            for number, points in confirmed.items()
        ]
        table = [
            ("Frames", f"{count} of {source.samples} samples" + (f", {rate:g} a second" if unit == "s" else "")),
            *described,
            ("Threshold", levels(self._threshold)),
            ("Frames with an alarm", f"{int(np.sum(np.array(self._highest) > np.array(self._threshold)))}"),
            ("Candidates never confirmed", f"{len(self._tracks) - len(paths)}"),
        ]
        if known is not None:
            table += scored(list(confirmed.values()), known, self._size, self._period)
        tracked = SignalTracked(
            Path(source.name).name or source.name, verdict(lines, unit), times, unit, source.samples,
            np.array(self._highest), np.array(self._threshold), paths, known, table, header(unit), lines,
        )  # fmt: skip
        return SignalOutcome(rows, tracked)

    def write(self, folder: Path, outcome: SignalOutcome, config: str) -> None:
        """Write everything into a folder."""
        import xarray as xr

        tracked = outcome.tracked
        write_signal_tracks_csv(folder / "tracks.csv", outcome.rows)
        kept = self._kept
        cells = kept.picture()
        about = {"units": "deviations of noise", "frames_a_cell": kept.stride, "samples_a_cell": kept.shrink}
        dataset = xr.Dataset(
            {
                "score": (("time_of_score", "sample"), cells, about),
                "highest_score": ("time", tracked.highest, {"units": "deviations of noise"}),
                "threshold": ("time", tracked.threshold, {"units": "deviations of noise"}),
            },
            coords={
                "time": ("time", tracked.times, {"units": "s" if tracked.time_unit == "s" else "1"}),
                "time_of_score": tracked.times[:: kept.stride],
                "sample": np.arange(cells.shape[1]) * kept.shrink,
            },
            attrs={"title": self._source.name, "config": config},
        )
        write_netcdf(folder / "result.nc", dataset)
        (folder / "config.yaml").write_text(config, encoding="utf-8")
        write_signal_png(folder / "report.png", tracked, self._signal, self._score)
        write_signal_html(folder / "report.html", tracked, self._signal, self._score)

    def _rows(self, times: Array, rate: float) -> Iterator[SignalTrackRow]:
        """Yield the table, frame by frame; a frame without a track has one row, with its highest score."""
        by_frame: dict[int, list[SignalTrackRow]] = {}
        for number, points in sorted(self._tracks.items()):
            for point in points:
                row = SignalTrackRow(times[point.frame], number, point.status, point.score, point.x, rate * point.vx)
                by_frame.setdefault(point.frame, []).append(row)
        for frame, highest in enumerate(self._highest):
            yield from by_frame.get(frame, [SignalTrackRow(times[frame], None, "none", highest)])
