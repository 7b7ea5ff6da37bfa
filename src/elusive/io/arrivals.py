"""Measurements as they come: read in a thread of their own and held until the tracker takes them, within bounds."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import Generic, Protocol, TypeVar

from elusive.io.sources.feed import Feed

Item = TypeVar("Item")
Item_co = TypeVar("Item_co", covariant=True)

HELD = 64  # measurements at most
AHEAD = 2  # of those that wait where they are, at most: to read further ahead has no use
NOTHING_MET: Mapping[str, int] = MappingProxyType({})
LOOK_S = 0.1  # how often a waiting reader looks whether it has been stopped


class Coming(Protocol[Item_co]):
    """What a live run reads from."""

    @property
    def came_s(self) -> float:
        """When the measurement that was handed over last had come (``time.monotonic``)."""
        ...

    @property
    def dropped(self) -> int:
        """Measurements that came and were not handed over, because newer ones pushed them out."""
        ...

    @property
    def counts(self) -> Mapping[str, int]:
        """What the source met, by name: ``late``, ``repeated``, ``spoilt``, ``reconnected``, ..."""
        ...

    def __iter__(self) -> Iterator[Item_co]:
        """Yield the measurements, each when it has come."""
        ...

    def stop(self) -> None:
        """End the iteration soon, as if the source had ended."""
        ...


def fed(items: Iterable[Item], feed: Feed) -> Arrivals[Item]:
    """Hand over the items of a source that is read by lines or packets."""
    coming = Arrivals(items, halt=feed.halt, counts=feed.counts)
    coming.start()
    return coming


class Arrivals(Generic[Item]):
    """Hands over the items of an iterable, which a thread reads ahead from when it is started, or the first is taken.

    Parameters
    ----------
    items
        What comes; read once. An item's own ``came_s``, where it has one, says when it came.
    most
        What the items held may weigh together at most.
    weight
        Of an item; by default items are counted.
    held_s
        How long an item that may be left out is held at most: whoever takes them may stand still for so long.
    may_drop
        Whether an item may be left out where the queue is full and it is the oldest; if not, the reader waits. By
        default none may: what is written to a file or a pipe waits there.
    halt
        Wakes and ends a reader that waits for its source.
    counts
        What the source met: see :class:`~elusive.io.sources.Feed`.
    """

    def __init__(
        self,
        items: Iterable[Item],
        most: float = HELD,
        weight: Callable[[Item], float] = lambda item: 1.0,
        held_s: float = math.inf,
        may_drop: Callable[[Item], bool] = lambda item: False,
        halt: Callable[[], None] = lambda: None,
        counts: Mapping[str, int] = NOTHING_MET,
    ) -> None:
        self.came_s, self.dropped, self.counts = math.nan, 0, counts
        self._items, self._most, self._may_drop, self._halt = items, most, may_drop, halt
        self._weight, self._held_s = weight, held_s
        self._held: deque[tuple[Item, float]] = deque()
        self._weighs = 0.0  # what is held
        self._changed = threading.Condition()
        self._is_over = self._is_stopped = False
        self._fault: Exception | None = None
        self._thread = threading.Thread(target=self._read, name="arrivals", daemon=True)
        self._is_started = False

    def start(self) -> None:
        """Begin to read."""
        if not self._is_started:
            self._is_started = True
            self._thread.start()

    def stop(self) -> None:
        """End: nothing more is read; of what is held, what may be dropped is. A signal's handler may call it."""
        self._is_stopped = True
        self._halt()

    def __iter__(self) -> Iterator[Item]:
        """Yield the items in the order in which they came.

        Raises
        ------
        ElusiveError
            What the iterable raised, after all that came before it.
        """
        self.start()
        while True:
            with self._changed:
                while not (self._held or self._is_over or self._is_stopped):
                    self._changed.wait(LOOK_S)
                if not self._held:
                    break
                item, came_s = self._pop()
                self._changed.notify_all()
            if self._is_stopped and self._may_drop(item):
                self.dropped += 1
                continue
            self.came_s = came_s
            yield item
        if self._fault is not None and not self._is_stopped:
            raise self._fault

    def _read(self) -> None:
        try:
            for item in self._items:
                if not self._hold(item, getattr(item, "came_s", None) or time.monotonic()):
                    break
        except Exception as error:  # raised again where the items are taken
            self._fault = error
        finally:
            with self._changed:
                self._is_over = True
                self._changed.notify_all()

    def _pop(self) -> tuple[Item, float]:
        item, came_s = self._held.popleft()
        self._weighs -= self._weight(item)
        return item, came_s

    def _hold(self, item: Item, came_s: float) -> bool:
        weight = self._weight(item)
        with self._changed:
            while self._held and not self._is_stopped:
                oldest, since_s = self._held[0]
                if not self._may_drop(oldest):
                    if len(self._held) < AHEAD:
                        break
                    self._changed.wait(LOOK_S)
                elif self._weighs + weight > self._most or came_s - since_s > self._held_s:
                    self._pop()
                    self.dropped += 1
                else:
                    break
            if not self._is_stopped:
                self._held.append((item, came_s))
                self._weighs += weight
                self._changed.notify_all()
            return not self._is_stopped
