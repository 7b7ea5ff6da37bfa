"""The report of a tracked recording: one HTML file that asks nothing of the network, and one figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.report import plots
from elusive.report.page import facts, picture_url, rounded, write_page

SHOWN_AT_MOST = 240  # frames kept for the report, whatever the recording's length
SIDE_AT_MOST = 320  # pixels a side


class FrameKeeper:
    """Keeps frames for the report evenly from a recording of unknown length, in bounded memory."""

    def __init__(self) -> None:
        self.kept: list[NDArray[np.uint8]] = []
        self.numbers: list[int] = []
        self.stride = 1
        self.shrink = 1

    def offer(self, number: int, pixels: Array) -> None:
        """Keep every ``stride``-th frame; when there are too many, drop every second and double the stride."""
        if number % self.stride:
            return
        self.shrink = max(1, -(-max(pixels.shape) // SIDE_AT_MOST))
        low, high = np.nanpercentile(pixels, [0.5, 99.8])
        grey = np.nan_to_num(255 * (pixels[:: self.shrink, :: self.shrink] - low) / max(high - low, 1e-12))
        self.kept.append(np.clip(grey, 0, 255).astype(np.uint8))
        self.numbers.append(number)
        if len(self.kept) > SHOWN_AT_MOST:
            self.kept, self.numbers, self.stride = self.kept[::2], self.numbers[::2], self.stride * 2


class Tracked(NamedTuple):
    """A tracked recording, as arrays over time."""

    title: str
    times: Array  # (T,)
    time_unit: str  # "s" or "frame"
    existence: Array  # (T,)
    estimate: Array  # (T, 2) pixels, NaN where there is no track
    deviation: Array  # (T, 2) pixels
    truth: Array | None  # (T, 2) pixels, NaN where absent; None where it is not known
    shape: tuple[int, int]  # rows, columns
    rows: Sequence[tuple[str, str]]  # what the table says
    extra: Mapping[str, Array] = {}  # other curves of probability over time, by name
    tracks: Mapping[int, Array] | None = None  # each track's (T, 2) pixels, NaN where it does not live, if several can

    @property
    def error(self) -> Array | None:
        """Distance from estimate to truth, ``(T,)``; of several tracks, that of the nearest."""
        if self.truth is None:
            return None
        if self.tracks:
            apart = np.stack([np.hypot(*(path - self.truth).T) for path in self.tracks.values()])
            return np.asarray(np.fmin.reduce(apart, axis=0))
        return np.asarray(np.hypot(*(self.estimate - self.truth).T))


def write_png(path: Path, tracked: Tracked, frames: FrameKeeper) -> None:
    """Draw the frame of highest existence, the path, existence over time and error over time."""
    panels = 4 if tracked.truth is not None else 3
    with plots.figure(
        path, 10.0, 7.4 if panels == 4 else 3.5, panels // 3 + (panels == 4), 2 if panels == 4 else 3
    ) as (
        figure,
        grid,
    ):
        axes = grid.ravel()
        best = _best_shown(tracked, frames.numbers)
        number = frames.numbers[best]
        when = f"Frame {tracked.times[number]:g}" if tracked.time_unit == "frame" else f"{tracked.times[number]:.2f} s"
        title = f"{when}: P = {tracked.existence[number]:.2f}" if tracked.tracks is None else when
        plots.frame(axes[0], frames.kept[best].astype(float), title, frames.shrink)
        box: Any = {"marker": "s", "markersize": 16, "markerfacecolor": "none", "markeredgewidth": 1.5}
        if tracked.tracks is None:
            axes[0].plot(*tracked.estimate[number], **box, markeredgecolor=plots.ESTIMATE)
            plots.paths(axes[1], tracked.estimate, tracked.truth)
        else:
            for track, places in tracked.tracks.items():
                axes[0].plot(*places[number], **box, markeredgecolor=plots.track_colour(track))
            plots.several_paths(axes[1], tracked.tracks, tracked.truth)
        rows, columns = tracked.shape
        axes[1].set(
            xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5), title="Path" if tracked.tracks is None else "Paths"
        )
        present = None if tracked.truth is None else np.isfinite(tracked.truth[:, 0])
        for colour, (name, curve) in zip(plots.SERIES[1:], tracked.extra.items(), strict=False):
            axes[2].plot(tracked.times, curve, color=colour, label=name, linewidth=1.2)
        label = "P(target is there)" if tracked.tracks is None else "1 - P(so strong a track by chance)"
        plots.existence(axes[2], tracked.times, tracked.existence, present, tracked.time_unit, label)
        axes[2].set_title("Is it there?")
        if panels == 3:
            axes[2].set_box_aspect(min(max(rows / columns, 0.6), 1.0))
        if tracked.error is not None:
            spread = np.hypot(*tracked.deviation.T) if np.isfinite(tracked.deviation).any() else None
            plots.error(axes[3], tracked.times, tracked.error, spread, tracked.time_unit)
            axes[3].set(title="How far off?", xlim=axes[2].get_xlim())
        figure.suptitle(tracked.title, x=0.01, ha="left", size=12, weight="bold")


def write_html(path: Path, tracked: Tracked, frames: FrameKeeper) -> None:
    """Write a page that plays the frames with truth and estimate, beside existence and error over time."""
    truth = None if tracked.truth is None else rounded(tracked.truth)
    data = {
        "times": rounded(tracked.times),
        "unit": tracked.time_unit,
        "existence": rounded(tracked.existence, 4),
        "estimate": rounded(tracked.estimate),
        "deviation": rounded(tracked.deviation),
        "truth": truth,
        "error": None if tracked.error is None else rounded(tracked.error),
        "tracks": None if tracked.tracks is None else [_track(*track) for track in tracked.tracks.items()],
        "extra": {name: rounded(curve, 4) for name, curve in tracked.extra.items()},
        "shown": frames.numbers,
        "shrink": frames.shrink,
        "frame": list(frames.kept[0].shape),
        "strip": _strip(frames.kept),
    }
    write_page(path, "report.html", data, {"title": tracked.title}, table=facts(tracked.rows))


def _best_shown(tracked: Tracked, numbers: Sequence[int]) -> int:
    """Choose among the frames kept that of highest existence; where several tracks can live, of most tracks."""
    worth = tracked.existence
    if tracked.tracks:
        worth = np.sum([np.isfinite(path[:, 0]) for path in tracked.tracks.values()], axis=0)
    return int(np.argmax(np.nan_to_num(np.asarray(worth, dtype=np.float64)[list(numbers)])))


def _track(number: int, path: Array) -> dict[str, object]:
    """Write a track for the page, without the frames before and after its life."""
    alive = np.flatnonzero(np.isfinite(path[:, 0]))
    first, after = (int(alive[0]), int(alive[-1]) + 1) if alive.size else (0, 0)
    places = rounded(path[first:after])
    return {"name": number, "colour": plots.track_colour(number), "first": first, "places": places}


def _strip(frames: Sequence[NDArray[np.uint8]]) -> str:
    """Stack the frames, one under the other, into one grey PNG as a data URL."""
    # several columns, since a browser refuses images taller than some 32 000 pixels
    rows, columns = frames[0].shape
    per_column = max(1, 16_000 // rows)
    count = -(-len(frames) // per_column)
    sheet = np.zeros((min(len(frames), per_column) * rows, count * columns), dtype=np.uint8)
    for number, one in enumerate(frames):
        r, c = number % per_column, number // per_column
        sheet[r * rows : (r + 1) * rows, c * columns : (c + 1) * columns] = one
    return picture_url(sheet)
