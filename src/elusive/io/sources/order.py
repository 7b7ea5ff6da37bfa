"""Measurements put in the order of their own times: late ones find their place or are counted, repeated ones go."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import TypeVar

from elusive.io.sources.feed import Feed

Item = TypeVar("Item")

MOST = 100_000  # held at a time, whatever their times say


def in_order(
    items: Iterable[Item], time_of: Callable[[Item], float], key_of: Callable[[Item], Hashable], feed: Feed
) -> Iterator[Item]:
    """Yield items in the order of time, each at once where ``feed.hold_s`` is 0.

    One that comes after a later one has been handed over is ``late``; one whose key was there at its time is
    ``repeated``. Both are left out, counted, and the first few said.

    Parameters
    ----------
    items
        As they come.
    time_of, key_of
        An item's time [s], and what tells it from others of that time.
    feed
        Of the source.
    """
    waiting: list[tuple[float, int, Item]] = []
    seen: dict[float, set[Hashable]] = {}
    latest_s = handed_s = -math.inf
    for number, item in enumerate(items):
        time_s, key = time_of(item), key_of(item)
        if time_s < handed_s:
            feed.spoilt(f"A measurement of {time_s:g} s comes after {handed_s:g} s.", "late")
            continue
        keys = seen.setdefault(time_s, set())
        if key in keys:
            feed.spoilt(f"A measurement of {time_s:g} s comes twice.", "repeated")
            continue
        keys.add(key)
        latest_s = max(latest_s, time_s)
        heapq.heappush(waiting, (time_s, number, item))
        while waiting and (waiting[0][0] <= latest_s - feed.hold_s or len(waiting) > MOST):
            handed_s, _, ready = heapq.heappop(waiting)
            for past_s in [past_s for past_s in seen if past_s < handed_s]:
                del seen[past_s]
            yield ready
    while waiting:
        yield heapq.heappop(waiting)[2]
