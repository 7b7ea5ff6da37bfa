"""What a tracker holds between two measurements: kept for a checkpoint, and gone on from after a restart."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, Protocol, TypeVar


class Timed(Protocol):
    """What was measured at a time."""

    @property
    def time_s(self) -> float:
        """When [s]."""
        ...


Item = TypeVar("Item", bound=Timed)


class Memory:
    """A tracker keeps its state here after each measurement; one that is handed a full memory goes on from that.

    Parameters
    ----------
    held
        State, random numbers and what else the tracker needs; None: it begins.
    first
        The first measurement of all, where that decided something.
    time_s
        Time of the latest measurement that the state knows.
    elapsed_s
        Time that has passed since then, where a clock that starts anew has to be told.
    place
        Where that measurement stands in its source, where one can be gone on from there; None: it is read again.
    """

    def __init__(
        self,
        held: Any = None,
        first: Any = None,
        time_s: float = -math.inf,
        elapsed_s: float = 0.0,
        place: Any = None,
    ) -> None:
        self.held, self.first, self.time_s, self.elapsed_s, self.place = held, first, time_s, elapsed_s, place
        self.passed = 0
        """Measurements that the state knew already."""

    @property
    def kept(self) -> tuple[Any, Any, float, Any]:
        """What a restart needs: held, first, time_s, place."""
        return self.held, self.first, self.time_s, self.place

    def keep(self, time_s: float, *held: Any) -> None:
        """Keep what is known after a measurement."""
        self.time_s, self.held = time_s, held

    def new(self, measurements: Iterable[Item]) -> Iterator[Item]:
        """Yield the measurements that the state does not know yet."""
        latest_s = self.time_s
        for measurement in measurements:
            if measurement.time_s <= latest_s:
                self.passed += 1
                continue
            if self.first is None:
                self.first = measurement
            yield measurement
