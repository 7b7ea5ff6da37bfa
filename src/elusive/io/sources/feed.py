"""A live source as those who read from it share it: when it ends, what it met, what is said of it."""

from __future__ import annotations

import math
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from elusive.errors import DataError

Item = TypeVar("Item")
Found = TypeVar("Found")

FIRST_S, LONGEST_S = 0.25, 30.0  # waits before a source is tried again, each twice the one before
LOOK_S = 0.1  # how often a waiting reader looks whether it has been stopped
FAULTS_TOLD = 3


class Feed:
    """How a live source is followed, and what it met.

    Parameters
    ----------
    idle_s
        End after this time without anything new; None waits for ever.
    hold_s
        Time, by the measurements' own clock, for which they are held so that late ones find their place.
    say
        Told in a sentence when the source goes, comes back, or gives what cannot be used.
    lenient
        Whether what cannot be used is counted and left out; else it ends the reading.
    known_s, passed_s
        Of a run that goes on: the latest time that is known, and what that of the source should be now.
    again
        Whether what is known comes again first, as of a file, which is read from its start.
    """

    def __init__(
        self,
        idle_s: float | None = None,
        hold_s: float = 0.0,
        say: Callable[[str], None] = lambda sentence: None,
        *,
        lenient: bool = True,
        known_s: float = -math.inf,
        passed_s: float = -math.inf,
        again: bool = False,
    ) -> None:
        self.idle_s, self.hold_s, self.say, self.lenient = idle_s, hold_s, say, lenient
        self.comes_again = again
        """Whether what comes may be known already: until the end of the file is seen."""
        self.counts: Counter[str] = Counter()
        """``late``, ``repeated``, ``spoilt``, ``reconnected``, ...: what was met so far."""
        self.halted = threading.Event()
        self.latest_s = time.monotonic()
        self.known_s, self._passed = known_s, (passed_s, self.latest_s)

    @property
    def before_s(self) -> float:
        """Latest time of a run before, where an earlier one that comes now is of the past."""
        return -math.inf if self.comes_again else self.known_s

    @property
    def passed_s(self) -> float:
        """What the source's time should be now, of a run that goes on."""
        passed_s, since_s = self._passed
        return passed_s + time.monotonic() - since_s

    def looking(self) -> Feed:
        """Return a feed for a first look at what is read again afterwards: it says and counts nothing here."""
        first = Feed(self.idle_s, self.hold_s, lenient=self.lenient)
        first.halted = self.halted
        return first

    def halt(self) -> None:
        """End the waiting, as if the source had ended."""
        self.halted.set()

    def stir(self) -> None:
        """Note that something came."""
        self.latest_s = time.monotonic()

    @property
    def over(self) -> bool:
        """Whether it was halted or has been idle for too long."""
        if self.halted.is_set():
            return True
        return self.idle_s is not None and time.monotonic() - self.latest_s >= self.idle_s

    def spoilt(self, sentence: str, what: str = "spoilt") -> None:
        """Count what cannot be used, and say the first few."""
        self.counts[what] += 1
        if self.counts[what] <= FAULTS_TOLD:
            more = " Further ones are counted." * (self.counts[what] == FAULTS_TOLD)
            self.say(f"{sentence} It is left out.{more}")

    def each(self, items: Iterable[Item], read: Callable[[Item], Found]) -> Iterator[Found]:
        """Read each item; one that cannot be used is counted and left out, where the source is lenient.

        Raises
        ------
        DataError
            Where it is not.
        """
        for item in items:
            try:
                found = read(item)
            except DataError as error:
                if not self.lenient:
                    raise
                self.spoilt(str(error))
                continue
            yield found

    def again(self, name: str, opened: Callable[[], Iterator[Item]]) -> Iterator[Item]:
        """Yield what a source gives, and try again, with longer and longer waits, where it ends or fails.

        Parameters
        ----------
        name
            Of the source, for the sentences.
        opened
            Opens it once; OSError and its end both mean that it is gone.
        """
        wait_s, gone_s = FIRST_S, float("nan")
        while not self.over:
            why = "has ended"
            try:
                for item in opened():
                    if gone_s == gone_s:
                        self.counts["reconnected"] += 1
                        self.say(f"{name}: is back after {time.monotonic() - gone_s:.1f} s.")
                        gone_s = float("nan")
                    wait_s = FIRST_S
                    self.stir()
                    yield item
                    if self.halted.is_set():
                        return
            except OSError as error:
                why = f"cannot be read ({error.strerror or error})"
            if self.over:
                return
            if gone_s != gone_s:
                gone_s = time.monotonic()
                self.say(f"{name}: {why}; it is tried again until it is back.")
            self.halted.wait(wait_s)
            wait_s = min(2 * wait_s, LONGEST_S)
