"""What the report of a signal says in words and numbers: a line a track, and a sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.contracts import Array
from elusive.results import STATUSES
from elusive.results.spool import Records

CONFIRMED, DELETED = STATUSES.index("confirmed"), STATUSES.index("deleted")
CHANCE_SHOWN = 1e-12  # smaller probabilities are not told apart


def apart(way: Array, period: float) -> Array:
    """Return lengths of ways, the shorter round a ring of this period; infinity where the ends do not meet."""
    length = np.abs(way)
    return np.minimum(length, period - length)


def header(unit: str) -> tuple[str, ...]:
    """Return the names of the columns of :func:`line_of`; ``unit`` is ``s`` or ``frame``."""
    times = (f"{name} [{unit}]" for name in ("Since", "Sure", "Until"))
    return ("Track", *times, "From [sample]", "To [sample]", f"Velocity [samples/{unit}]", "Highest score", "By chance")


def line_of(
    number: int, rows: Records, earlier: Array | None, times: Array, unit: str, period: float
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
    unit
        Of the times, ``s`` or ``frame``.
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
    ended = rows["status"][-1] == DELETED
    return (
        str(number),
        _time(when[0], unit),
        _time(rows["time_s"][rows["status"] == CONFIRMED][0], unit),
        _time(rows["time_s"][-1], unit) if ended else "the end",
        f"{x[0]:.1f}",
        f"{alive['position'][-1, 0]:.1f}",
        f"{round(float(speed), 2) + 0.0:+.2f}",
        f"{np.nanmax(rows['added'][:, 1]):.1f}",
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


def levels(thresholds: Array) -> str:
    """Say where the threshold stood."""
    known = thresholds[np.isfinite(thresholds)]
    if known.max() - known.min() < 0.005:
        return f"score {known[0]:.2f}"
    return f"score {known[0]:.2f} at first, {known[-1]:.2f} at last"


def _time(time: float, unit: str) -> str:
    return f"{time:g}" if unit == "frame" else f"{time:.2f}"
