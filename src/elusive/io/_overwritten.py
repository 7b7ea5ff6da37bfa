"""Names that a camera writes over again and again, one or a ring of them: each time one is written is a frame."""

from __future__ import annotations

from collections.abc import Mapping

from elusive.io._order import natural_key

MOST = 1000  # names, at most
TIMES = 3  # that names were seen written over, until that is known to be how frames come
Stamp = tuple[int, int]  # size, time of the last change [ns]


class Overwritten:
    """Knows how each file was when it was read."""

    def __init__(self) -> None:
        self.is_so = False
        """Whether frames come by being written over."""
        self._read: dict[str, Stamp] = {}
        self._times = set[tuple[str, Stamp]]()

    def read(self, name: str, stamp: Stamp) -> None:
        """Take note that a file was read, or is not to be."""
        self._read.pop(name, None)
        self._read[name] = stamp
        if len(self._read) > MOST and not self.is_so:
            del self._read[next(iter(self._read))]
        self._times.clear()

    def seen(self, stamps: Mapping[str, Stamp]) -> bool:
        """Look whether names that were read have been written over often enough, while nothing new came."""
        known = self._read
        self._times.update((name, stamp) for name, stamp in stamps.items() if known.get(name, stamp) != stamp)
        if len(self._times) >= TIMES:
            self.is_so = True
            self._read = {name: known.get(name, stamp) for name, stamp in stamps.items()}
        return self.is_so

    def due(self, stamps: Mapping[str, Stamp]) -> list[str]:
        """Return which have been written since they were read, the first that was written first."""
        self._read = {name: stamp for name, stamp in self._read.items() if name in stamps}
        changed = [name for name, stamp in stamps.items() if self._read.get(name) != stamp]
        return sorted(changed, key=lambda name: (stamps[name][1], natural_key(name)))
