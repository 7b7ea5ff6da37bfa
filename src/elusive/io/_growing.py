"""Images of a folder that is being written to: each once it is whole, in natural order."""

from __future__ import annotations

import fnmatch
import os
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from elusive.errors import DataError
from elusive.io._arrived import ArrivedFrame
from elusive.io._images import IMAGES, read_image
from elusive.io._order import natural_key
from elusive.io._overwritten import MOST, Overwritten, Stamp
from elusive.io._stack import EXPORT_AGAIN, decoding

POLL_S = 0.005  # how often the file that is due is looked for
SHARE = 10  # a listing of the folder takes one part in so many of the time at most
SETTLED_S = 0.02  # for which a file that has no check sum must have been left alone
LATE_S = 0.25  # for which a number that is missing is waited for
BROKEN_S = 1.0  # after which a file that cannot be read and is not written to any more is given up
ANEW = 3  # names that show that a folder was begun anew
REGULAR = 4  # names in a row that show how they are numbered
LAST_NUMBER = re.compile(r"^(.*?)([0-9]+)([^0-9]*)$", re.DOTALL)
DIGITS = str.maketrans("123456789", "000000000")


def lacking(earlier: str, later: str, step: int) -> int:
    """Return how many names lack between two that are numbered by a step; 0 where that is not known."""
    first, last = LAST_NUMBER.match(earlier), LAST_NUMBER.match(later)
    if not step or first is None or last is None or (first[1], first[3]) != (last[1], last[3]):
        return 0
    return max(0, (int(last[2]) - int(first[2])) // step - 1)


class _Seen(NamedTuple):
    since_s: float  # when it was first seen as it is (monotonic)
    stamp: Stamp
    came_s: float


class GrowingFolder:
    """Images that are written to a folder.

    Names tell the order. A name that comes before one that has been read is too late, and is left out; but where the
    latest is gone and all that is there came after it was read, the folder was begun anew, and is read from its start.
    Where nothing new comes and names that have been read are written over, each time one is written is a frame.

    Parameters
    ----------
    folder
        Where they are written.
    pattern
        Which names are frames; None: those of images, all of the first's kind.
    idle_s
        End after this time without a new one; None waits for ever.
    say
        Told that the folder was begun anew, or that its files are written over.

    Raises
    ------
    DataError
        If there is no such folder.
    """

    def __init__(
        self,
        folder: Path,
        pattern: str | None = None,
        idle_s: float | None = None,
        say: Callable[[str], None] = lambda sentence: None,
    ) -> None:
        if not folder.is_dir():
            raise DataError(f"{folder}: is no folder; --follow waits for the images that are written to one.")
        self.name = str(folder)
        self.late = 0
        self.begun: int | None = None
        """Frames that were there when the folder was found to be begun anew, where it was."""
        self._say, self._read_s = say, 0.0
        self._folder, self._pattern, self._idle_s = folder, pattern, idle_s
        self._halted = threading.Event()
        self._seen: dict[str, _Seen] = {}  # not yet read
        self._over, self._stamps_s = Overwritten(), 0.0
        self._latest: str | None = None
        self._numbers: deque[int] = deque(maxlen=REGULAR)  # of the latest names
        self._passed = 0  # names read or given up, or there before
        self._started_s = self._looked_s = self._due_s = 0.0

    def halt(self) -> None:
        """End the waiting."""
        self._halted.set()

    def go_on(self, latest: str, step: int, elapsed_s: float) -> None:
        """Begin after a name that was read so long ago; ``step``: by which names are numbered, 0 where they are not."""
        self._latest, self._read_s = latest, time.time() - elapsed_s
        found = LAST_NUMBER.match(latest)
        if found and step:
            self._numbers.extend(int(found[2]) - step * k for k in reversed(range(REGULAR)))
        with suppress(OSError), os.scandir(self._folder) as entries:  # a folder that is gone is said when it is read
            names = [entry.name for entry in entries if self._is_frame(entry.name)]
            before = [name for name in names if not self._comes_after(name)]
            self._passed = len(before)
            for name, stamp in self._stamps(before if len(before) <= MOST else ()).items():
                self._over.read(name, stamp)

    def __iter__(self) -> Iterator[ArrivedFrame]:
        """Yield the frames; without pixels, and with the reason, where a file stays unreadable.

        Raises
        ------
        DataError
            If the folder vanishes.
        """
        number, active_s = 0, time.monotonic()
        self._started_s = self._looked_s = active_s
        while not self._halted.is_set():
            frame = self._next(f"(frame {number})")
            now_s = time.monotonic()
            if frame is not None:
                if frame.came_s <= self._started_s:
                    frame = frame._replace(waits=True, came_s=now_s)
                yield frame
                number += 1
                active_s = time.monotonic()
            elif self._idle_s is not None and not self._seen and now_s - active_s >= self._idle_s:
                return
            else:
                self._halted.wait(POLL_S)

    def _next(self, what: str) -> ArrivedFrame | None:
        """Return the frame that is due, if it is there and whole."""
        name = self._due()
        if name is None:
            return None
        path, seen = self._folder / name, self._seen[name]
        where = f"{path} {what}"
        try:
            stamp = _stamp(path)
        except FileNotFoundError:  # moved away before it was read
            del self._seen[name]
            return None
        now_s = time.monotonic()
        if stamp != seen.stamp:
            seen = self._seen[name] = _Seen(now_s, stamp, self._came_s(stamp, now_s))
        left_alone_s = max(now_s - seen.since_s, time.time() - stamp[1] / 1e9)
        if path.suffix.lower() != ".png" and left_alone_s < SETTLED_S:
            return None
        try:
            with decoding(where, EXPORT_AGAIN):
                raw = read_image(path, where)
            if _is_written_to(path, stamp):
                return None
        except DataError as error:
            if now_s - seen.since_s < BROKEN_S:
                return None
            self._pass(name, stamp)
            return ArrivedFrame(where, None, seen.came_s, fault=str(error), name=name, step=self._step())
        self._pass(name, stamp)
        return ArrivedFrame(where, raw, seen.came_s, name=name, step=self._step())

    def _pass(self, name: str, stamp: Stamp) -> None:
        del self._seen[name]
        self._over.read(name, stamp)
        self._latest, self._read_s = name, time.time()
        self._passed += 1
        found = LAST_NUMBER.match(name)
        self._numbers.append(int(found[2]) if found else 0)

    def _due(self) -> str | None:
        """Return the name that is to be read next."""
        expected = self._expected()
        if expected is not None and expected not in self._seen:
            self._look_at(expected)
        if (expected is None or expected not in self._seen) and time.monotonic() >= self._due_s:
            self._list()
        if not self._seen:
            return None
        first = expected if expected in self._seen else next(iter(self._seen))
        missing = expected is not None and first != expected
        if missing and time.monotonic() - self._seen[first].since_s < LATE_S:
            return None
        return first

    def _expected(self) -> str | None:
        """Return the name that follows from the latest, where they have been numbered evenly."""
        step = 0 if self._over.is_so else self._step()
        found = LAST_NUMBER.match(self._latest) if self._latest is not None and step else None
        if found is None:
            return None
        return f"{found[1]}{self._numbers[-1] + step:0{len(found[2])}d}{found[3]}"

    def _step(self) -> int:
        """Return by how much the latest names are numbered; 0 where they are not, or unevenly."""
        steps = {later - earlier for earlier, later in pairwise(self._numbers)}
        return max(0, steps.pop()) if len(self._numbers) == REGULAR and len(steps) == 1 else 0

    def _look_at(self, name: str) -> None:
        now_s = time.monotonic()
        try:
            stamp = _stamp(self._folder / name)
        except OSError:
            self._looked_s = now_s
            return
        self._seen[name] = _Seen(now_s, stamp, self._came_s(stamp, now_s))

    def _came_s(self, stamp: Stamp, now_s: float) -> float:
        """When a file came: when it was last written to, but after the last look, at which it was not there."""
        return min(max(now_s - (time.time() - stamp[1] / 1e9), self._looked_s), now_s)

    def _list(self) -> None:
        """Look through the folder for names that come after the latest."""
        begun_s = time.monotonic()
        try:
            with os.scandir(self._folder) as entries:
                names = [entry.name for entry in entries if self._is_frame(entry.name)]
        except OSError as error:
            raise DataError(f"{self._folder}: cannot be read any more ({error.strerror}).") from None
        after = [name for name in names if self._comes_after(name)]
        if not after and self._is_anew(names):
            self._say(
                f"{self._folder}: was begun anew: {self._latest} is gone, and {len(names)} frames came after it whose "
                "names come before. It is read from its start, and the tracks go on."
            )
            self._latest, self._passed, self.begun, after = None, 0, len(names), names
            self._numbers.clear()
        if not after and not self._over.is_so and len(names) <= MOST and begun_s >= self._stamps_s:
            self._stamps_s = begun_s + LATE_S
            if self._over.seen(self._stamps(names)):
                self._say(f"{self._folder}: files are written over; each time one of them is written is a frame.")
        if self._over.is_so:
            after = self._over.due(self._stamps(names))
        else:
            self.late = max(0, len(names) - len(after) - self._passed)
        new = [name for name in after if name not in self._seen]
        for name in new:
            self._look_at(name)
        if new and not self._over.is_so:
            self._seen = {name: self._seen[name] for name in sorted(self._seen, key=natural_key)}
        if self._pattern is None and self._seen:
            self._pattern = f"*{Path(next(iter(self._seen))).suffix}"
            self._seen = {name: seen for name, seen in self._seen.items() if self._is_frame(name)}
        now_s = time.monotonic()
        self._looked_s, self._due_s = begun_s, now_s + max(POLL_S, SHARE * (now_s - begun_s))

    def _stamps(self, names: Sequence[str]) -> dict[str, Stamp]:
        found = {}
        for name in names:
            with suppress(OSError):  # removed meanwhile
                found[name] = _stamp(self._folder / name)
        return found

    def _is_anew(self, names: Sequence[str]) -> bool:
        if self._latest is None or len(names) < ANEW or self._latest in names:
            return False
        try:
            return min((self._folder / name).stat().st_ctime for name in names) > self._read_s
        except OSError:  # removed meanwhile
            return False

    def _is_frame(self, name: str) -> bool:
        if name.startswith(".") or os.path.splitext(name)[1].lower() not in IMAGES:
            return False
        return self._pattern is None or fnmatch.fnmatchcase(name, self._pattern)

    def _comes_after(self, name: str) -> bool:
        latest = self._latest
        if latest is None:
            return True
        if len(name) == len(latest) and name.translate(DIGITS) == latest.translate(DIGITS):
            return name > latest  # digits at the same places: the order of text is that of numbers
        return natural_key(name) > natural_key(latest)


def _is_written_to(path: Path, stamp: Stamp) -> bool:
    """Whether a file has changed; one that was removed once it was read has not."""
    try:
        return _stamp(path) != stamp
    except FileNotFoundError:
        return False


def _stamp(path: Path) -> Stamp:
    found = path.stat()
    return found.st_size, found.st_mtime_ns
