"""Times in words, the same in a sentence, a table and a drawing: as ``clockOf`` of ``static/base.js`` has them."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

DAY_S, HOUR_S = 86400.0, 3600.0
UNIX_FROM_S = 1e9  # what is later counts from 1970
LONG_S = 2 * HOUR_S
CLOSE_S = 0.095  # times closer than this have two digits


class Clock(NamedTuple):
    """How times of a recording are said."""

    kind: str  # "frame", "s", "hours" or "utc"
    digits: int
    one_day: bool = False  # of "utc": whether all are of one day, which need not be said again and again

    @classmethod
    def of(cls, times: ArrayLike, unit: str = "s") -> Clock:
        """Return the clock of ascending times ``(n,)``; ``unit`` is ``s``, or ``frame`` where they count frames."""
        known = np.asarray(times, dtype=np.float64)
        span = float(known[-1] - known[0]) if len(known) > 1 else 0.0
        gap = span / (len(known) - 1) if len(known) > 1 else 1.0
        digits = 0 if bool(np.all(known == np.floor(known))) else 2 if gap < CLOSE_S else 1
        if unit != "s":
            return cls("frame", digits)
        if len(known) and known[0] >= UNIX_FROM_S:
            return cls("utc", digits, one_day=len(known) > 1 and known[0] // DAY_S == known[-1] // DAY_S)
        return cls("hours" if span >= LONG_S else "s", digits)

    def say(self, time: float) -> str:
        """Return a time with its unit: ``frame 17``, ``4.2 s``, ``02:13:20`` or ``2026-05-04 11:20:00 UTC``."""
        if self.kind == "frame":
            return f"frame {time:.10g}"
        if self.kind == "s":
            return f"{time:.{self.digits}f} s"
        if self.kind == "hours":
            return self.of_day(time)
        return f"{datetime.fromtimestamp(time, UTC):%Y-%m-%d} {self.of_day(time)} UTC"

    def of_day(self, time: float) -> str:
        """Return hours, minutes and seconds, of ``hours`` since the beginning, of ``utc`` since midnight."""
        return self._hours(time % DAY_S if self.kind == "utc" else time)

    @property
    def unit(self) -> str:
        """What the axis of bare times says: ``s``, ``frame``, or nothing."""
        return self.kind if self.kind in ("s", "frame") else ""

    def bare(self, time: float) -> str:
        """Return a time as it is said, less the word, unit or day that a table has in its head or need not have."""
        return self.of_day(time) if self.one_day else self.say(time).removeprefix("frame ").removesuffix(" s")

    def heads(self, *names: str) -> tuple[str, ...]:
        """Return the heads of columns of bare times; of one day they say that it is UTC."""
        unit = "UTC" if self.one_day else self.unit
        return tuple(f"{name} [{unit}]" if unit else name for name in names)

    def _hours(self, time_s: float) -> str:
        whole = round(time_s, self.digits)
        width = 3 + self.digits if self.digits else 2
        return f"{whole // HOUR_S:02.0f}:{whole % HOUR_S // 60:02.0f}:{whole % 60:0{width}.{self.digits}f}"


def moment(time_s: float) -> str:
    """Say a single time [s]."""
    return Clock.of([time_s]).say(time_s)
