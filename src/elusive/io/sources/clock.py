"""The clock of a live source: a time that jumps ahead alone is left out, and one that was set back is counted on."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Generic, NamedTuple, TypeVar

from elusive.errors import DataError
from elusive.io.sources.feed import Feed

Item = TypeVar("Item")

AHEAD_S, FASTER = 60.0, 10.0  # a jump ahead of more than that, and so many times what has passed here, is doubted
LASTS_S, FEWEST = 5.0, 5  # for which nothing but earlier times come at their own pace, until the clock was set back
DOUBTED = 1000  # measurements of one time, at most
PACE = 2.0  # times what passes here, at which times that come late are no backlog
JUMBLED_S = 1.0  # by which several sensors' times, as a network jumbles them, are still in order


class _Earlier(NamedTuple):
    """Times in a row, in order but for some jumble, that are earlier than what has been handed over."""

    since_s: float  # of this machine
    first_s: float
    latest_s: float
    times: int = 1  # how many


class SourceClock(Generic[Item]):
    """Judges each measurement's time by those before, and by how much has passed on this machine.

    Parameters
    ----------
    time_of
        A measurement's time [s].
    moved
        A measurement at a time that is later by so much [s]; None: that cannot be done.
    feed
        Of the source.
    now_s
        Time that passes on this machine.
    """

    def __init__(
        self,
        time_of: Callable[[Item], float],
        moved: Callable[[Item, float], Item] | None,
        feed: Feed,
        now_s: Callable[[], float],
    ) -> None:
        self.handed_s = -math.inf
        """Time of the latest measurement that cannot be overtaken any more."""
        self._time_of, self._moved, self._feed, self._now_s = time_of, moved, feed, now_s
        self._shift_s, self._latest_s, self._came_s = 0.0, feed.before_s, now_s()
        self._earlier: _Earlier | None = None
        self._doubted: list[tuple[float, Item]] = []

    def judged(self, item: Item) -> Iterator[tuple[float, Item]]:
        """Yield what can be relied on now, each with its time.

        Raises
        ------
        DataError
            If the clock was set back and the measurements cannot be moved.
        """
        time_s, now_s = self._time_of(item) + self._shift_s, self._now_s()
        if time_s < self._behind_s:
            if not self._is_set_back(time_s, now_s):
                self._feed.spoilt(f"A measurement of {time_s:g} s comes after {self._behind_s:g} s.", "late")
                return
            time_s = self._set_on(time_s, now_s)
        self._earlier = None
        if self._shift_s and self._moved is not None:
            item = self._moved(item, self._shift_s)
        if self._doubted and time_s < self._doubted[0][0]:
            for doubted_s, _ in self._doubted:
                self._feed.spoilt(f"A measurement of {doubted_s:g} s comes before one of {time_s:g} s.")
            self._doubted = []
        if math.isfinite(self._latest_s) and (
            time_s - self._latest_s > AHEAD_S + FASTER * (now_s - self._came_s)
            and (not self._doubted or (time_s == self._doubted[0][0] and len(self._doubted) < DOUBTED))
        ):
            self._doubted.append((time_s, item))
            return
        yield from self.rest()
        self._latest_s, self._came_s = max(self._latest_s, time_s), now_s
        yield time_s, item

    def rest(self) -> Iterator[tuple[float, Item]]:
        """Yield what is doubted, which nothing speaks against."""
        doubted, self._doubted = self._doubted, []
        yield from doubted

    @property
    def _behind_s(self) -> float:
        """Time before which what comes is of the past."""
        return max(self.handed_s, self._feed.before_s)

    def _is_set_back(self, time_s: float, now_s: float) -> bool:
        """Whether earlier times have come for a while, in their order and as fast as time passes."""
        before = self._earlier
        if before is None or time_s < before.latest_s - max(JUMBLED_S, self._feed.hold_s):
            self._earlier = _Earlier(now_s, time_s, time_s)
            return False
        times, latest_s = before.times + (time_s > before.latest_s), max(time_s, before.latest_s)
        self._earlier = now = before._replace(latest_s=latest_s, times=times)
        lasted_s = now_s - now.since_s
        return lasted_s >= LASTS_S and times >= FEWEST and latest_s - now.first_s <= PACE * lasted_s

    def _set_on(self, time_s: float, now_s: float) -> float:
        """Add from now on what the clock was set back by; returns the new time."""
        told = (
            f"The source's clock went back: for {LASTS_S:g} s nothing but times before {self._behind_s:g} s has come, "
            f"now {time_s - self._shift_s:g} s."
        )
        if self._moved is None:
            raise DataError(f"{told} Start anew.")
        there_s = max(self._latest_s + now_s - self._came_s, self._feed.passed_s)
        self._shift_s += there_s - time_s
        self._feed.counts["clock set back"] += 1
        self._feed.say(f"{told} {self._shift_s:.3f} s are added to its times from here on, and tracks go on.")
        return there_s
