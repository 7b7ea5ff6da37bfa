"""Measurements put in the order of their own times: late ones find their place or are counted, repeated ones go."""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Hashable, Iterable, Iterator
from itertools import chain
from typing import TypeVar

from elusive.io.sources.clock import SourceClock
from elusive.io.sources.feed import Feed

Item = TypeVar("Item")

MOST = 100_000  # held at a time, whatever their times say


def in_order(
    items: Iterable[Item],
    time_of: Callable[[Item], float],
    key_of: Callable[[Item], Hashable],
    feed: Feed | None,
    moved: Callable[[Item, float], Item] | None = None,
    now_s: Callable[[], float] = time.monotonic,
) -> Iterator[Item]:
    """Yield items in the order of time, each at once where ``feed.hold_s`` is 0; as they are where nothing is live.

    One that comes after a later one has been handed over is ``late``; one whose key was there at its time is
    ``repeated``. Both are left out, counted, and the first few said. Of a clock that was set back the times are counted
    on (:class:`~elusive.io.sources.clock.SourceClock`).

    Parameters
    ----------
    items
        As they come.
    time_of, key_of
        An item's time [s], and what tells it from others of that time.
    feed
        Of the source; None: of a recording.
    moved
        An item at a time that is later by so much [s]; None: a clock that was set back ends the reading.
    now_s
        Time that passes on this machine.

    Raises
    ------
    DataError
        If the clock was set back and items cannot be moved.
    """
    if feed is None:
        yield from items
        return
    waiting: list[tuple[float, int, Item]] = []
    seen: dict[float, set[Hashable]] = {}
    clock, latest_s, number = SourceClock(time_of, moved, feed, now_s), feed.before_s, 0
    for time_s, item in chain(chain.from_iterable(map(clock.judged, items)), clock.rest()):
        keys, key = seen.setdefault(time_s, set()), key_of(item)
        if key in keys:
            feed.spoilt(f"A measurement of {time_s:g} s comes twice.", "repeated")
            continue
        keys.add(key)
        latest_s, number = max(latest_s, time_s), number + 1
        heapq.heappush(waiting, (time_s, number, item))
        while waiting and (waiting[0][0] <= latest_s - feed.hold_s or len(waiting) > MOST):
            clock.handed_s, _, ready = heapq.heappop(waiting)
            for past_s in [past_s for past_s in seen if past_s < clock.handed_s]:
                del seen[past_s]
            yield ready
    while waiting:
        yield heapq.heappop(waiting)[2]
