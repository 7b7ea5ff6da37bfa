"""What the report of a signal says in words and numbers: a line a track, a sentence, and scores against a truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array

CHANCE_SHOWN = 1e-12  # smaller probabilities are not told apart


class Point(NamedTuple):
    """A track in one frame."""

    frame: int  # of the run, from 0
    status: str
    score: float
    x: float  # samples
    vx: float  # samples a frame


def apart(way: Array, period: float) -> Array:
    """Return lengths of ways, the shorter round a ring of this period; infinity where the ends do not meet."""
    length = np.abs(way)
    return np.minimum(length, period - length)


def header(unit: str) -> tuple[str, ...]:
    """Return the names of the columns of :func:`line_of`; ``unit`` is ``s`` or ``frame``."""
    times = (f"{name} [{unit}]" for name in ("Since", "Sure", "Until"))
    return ("Track", *times, "From [sample]", "To [sample]", f"Velocity [samples/{unit}]", "Highest score", "By chance")


def line_of(
    number: int, points: Sequence[Point], chance: float, times: Array, unit: str, rate: float, period: float
) -> tuple[str, ...]:
    """Return a track's line of the table: since when, until when, where, how fast, how sure.

    Parameters
    ----------
    number
        Of the track.
    points
        The track, confirmed at some time.
    chance
        Probability that noise alone reaches its highest score in a frame.
    times
        Of the frames.
    unit
        Of the times, ``s`` or ``frame``.
    rate
        Frames in one of them.
    period
        Of the ring, in samples; infinity where the signal's ends do not meet.
    """
    alive = [point for point in points if point.status != "deleted"]
    sure = next(point for point in points if point.status == "confirmed")
    x = np.array([point.x for point in alive])
    if math.isfinite(period):
        x = np.unwrap(x, period=period)
    speed = np.polyfit([point.frame for point in alive], x, 1)[0] if len(alive) > 1 else alive[0].vx
    return (
        str(number),
        _time(times[alive[0].frame], unit),
        _time(times[sure.frame], unit),
        _time(times[points[-1].frame], unit) if points[-1].status == "deleted" else "the end",
        f"{alive[0].x:.1f}",
        f"{alive[-1].x:.1f}",
        f"{round(rate * speed, 2) + 0.0:+.2f}",
        f"{np.nanmax([point.score for point in points]):.1f}",
        f"< {CHANCE_SHOWN:.0e}" if chance < CHANCE_SHOWN else f"{chance:.0e}",
    )


def verdict(lines: Sequence[Sequence[str]], unit: str) -> str:
    """Say in a sentence what was found."""
    if not lines:
        return "Nothing was found: nothing exceeded what noise does for long enough."
    if len(lines) > 1:
        return f"{len(lines)} tracks were found."
    _, since, _, until, start, _, speed, *_ = lines[0]
    time = f"frame {since}" if unit == "frame" else f"{since} s"
    end = f"to {until}{' s' if unit == 's' and until != 'the end' else ''}"
    per = "second" if unit == "s" else "frame"
    return f"One object was found: from {time} {end}, beginning at sample {start}, moving {speed} samples a {per}."


def levels(thresholds: Sequence[float]) -> str:
    """Say where the threshold stood."""
    known = [level for level in thresholds if not math.isnan(level)]
    if max(known) - min(known) < 0.005:
        return f"score {known[0]:.2f}"
    return f"score {known[0]:.2f} at first, {known[-1]:.2f} at last"


def scored(tracks: Sequence[Sequence[Point]], truth: Array, near: float, period: float) -> list[tuple[str, str]]:
    """Compare tracks, where they are confirmed, with the truth ``(T, objects)``, frame by frame.

    ``near`` is how far from an object a track may be to have found it [samples].
    """
    present = np.isfinite(truth)
    off = np.full(truth.shape, np.inf)
    astray = 0
    for points in tracks:
        sure = [point for point in points if point.status == "confirmed"]
        frames = np.array([point.frame for point in sure])
        way = apart(np.array([point.x for point in sure])[:, None] - truth[frames], period)
        way = np.where(present[frames], way, np.inf)
        off[frames] = np.minimum(off[frames], way)
        astray += not (way <= near).any()
    found = present & (off <= near)
    table = [("Confirmed tracks that never met an object", f"{astray}")]
    if present.any():
        share = f"{100 * found.sum() / present.sum():.0f} % of their frames"
        table.append((f"Objects found within {near:g} samples", share))
    if found.any():
        table.append(("Error there, RMS", f"{np.sqrt(np.mean(off[found] ** 2)):.2f} samples"))
    return table


def _time(time: float, unit: str) -> str:
    return f"{time:g}" if unit == "frame" else f"{time:.2f}"
