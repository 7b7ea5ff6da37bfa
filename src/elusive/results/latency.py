"""How long steps take, over a run of any length: counts in bins of two per cent."""

from __future__ import annotations

import math

import numpy as np

SHORTEST_S, LONGEST_S, RATIO = 1e-5, 1e5, 1.02
BINS = math.ceil(math.log(LONGEST_S / SHORTEST_S, RATIO))


class Latencies:
    """Times taken, at constant memory."""

    def __init__(self) -> None:
        self.count, self.first_s, self.longest_s = 0, math.nan, 0.0
        self._counts = np.zeros(BINS + 1, np.int64)

    def add(self, taken_s: float) -> None:
        """Take in a time [s]."""
        if not self.count:
            self.first_s = taken_s
        self.count += 1
        self.longest_s = max(self.longest_s, taken_s)
        bounded = min(max(taken_s, SHORTEST_S), LONGEST_S)
        self._counts[round(math.log(bounded / SHORTEST_S, RATIO))] += 1

    def quantile_s(self, share: float) -> float:
        """Return the time within which this share was, to one per cent; NaN where there is none."""
        if not self.count:
            return math.nan
        place = int(np.searchsorted(np.cumsum(self._counts), max(1, math.ceil(share * self.count))))
        return min(SHORTEST_S * RATIO**place, self.longest_s)

    def record(self) -> dict[str, float]:
        """Return what there is to say, in milliseconds; the first apart, in which compiled code is loaded."""
        if not self.count:
            return {}
        taken = {"first": self.first_s, "median": self.quantile_s(0.5), "p95": self.quantile_s(0.95)}
        return {name: round(1e3 * time_s, 3) for name, time_s in (taken | {"longest": self.longest_s}).items()}

    @property
    def words(self) -> str:
        """The same as a clause."""
        if not self.count:
            return "none tracked yet"
        ms = self.record()
        return (
            f"from its coming to its tracks {ms['first']:.0f} ms for the first, {ms['median']:.3g} ms in the median, "
            f"{ms['p95']:.3g} ms at 95 %, {ms['longest']:.3g} ms at most"
        )
