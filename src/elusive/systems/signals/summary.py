"""What the report of a signal says in words and numbers: a line a track, and a sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.contracts import Array
from elusive.report.clock import Clock
from elusive.results import CONFIRMED, DELETED
from elusive.results.spool import Records

CHANCE_SHOWN = 1e-12  # smaller probabilities are not told apart


def apart(way: Array, period: float) -> Array:
    """Return lengths of ways, the shorter round a ring of this period; infinity where the ends do not meet."""
    length = np.abs(way)
    return np.minimum(length, period - length)


def header(clock: Clock) -> tuple[str, ...]:
    """Return the names of the columns of :func:`line_of`."""
    speed = f"Velocity [samples/{'frame' if clock.kind == 'frame' else 's'}]"
    return (
        "Track",
        *clock.heads("Since", "Sure", "Until"),
        "From [sample]",
        "To [sample]",
        speed,
        "Highest score",
        "By chance",
    )


def line_of(
    number: int, rows: Records, earlier: Array | None, times: Array, clock: Clock, period: float
) -> tuple[str, ...]:
    """Return a track's line of the table: since when, until when, where, how fast, how sure.

    Parameters
    ----------
    number
        Of the track.
    rows
        Of the track, confirmed at some time; what is added is score and evidence.
    earlier
        Step and place before it was found, ``(k, 2)``; None where it was not read back.
    times
        Of the steps.
    clock
        That says the times.
    period
        Of the ring, in samples; infinity where the signal's ends do not meet.
    """
    before = np.empty((0, 2)) if earlier is None else earlier
    alive = rows[rows["status"] != DELETED]
    x = np.concatenate([before[:, 1], alive["position"][:, 0]])
    when = np.concatenate([times[before[:, 0].astype(int)], alive["time_s"]])
    if math.isfinite(period):
        x = np.unwrap(x, period=period)
    speed = np.polyfit(when, x, 1)[0] if len(x) > 1 else alive["velocity"][0, 0]
    chance = 1 - np.nanmax(rows["added"][:, 0])
    ended = rows["status"][-1] == DELETED or rows["time_s"][-1] < times[-1]  # or it rests from then on
    return (
        str(number),
        clock.bare(when[0]),
        clock.bare(rows["time_s"][rows["status"] == CONFIRMED][0]),
        clock.bare(rows["time_s"][-1]) if ended else "the end",
        f"{x[0]:.1f}",
        f"{alive['position'][-1, 0]:.1f}",
        f"{round(float(speed), 2) + 0.0:+.2f}",
        f"{np.nanmax(rows['added'][:, 1]):.1f}",
        f"< {CHANCE_SHOWN:.0e}" if chance < CHANCE_SHOWN else f"{chance:.0e}",
    )


def verdict(lines: Sequence[Sequence[str]], clock: Clock, resting: int) -> str:
    """Say in a sentence what was found, and how many tracks mostly rest and are not shown for that."""
    if not resting:
        return _found(lines, clock, "Nothing was found: nothing exceeded what noise does for long enough.")
    many = "1 sure track mostly rests and is" if resting == 1 else f"{resting} sure tracks mostly rest and are"
    found = _found(lines, clock, "Nothing was found that moves for longer than it rests.")
    return f"{found} {many} not shown (--show all)."


def _found(lines: Sequence[Sequence[str]], clock: Clock, nothing: str) -> str:
    if not lines:
        return nothing
    if len(lines) > 1:
        return f"{len(lines)} tracks were found."
    _, since, _, until, start, _, speed, *_ = lines[0]
    after = " UTC" if clock.one_day else f" {clock.unit}" if clock.kind == "s" else ""
    time = f"frame {since}" if clock.kind == "frame" else since + after
    end = f"to {until}" if until == "the end" else f"to {until}{after}"
    per = "frame" if clock.kind == "frame" else "second"
    return f"One object was found: from {time} {end}, beginning at sample {start}, moving {speed} samples a {per}."


def levels(thresholds: Array) -> str:
    """Say where the threshold stood."""
    known = thresholds[np.isfinite(thresholds)]
    if known.max() - known.min() < 0.005:
        return f"score {known[0]:.2f}"
    return f"score {known[0]:.2f} at first, {known[-1]:.2f} at last"
