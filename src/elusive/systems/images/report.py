"""The report of a tracked recording: one HTML file that asks nothing of the network, and one figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.metrics._assignment import linear_sum_assignment
from elusive.report import drawing as draw
from elusive.report import plots
from elusive.report.clock import Clock
from elusive.report.page import Report
from elusive.report.scored import gospa_chart
from elusive.results import Scored

THERE = 0.5  # existence above which the one target that is looked for is there
NEAR_PX = 4.0  # distance within which a track is at a target
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
    others: Sequence[Array] = ()  # (T, 2) pixels each: where further targets truly are, drawn alone
    tracks: Mapping[int, Array] | None = None  # each track's (T, 2) pixels, NaN where it does not live, if several can
    existences: Mapping[int, Array] | None = None  # each of these tracks' (T,), NaN where it does not live
    scored: Scored | None = None  # None without a truth
    believed: bool = True  # whether what existence assumes holds, as far as it was checked

    @property
    def present(self) -> NDArray[np.bool_] | None:
        """Whether any target is truly there, ``(T,)``; None where it is not known."""
        if self.truth is None:
            return None
        return np.asarray(np.any([np.isfinite(path[:, 0]) for path in (self.truth, *self.others)], axis=0))

    @property
    def question(self) -> str:
        """Title of what shows existence."""
        return "Is it there?" if self.believed else "Is it there? Not to be believed"

    @property
    def error_name(self) -> str:
        """What the error is of."""
        return "error" if self.tracks is None else "RMS error of the targets found"

    @property
    def error(self) -> Array | None:
        """Distance from estimate to truth, ``(T,)``; of several tracks its RMS over targets and the tracks at them."""
        if self.truth is None:
            return None
        if self.tracks is None:
            return np.asarray(np.hypot(*(self.estimate - self.truth).T))
        return paired_error([self.truth, *self.others], list(self.tracks.values()), len(self.times))


def paired_error(truths: Sequence[Array], tracks: Sequence[Array], frames: int) -> Array:
    """RMS distance of targets to the tracks at them, paired one to one within NEAR_PX, ``(T,)``; NaN without a pair.

    Parameters
    ----------
    truths, tracks
        ``(T, 2)`` each [px], NaN where one is not there.
    frames
        T.
    """
    found = np.full(frames, np.nan)
    if not (truths and tracks):
        return found
    for frame, (true, placed) in enumerate(zip(np.stack(truths, axis=1), np.stack(tracks, axis=1), strict=True)):
        there, living = true[np.isfinite(true[:, 0])], placed[np.isfinite(placed[:, 0])]
        apart = np.linalg.norm(there[:, None] - living[None], axis=2)
        paired = apart[linear_sum_assignment(np.minimum(apart, NEAR_PX) ** 2)]
        if (paired < NEAR_PX).any():
            found[frame] = np.sqrt(np.mean(paired[paired < NEAR_PX] ** 2))
    return found


def images_report(tracked: Tracked, frames: FrameKeeper, findings: Sequence[Finding] = ()) -> Report:
    """Return the frames that play with truth and estimate, beside existence and error over time."""
    return Report(tracked.title, verdict(tracked), images_drawing(tracked, frames), tracked.rows, findings)


def verdict(tracked: Tracked) -> str:
    """Say in a sentence what was found, and when."""
    say, found = Clock.of(tracked.times, tracked.time_unit).say, list((tracked.tracks or {}).values())
    lives = np.array([np.isfinite(path[:, 0]) for path in found]).reshape(-1, len(tracked.times)).sum(axis=0)
    if tracked.tracks is None:  # one is looked for
        lives = (np.nan_to_num(tracked.existence) > THERE).astype(np.int64)
    there = tracked.times[lives > 0]
    if not len(there):
        return "No target was found."
    many = "One target was" if max(len(found), 1) == 1 else f"{len(found)} tracks were"
    at_most = f", at most {lives.max()} at a time" if len(found) > 1 else ""
    return f"{many} found, from {say(there[0])} to {say(there[-1])}{at_most}."


def images_drawing(tracked: Tracked, frames: FrameKeeper) -> draw.Drawing:
    """Return what a report draws."""
    times, shown = tracked.times, np.array(frames.numbers)
    grey = {"block": np.stack(frames.kept), "low": 0.0, "high": 255.0}
    played = frame_panel("The frames", grey, tracked, times[shown], frames.shrink, span=6, rows=3)
    return draw.drawing(
        "The frames with the estimate and the truth", times[shown], [played, *curves(tracked)],
        unit="s" if tracked.time_unit == "s" else "frame", start=_best_shown(tracked, frames.numbers),
    )  # fmt: skip


def frame_panel(
    title: str, values: Mapping[str, Any], tracked: Tracked, times: Array, shrink: int,
    more: Sequence[draw.Layer] = (), colours: str = "grey", **panel: Any,
) -> draw.Panel:  # fmt: skip
    """Return frames, bytes ``(T, rows, columns)`` at times, with the truth and the tracks over them."""
    *_, rows, columns = values["block"].shape
    edges = (-0.5, columns * shrink - 0.5, -0.5, rows * shrink - 0.5)
    layers = [draw.image(values, edges, colours, times=draw.rounded(times, 4), down=True), *more]
    return draw.plane(
        title, edges, [*layers, *marks(tracked)], unit="px", axes=("x", "y"), down=True, night=True, bare=True, **panel
    )  # fmt: skip


def marks(tracked: Tracked) -> list[draw.Layer]:
    """Return the truth and the tracks over the frames, a place a frame."""
    layers, found = [], {1: tracked.estimate} if tracked.tracks is None else tracked.tracks
    at = {"times": draw.rounded(tracked.times, 4), "show": "now", "width": 2, "name": "truth"}
    known = () if tracked.truth is None else (tracked.truth, *tracked.others)
    layers += [draw.points(truth, "--truth", marker="ring", size=14, **at) for truth in known]
    for number, places in found.items():
        there = np.isfinite(places[:, 0])
        colour = "--accent" if tracked.tracks is None else plots.track_colour(number)
        one = {"deviation": tracked.deviation[there]} if tracked.tracks is None else {}
        existence = tracked.existence if tracked.tracks is None else (tracked.existences or {}).get(number)
        values = [] if existence is None else [draw.numbers("existence", existence[there], digits=2)]
        layers.append(
            draw.track(
                number, tracked.times[there], places[there], colour, box=True, values=values, **one,
                text="" if tracked.tracks is None else str(number),
            )
        )  # fmt: skip
    return layers


def curves(tracked: Tracked) -> list[draw.Panel]:
    """Return existence and, where the truth is known, the error over time."""
    times, several = tracked.times, tracked.tracks is not None
    there = None
    if tracked.present is not None:
        there = draw.spans(tracked.present, times, "target truly there")
    lines = [
        draw.line(times, curve, colour, 4, width=1.2, name=name)
        for colour, (name, curve) in zip(plots.SERIES[1:], tracked.extra.items(), strict=False)
    ]
    known = tracked.existences
    colour, name = ("--accent", "existence") if known is None else ("--soft", "any target")
    lines.append(draw.line(times, tracked.existence, colour, 4, name=name))
    for track, curve in (known or {}).items():
        lines.append(draw.line(times, curve, plots.track_colour(track), 4, name=f"track {track}"))
    title = "Is it there? 1 - P(so strong a track by chance)" if several and known is None else tracked.question
    panels = [draw.chart(title, times, [there, *lines], axis="probability", reach=(0.0, 1.02))]
    error = tracked.error
    if error is not None and np.isfinite(error).any():
        top = 1.05 * max(0.96, float(np.nanmax(error)))
        far = draw.line(times, error, "--accent", name=tracked.error_name)
        panels.append(draw.chart("How far off?", times, [far], axis="error", unit="px", reach=(0.0, top)))
    if tracked.scored is not None:
        panels.append(gospa_chart(*tracked.scored.series))
    return panels


def _best_shown(tracked: Tracked, numbers: Sequence[int]) -> int:
    """Choose among the frames kept that of highest existence; where several tracks can live, of most tracks."""
    worth = tracked.existence
    if tracked.tracks:
        worth = np.sum([np.isfinite(path[:, 0]) for path in tracked.tracks.values()], axis=0)
    return int(np.argmax(np.nan_to_num(np.asarray(worth, dtype=np.float64)[list(numbers)])))
