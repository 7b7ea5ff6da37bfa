"""Spokes that are changed by those a part of a turn before and behind them: held until these have come."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter

import numpy as np
from numpy.typing import NDArray

from elusive.sensors.spokes import Spokes, join_spokes


class HeldSpokes(ABC):
    """Hands spokes on, changed, so many late.

    Parameters
    ----------
    away
        How many before and behind a spoke are looked at; 0: spokes are handed on as they are.
    least
        How many are looked at at once, at least.
    """

    def __init__(self, away: int, least: int = 1) -> None:
        self._away, self._least = away, least
        self._held: Spokes | None = None
        self._told = 0  # of those held, that were handed on

    def add(self, spokes: Spokes, counts: Counter[str]) -> list[Spokes]:
        """Take in spokes; return those that are known by now. ``counts`` gathers what was found in them."""
        if not self._away:
            return [spokes]
        before: list[Spokes] = []
        if self._held is not None and kind_of(self._held) != kind_of(spokes):
            before = self.rest()
        held = spokes if self._held is None else join_spokes([self._held, spokes])
        if len(held.time_s) < self._told + self._away + self._least:
            self._held = held
            return before
        done = self._known(held, counts)
        return [*before, done] if len(done.time_s) else before

    def rest(self) -> list[Spokes]:
        """Return the last spokes, which have none behind them; begin anew."""
        left = [] if self._held is None else [self._held.select_spokes(slice(self._told, None))]
        self._held, self._told = None, 0
        return [one for one in left if len(one.time_s)]

    def _known(self, held: Spokes, counts: Counter[str]) -> Spokes:
        away = self._away
        total, first = len(held.time_s), max(self._told, away)
        last = max(total - away, self._told)
        done = held.select_spokes(slice(self._told, last))
        if last > first:
            changed = self._changed(held.select_spokes(slice(first - away, last + away)), counts)
            if changed is not None:
                whole = done.amplitude.astype(np.float32)
                whole[first - self._told :] = changed
                done = done._replace(amplitude=whole)
        start = max(last - away, 0)
        self._held, self._told = held.select_spokes(slice(start, None)), last - start
        return done

    @abstractmethod
    def _changed(self, spokes: Spokes, counts: Counter[str]) -> NDArray[np.float32] | None:
        """Return amplitudes of all spokes but so many at either end; None: they stay as they are."""


def kind_of(spokes: Spokes) -> tuple[object, ...]:
    """Return what spokes that are joined have in common."""
    amplitude = spokes.amplitude
    return spokes.from_north, spokes.bits, str(amplitude.dtype), spokes.start_m, spokes.step_m, amplitude.shape[1]
